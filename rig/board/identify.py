"""Checks that board and sensors are those of the configuration, and that the firmware is this program's."""

from functools import partial
from math import isclose

from firmware_host.client import Board, BoardIdentity, SensorInfo, StoredCalibration
from firmware_host.parts import BOARD_PARTS
from firmware_host.protocol import FIRMWARE_VERSION
from rig.config.models import BoardSection, SensorsConfig
from rig.config.sensors.sensor_sections import ConfiguredSensor, SensorSection
from rig.errors import Fault, Refused, raise_as

UNDRIVEN_BYTES = (0x00, 0xFF, 0x0000, 0xFFFF)  # an SPI bus reads this if no part drives it


refusing = partial(raise_as, Refused)  # before anything has moved
changing = partial(raise_as, Fault)  # while the board is being changed, a refusal is too late


def require_board_section(config: SensorsConfig) -> BoardSection:
    """Return the section `board`. Raise Refused `no_board_section` if every sensor has a port of its own."""
    if config.board is None:
        raise Refused(
            "no_board_section",
            "the configuration has no section board: its sensors have ports of their own",
            "Name a configuration with a board; inspect a KVH 1775 with `rig kvh info`",
        )
    return config.board


def refuse_other_firmware(identity: BoardIdentity) -> None:
    """Raise Refused `firmware_version` unless the board runs the firmware of this version of the rig."""
    if identity.firmware != FIRMWARE_VERSION:
        raise Refused(
            "firmware_version",
            f"the board {identity.unique_id} runs firmware {identity.firmware}, but this program comes with "
            f"{FIRMWARE_VERSION}",
            "Flash the image that comes with this program: `rig board flash`",
        )


def sensor_entry(identity: BoardIdentity, name: str, section: ConfiguredSensor) -> SensorInfo:
    """Return the board's entry for a configured sensor, even of another part. Raise Refused `sensor_missing`."""
    for info in identity.sensors:
        if spell_part(info.part) == section.part:
            return info
    raise _missing(name, section, "no driver for it")


def find_sensor(identity: BoardIdentity, name: str, section: ConfiguredSensor) -> SensorInfo:
    """Return the board's entry for a sensor that answers. Raise Refused `sensor_missing`, `sensor_mismatch`."""
    info = sensor_entry(identity, name, section)
    if info.present:
        return info
    if info.who_am_i in UNDRIVEN_BYTES:
        raise _missing(name, section, f"nothing answers: its identity reads 0x{info.who_am_i:02x}")
    raise Refused(
        "sensor_mismatch",
        f"sensors.{name}: in the place of the {section.part} answers "
        f"{BOARD_PARTS[section.part].describe_other(info.who_am_i)}",
        "Check which part is fitted, its chip select, and sensors.*.part in the configuration",
    )


def _missing(name: str, section: ConfiguredSensor, finding: str) -> Refused:
    return Refused(
        "sensor_missing",
        f"sensors.{name}: the board finds no {section.part} ({finding})",
        "Check the sensor's supply and SPI wires, and sensors.*.part in the configuration",
    )


def read_stored_calibration(board: Board, name: str, section: SensorSection) -> StoredCalibration:
    """Read the calibration with which the board corrects a sensor's readings.

    Raise Refused `no_calibration`, and what `find_sensor` and `refuse_other_sensor` raise.
    """
    stored = board.read_calibration(find_sensor(board.identity, name, section).index)
    if stored is None:
        raise Refused(
            "no_calibration",
            f"sensors.{name}: the board has no calibration stored, so it cannot correct readings",
            "Calibrate it first, or store a calibration with `rig board calibration write`",
        )
    refuse_other_sensor(
        f"sensors.{name}: the calibration stored on the board",
        spell_part(stored.part),
        stored.calibration.serial_number,
        stored.range_deg_s,
        section,
    )
    return stored


def refuse_other_sensor(
    calibration: str, part: str, serial_number: str, range_deg_s: float, section: SensorSection
) -> None:
    """Raise Refused `another_sensor`, `another_range` if a calibration does not fit the configured sensor.

    `calibration` names the calibration in the message; it was made for `part`, `serial_number` and `range_deg_s`.
    """
    if (part, serial_number) != (section.part, section.serial_number):
        raise Refused(
            "another_sensor",
            f"{calibration} is of {part} {serial_number}, but the configuration states {section.part} "
            f"{section.serial_number}",
            "Calibrate this sensor, or correct part and serial_number in the configuration",
        )
    if not isclose(range_deg_s, section.range_deg_s, rel_tol=1e-6):
        raise Refused(
            "another_range",
            f"{calibration} holds for {range_deg_s:g} °/s, but the configuration states {section.range_deg_s:g} °/s",
            "Set range_deg_s to the range of its calibration, or calibrate at this range",
        )


def spell_part(part: str) -> str:
    """Return a part's name in the configuration's spelling; the board uses the maker's spelling."""
    names = {part_on_board.name: name for name, part_on_board in BOARD_PARTS.items()}
    return names.get(part, part.lower())

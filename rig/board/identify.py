"""Whether the board and the sensors on it are what the configuration and this program expect."""

from functools import partial
from math import isclose

from firmware_host.client import Board, BoardIdentity, SensorInfo, StoredCalibration
from firmware_host.parts import BOARD_PARTS
from firmware_host.protocol import FIRMWARE_VERSION
from rig.config.models import BoardSection, SensorsConfig
from rig.config.sensors.sensor_sections import ConfiguredSensor, SensorSection
from rig.errors import Fault, Refused, raised_as

NOBODY = (0x00, 0xFF, 0x0000, 0xFFFF)  # what a bus reads where no part drives it


refusing = partial(raised_as, Refused)  # before anything has moved
changing = partial(raised_as, Fault)  # while the board is being changed: no refusal any more


def configured_board(config: SensorsConfig) -> BoardSection:
    """Raises Refused `no_board_section` where every sensor has a port of its own."""
    if config.board is None:
        raise Refused(
            "no_board_section",
            "the configuration has no section board: its sensors have ports of their own",
            "Name a configuration with a board; a KVH 1775 is looked at with `rig kvh info`",
        )
    return config.board


def refuse_other_firmware(identity: BoardIdentity) -> None:
    """Raises Refused `firmware_version` unless the board runs the image that comes with this program."""
    if identity.firmware != FIRMWARE_VERSION:
        raise Refused(
            "firmware_version",
            f"the board {identity.unique_id} runs firmware {identity.firmware}, this program comes with "
            f"{FIRMWARE_VERSION}",
            "Flash the image that comes with this program: `rig board flash`",
        )


def sensor_entry(identity: BoardIdentity, name: str, section: ConfiguredSensor) -> SensorInfo:
    """The board's entry for a configured sensor, whatever answers in its place. Raises Refused `sensor_missing`."""
    for info in identity.sensors:
        if configured_part(info.part) == section.part:
            return info
    raise _missing(name, section, "no driver for it")


def find_sensor(identity: BoardIdentity, name: str, section: ConfiguredSensor) -> SensorInfo:
    """The board's entry for a configured sensor that answers. Raises Refused `sensor_missing` or `sensor_mismatch`."""
    info = sensor_entry(identity, name, section)
    if info.present:
        return info
    if info.who_am_i in NOBODY:
        raise _missing(name, section, f"nothing answers: its identity reads 0x{info.who_am_i:02x}")
    raise Refused(
        "sensor_mismatch",
        f"sensors.{name}: in the place of the {section.part} answers "
        f"{BOARD_PARTS[section.part].another(info.who_am_i)}",
        "Check which part is fitted, its chip select, and sensors.*.part in the configuration",
    )


def _missing(name: str, section: ConfiguredSensor, seen: str) -> Refused:
    return Refused(
        "sensor_missing",
        f"sensors.{name}: the board finds no {section.part} ({seen})",
        "Check the sensor's supply and SPI wires, and sensors.*.part in the configuration",
    )


def stored_calibration(board: Board, name: str, section: SensorSection) -> StoredCalibration:
    """What the board has stored to correct a configured sensor's readings by.

    Raises Refused `no_calibration`, and as `find_sensor` and `refuse_other_sensor`.
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
        configured_part(stored.part),
        stored.calibration.serial_number,
        stored.range_deg_s,
        section,
    )
    return stored


def refuse_other_sensor(
    calibration: str, part: str, serial_number: str, range_deg_s: float, section: SensorSection
) -> None:
    """Raises Refused `another_sensor`, `another_range` unless a calibration is of the configured sensor and range.

    `calibration` says which calibration it is; `part`, `serial_number` and `range_deg_s` what it was made for.
    """
    if (part, serial_number) != (section.part, section.serial_number):
        raise Refused(
            "another_sensor",
            f"{calibration} is of {part} {serial_number}, the configuration says {section.part} "
            f"{section.serial_number}",
            "Calibrate this sensor, or correct part and serial_number in the configuration",
        )
    if not isclose(range_deg_s, section.range_deg_s, rel_tol=1e-6):
        raise Refused(
            "another_range",
            f"{calibration} holds for {range_deg_s:g} °/s, the configuration says {section.range_deg_s:g} °/s",
            "Set range_deg_s to what it was calibrated at, or calibrate at this range",
        )


def configured_part(part: str) -> str:
    """A part as the configuration spells it; the board names parts as their makers do."""
    spelt = {on_board.name: name for name, on_board in BOARD_PARTS.items()}
    return spelt.get(part, part.lower())

"""What `rig board info` and `calibration` do: look at the board, read and change the calibrations it has stored."""

import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from math import degrees
from pathlib import Path

from firmware_host.client import Board, Calibration, StoredCalibration
from rig.board.crystal import follows_crystal
from rig.board.identify import (
    changing,
    find_sensor,
    refuse_other_firmware,
    refuse_other_sensor,
    refusing,
    require_board_section,
    sensor_entry,
    spell_part,
)
from rig.board.store import calibration_of, store
from rig.commands.laboratory.claims import claim_board
from rig.commands.laboratory.laboratory import simulated_laboratory
from rig.commands.laboratory.own_address import load_at_own_address
from rig.config.models import RigConfig
from rig.config.sensors.sensor_sections import SensorSection
from rig.data.quantity import RATE
from rig.data.result_file import ResultDocument, read_passed_result
from rig.errors import Fault, Refused
from rig.report.terminal.board_info import BoardInfo, BoardSensorRow, print_info, print_stored
from rig.station.confirm import agreed_or_refused
from rig.station.plain_text import say


@dataclass(frozen=True, slots=True)
class _Place:
    """A configured sensor's place on the board."""

    name: str
    section: SensorSection
    index: int
    stored: StoredCalibration | None


def info(options: Namespace) -> int:
    """Print the board's identity, health, sensors and stored calibrations."""
    with _connected(options) as (config, board), refusing():
        calibrations = [
            board.read_calibration(sensor.index) if sensor.quantity == "rate" else None
            for sensor in board.identity.sensors
        ]
        names: dict[str, str] = {section.part: name for name, section in config.parts_on_board.items()}
        follows_crystal(board)  # of a board that has just started one waits for the crystal
        status = board.status()
        sensors = tuple(
            BoardSensorRow(sensor, names.get(spell_part(sensor.part)), counts, stored)
            for sensor, counts, stored in zip(board.identity.sensors, status.sensors, calibrations, strict=True)
        )
        found = BoardInfo(require_board_section(config).port, board.identity, status, sensors)
    print_info(found, as_json=options.json)
    return 0


def read(options: Namespace) -> int:
    """Print the calibrations the board has stored, of one sensor or of all."""
    with _connected(options) as (config, board):
        places = _places(board, config, options.sensor, config.sensors)
    for place in places:
        if place.stored is not None and place.stored.calibration.serial_number != place.section.serial_number:
            say(f"{place.name}: stored for another sensor than {place.section.serial_number}", file=sys.stderr)
    print_stored({place.name: place.stored for place in places}, as_json=options.json)
    return 0


def write(options: Namespace) -> int:
    """Store a run's calibration on the board, of one sensor or of all that were to be calibrated."""
    result = read_passed_result(options.result)
    with _connected(options) as (config, board):
        refuse_other_firmware(board.identity)
        places = _places(board, config, options.sensor, config.to_calibrate)
        found = {place.name: _result_of(place, result, options.result) for place in places}
        for place in places:
            find_sensor(board.identity, place.name, place.section)
        agreed_or_refused(_on(board, (_replacing(place, found[place.name]) for place in places)), "store", options.yes)
        with changing():
            for place in places:
                board.configure(place.index, place.section.rate_hz, place.section.range_deg_s)
                record = store(board, place.index, found[place.name])
                say(f"stored: {place.name}, {_in_words(record)}")
    return 0


def erase(options: Namespace) -> int:
    """Let the board forget the calibration of one sensor or of all that are configured."""
    with _connected(options) as (config, board):
        refuse_other_firmware(board.identity)
        places = [place for place in _places(board, config, options.sensor, config.sensors) if place.stored is not None]
        if not places:
            print("nothing to erase: no calibration is stored")
            return 0
        losses = (f"{place.name}: erases {_in_words(place.stored)}" for place in places if place.stored is not None)
        agreed_or_refused(_on(board, losses), "erase", options.yes)
        with changing():
            for place in places:
                board.erase_calibration(place.index)
                if board.read_calibration(place.index) is not None:
                    raise Fault(
                        "not_erased",
                        f"the board still has a calibration for {place.name} after it was erased",
                        "Try again; if that does not help, replace the microcontroller board",
                    )
                say(f"erased: {place.name}")
    return 0


@contextmanager
def _connected(options: Namespace) -> Iterator[tuple[RigConfig, Board]]:
    """The board of a configuration, in its simulated laboratory if it has one."""
    with ExitStack() as stack:
        loaded = stack.enter_context(load_at_own_address(options.config, options.overrides))
        section = require_board_section(loaded.config)
        if loaded.simulated:
            stack.enter_context(simulated_laboratory(loaded.text))
            kept = loaded.flash_file
            memory = f"is kept in {kept}" if kept else "too, unless world.board.flash_file names a file that keeps it"
            say(f"simulated laboratory: it lasts as long as this command, its board's memory {memory}", file=sys.stderr)
        stack.enter_context(claim_board(section.port))
        with refusing():
            board = stack.enter_context(Board(section.port, section.baud, lambda batch: None))
        yield loaded.config, board


def _places(board: Board, config: RigConfig, sensor: str | None, among: Mapping[str, SensorSection]) -> list[_Place]:
    """The configured sensors a command is about, and what is stored for them.

    Raises Refused `no_such_sensor`, `sensor_missing`.
    """
    among = {name: section for name, section in among.items() if section.on_board}
    if sensor is not None and sensor not in among:
        raise Refused(
            "no_such_sensor",
            f"--sensor {sensor}: the configuration has no such sensor for this",
            f"Choose one of: {', '.join(among)}",
        )
    places = []
    for name in [sensor] if sensor is not None else among:
        section = config.sensors[name]
        index = sensor_entry(board.identity, name, section).index
        with refusing():
            places.append(_Place(name, section, index, board.read_calibration(index)))
    return places


def _result_of(place: _Place, result: ResultDocument, path: Path) -> Calibration:
    """The run's calibration of a sensor. Raises Refused `not_in_result`, and as `refuse_other_sensor`."""
    entry = result.gyroscopes.get(place.name)
    if entry is None or entry.role == "reference":
        raise Refused(
            "not_in_result",
            f"{path} has no calibration for sensors.{place.name}",
            f"It has: {', '.join(result.gyroscopes) or 'none'}; choose one with --sensor",
        )
    if entry.range_rad_s is None:
        raise Refused(
            "not_in_result",
            f"{path} does not say in which range {place.name} was read: its readings were recorded elsewhere",
            "Calibrate it on the board that is to keep its calibration",
        )
    calibration, range_deg_s = f"{path}: the calibration of {place.name}", degrees(entry.range_rad_s)
    refuse_other_sensor(calibration, entry.part, entry.serial_number, range_deg_s, place.section)
    return calibration_of(entry, result.over_temperature.get(place.name, {}).get(RATE.name))


def _on(board: Board, changes: Iterable[str]) -> list[str]:
    return [f"On the board {board.identity.unique_id}:", *(f"  {change}" for change in changes)]


def _replacing(place: _Place, calibration: Calibration) -> str:
    scale = " ".join(f"{value:.5f}" for value in calibration.scale)
    bias = " ".join(f"{value:+.5f}" for value in calibration.bias_rad_s)
    old = f"replaces {_in_words(place.stored)}" if place.stored is not None else "nothing was stored before"
    return f"{place.name}: scale {scale}, bias {bias} rad/s{_corrected_from(calibration)}; {old}"


def _corrected_from(calibration: Calibration) -> str:
    if calibration.polynomials is None:
        return ""
    low, high = calibration.polynomials.range_c
    return f", at {calibration.temperature_c:g} °C, corrected by temperature from {low:.1f} to {high:.1f} °C"


def _in_words(stored: StoredCalibration) -> str:
    calibration = stored.calibration
    return (
        f"record {stored.sequence} of {calibration.written_utc:%Y-%m-%d %H:%M} UTC for {stored.part} "
        f"{calibration.serial_number} at {stored.range_deg_s:g} °/s{_corrected_from(calibration)}"
    )

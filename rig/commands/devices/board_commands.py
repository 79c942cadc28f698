"""The commands `rig board info` and `calibration`: inspect the board, read and change its stored calibrations."""

import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from math import degrees
from pathlib import Path

from firmware_host.client import Board, Calibration, StoredCalibration
from rig.board.crystal import follows_crystal
from rig.board.flash_store import calibration_of, store
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
from rig.commands.laboratory.claims import claim_board
from rig.commands.laboratory.laboratory_process import run_simulated_laboratory
from rig.commands.laboratory.own_address import load_at_own_address
from rig.config.models import RigConfig
from rig.config.sensors.sensor_sections import SensorSection
from rig.data.quantity import RATE
from rig.data.result_file import ResultDocument, read_passed_result
from rig.errors import Fault, Refused
from rig.report.terminal.board_info import BoardInfo, BoardSensorRow, print_info, print_stored
from rig.station.confirm import require_agreement
from rig.station.plain_text import say


@dataclass(frozen=True, slots=True)
class BoardSlot:
    """A configured sensor, its `index` on the board, and the calibration that the board has stored for it, if any."""

    name: str
    section: SensorSection
    index: int
    stored: StoredCalibration | None


def info(options: Namespace) -> int:
    """Print the board's identity, health, sensors and stored calibrations; return 0."""
    with _connect(options) as (config, board), refusing():
        calibrations = [
            board.read_calibration(sensor.index) if sensor.quantity == "rate" else None
            for sensor in board.identity.sensors
        ]
        names: dict[str, str] = {section.part: name for name, section in config.parts_on_board.items()}
        follows_crystal(board)  # waits for the crystal of a board that has just started
        status = board.status()
        sensors = tuple(
            BoardSensorRow(sensor, names.get(spell_part(sensor.part)), counts, stored)
            for sensor, counts, stored in zip(board.identity.sensors, status.sensors, calibrations, strict=True)
        )
        board_info = BoardInfo(require_board_section(config).port, board.identity, status, sensors)
    print_info(board_info, as_json=options.json)
    return 0


def read(options: Namespace) -> int:
    """Print the calibrations stored on the board, of one sensor or of all; return 0."""
    with _connect(options) as (config, board):
        slots = _read_slots(board, config, options.sensor, config.sensors)
    for slot in slots:
        if slot.stored is not None and slot.stored.calibration.serial_number != slot.section.serial_number:
            say(f"{slot.name}: stored for another sensor than {slot.section.serial_number}", file=sys.stderr)
    print_stored({slot.name: slot.stored for slot in slots}, as_json=options.json)
    return 0


def write(options: Namespace) -> int:
    """Store a run's calibration of one sensor, or of all that the configuration calibrates; return 0."""
    result = read_passed_result(options.result)
    with _connect(options) as (config, board):
        refuse_other_firmware(board.identity)
        slots = _read_slots(board, config, options.sensor, config.to_calibrate)
        calibrations = {slot.name: _select_calibration(slot, result, options.result) for slot in slots}
        for slot in slots:
            find_sensor(board.identity, slot.name, slot.section)
        require_agreement(
            _announce(board, (_describe_replacement(slot, calibrations[slot.name]) for slot in slots)),
            "store",
            options.yes,
        )
        with changing():
            for slot in slots:
                board.configure(slot.index, slot.section.rate_hz, slot.section.range_deg_s)
                record = store(board, slot.index, calibrations[slot.name])
                say(f"stored: {slot.name}, {_describe_record(record)}")
    return 0


def erase(options: Namespace) -> int:
    """Erase the calibrations of one sensor or of all configured ones; return 0. Raise Fault `not_erased`."""
    with _connect(options) as (config, board):
        refuse_other_firmware(board.identity)
        slots = [slot for slot in _read_slots(board, config, options.sensor, config.sensors) if slot.stored is not None]
        if not slots:
            print("nothing to erase: no calibration is stored")
            return 0
        losses = (f"{slot.name}: erases {_describe_record(slot.stored)}" for slot in slots if slot.stored is not None)
        require_agreement(_announce(board, losses), "erase", options.yes)
        with changing():
            for slot in slots:
                board.erase_calibration(slot.index)
                if board.read_calibration(slot.index) is not None:
                    raise Fault(
                        "not_erased",
                        f"the board still has a calibration for {slot.name} after it was erased",
                        "Try again; if that does not help, replace the microcontroller board",
                    )
                say(f"erased: {slot.name}")
    return 0


@contextmanager
def _connect(options: Namespace) -> Iterator[tuple[RigConfig, Board]]:
    """Yield a configuration and a connection to its board; start the simulated laboratory, if any."""
    with ExitStack() as stack:
        loaded = stack.enter_context(load_at_own_address(options.config, options.overrides))
        section = require_board_section(loaded.config)
        if loaded.simulated:
            stack.enter_context(run_simulated_laboratory(loaded.text))
            file = loaded.flash_file
            memory = f"is kept in {file}" if file else "too, unless world.board.flash_file names a file that keeps it"
            say(f"simulated laboratory: it lasts as long as this command, its board's memory {memory}", file=sys.stderr)
        stack.enter_context(claim_board(section.port))
        with refusing():
            board = stack.enter_context(Board(section.port, section.baud, lambda batch: None))
        yield loaded.config, board


def _read_slots(
    board: Board, config: RigConfig, sensor: str | None, among: Mapping[str, SensorSection]
) -> list[BoardSlot]:
    """Return the command's sensors on the board, each with its stored calibration, if any.

    `sensor` names the only one; if it is None, all sensors in `among` are meant. Raise Refused `no_such_sensor`,
    `sensor_missing`.
    """
    among = {name: section for name, section in among.items() if section.on_board}
    if sensor is not None and sensor not in among:
        raise Refused(
            "no_such_sensor",
            f"--sensor {sensor}: the configuration has no such sensor for this",
            f"Choose one of: {', '.join(among)}",
        )
    slots = []
    for name in [sensor] if sensor is not None else among:
        section = config.sensors[name]
        index = sensor_entry(board.identity, name, section).index
        with refusing():
            slots.append(BoardSlot(name, section, index, board.read_calibration(index)))
    return slots


def _select_calibration(slot: BoardSlot, result: ResultDocument, path: Path) -> Calibration:
    """Return a sensor's calibration in the run. Raise Refused `not_in_result` and what `refuse_other_sensor` raises."""
    entry = result.gyroscopes.get(slot.name)
    if entry is None or entry.role == "reference":
        raise Refused(
            "not_in_result",
            f"{path} has no calibration for sensors.{slot.name}",
            f"It has: {', '.join(result.gyroscopes) or 'none'}; choose one with --sensor",
        )
    if entry.range_rad_s is None:
        raise Refused(
            "not_in_result",
            f"{path} does not say in which range {slot.name} was read: its readings were recorded elsewhere",
            "Calibrate it on the board that is to keep its calibration",
        )
    calibration, range_deg_s = f"{path}: the calibration of {slot.name}", degrees(entry.range_rad_s)
    refuse_other_sensor(calibration, entry.part, entry.serial_number, range_deg_s, slot.section)
    return calibration_of(entry, result.over_temperature.get(slot.name, {}).get(RATE.name))


def _announce(board: Board, changes: Iterable[str]) -> list[str]:
    return [f"On the board {board.identity.unique_id}:", *(f"  {change}" for change in changes)]


def _describe_replacement(slot: BoardSlot, calibration: Calibration) -> str:
    scale = " ".join(f"{value:.5f}" for value in calibration.scale)
    bias = " ".join(f"{value:+.5f}" for value in calibration.bias_rad_s)
    old = f"replaces {_describe_record(slot.stored)}" if slot.stored is not None else "nothing was stored before"
    return f"{slot.name}: scale {scale}, bias {bias} rad/s{_describe_range(calibration)}; {old}"


def _describe_range(calibration: Calibration) -> str:
    if calibration.polynomials is None:
        return ""
    low, high = calibration.polynomials.range_c
    return f", at {calibration.temperature_c:g} °C, corrected by temperature from {low:.1f} to {high:.1f} °C"


def _describe_record(stored: StoredCalibration) -> str:
    calibration = stored.calibration
    return (
        f"record {stored.sequence} of {calibration.written_utc:%Y-%m-%d %H:%M} UTC for {stored.part} "
        f"{calibration.serial_number} at {stored.range_deg_s:g} °/s{_describe_range(calibration)}"
    )

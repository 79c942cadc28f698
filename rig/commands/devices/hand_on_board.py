"""`rig board hand`: the board calibrates a gyroscope turned by hand, and this computer checks the result.

With `--fetch` the board's button started the session, and its result is used unchecked.
"""

import json
import math
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from firmware_host.client import Board, Calibration
from rig.board.flash_store import store
from rig.board.identify import (
    changing,
    find_sensor,
    refuse_other_firmware,
    refuse_other_sensor,
    refusing,
    require_board_section,
    spell_part,
)
from rig.commands.laboratory.claims import claim_board
from rig.commands.laboratory.laboratory_process import run_simulated_laboratory
from rig.commands.laboratory.own_address import load_at_own_address
from rig.commands.laboratory.simulated_operator import OperatorListener
from rig.config.models import RigConfig
from rig.config.sensors.sensor_sections import SensorSection
from rig.data.recording.hand_events import HandEvent
from rig.errors import Refused
from rig.estimation.by_hand.solution import REAL_HAND_STD
from rig.station.by_hand_words import hand_event_line
from rig.station.confirm import refuse_unless_answerable, require_agreement
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.runner.by_hand.on_board import CalibratedByBoard

MOVE_RANGE = range(8, 201)
UNCHECKED_NOTE = "the board's own result: its readings are not stored, so double precision cannot check it"


def hand(options: Namespace) -> int:
    """Let the board calibrate, or read its last result; print the result and its check; return 0.

    Raise Refused `bad_option`, `no_such_sensor`, `not_confirmed`, `another_sensor`, `another_range`, and what
    `calibrate_by_board` and `read_kept_solution` raise; Fault as `calibrate_by_board` does.
    """
    if options.moves not in MOVE_RANGE or not 0 < options.scale_std < 1:
        raise Refused(
            "bad_option",
            f"--moves {options.moves} --scale-std {options.scale_std:g}",
            f"Give {MOVE_RANGE.start} to {MOVE_RANGE.stop - 1} moves, and a standard uncertainty between 0 and 1",
        )
    if options.write:
        refuse_unless_answerable(options.yes)
    with ExitStack() as stack:
        loaded = stack.enter_context(load_at_own_address(options.config, options.overrides))
        config = loaded.config
        among = _select_sensors(config, options.sensor)
        operator = None
        if loaded.simulated:
            operator = OperatorListener(stack.enter_context(run_simulated_laboratory(loaded.text)))
        stack.enter_context(claim_board(require_board_section(config).port))
        session = (
            _fetch_session(config, among)
            if options.fetch
            else _run_session(config, next(iter(among)), options, operator)
        )
        board, name, by_board = stack.enter_context(session)
        calibration = Calibration(
            model="matrix_times_m_plus_b",
            serial_number=config.sensors[name].serial_number,
            written_utc=datetime.now(UTC),
            temperature_c=by_board.solved.temperature_c,
            matrix=by_board.solved.matrix,
            bias_rad_s=by_board.solved.bias_rad_s,
        )
        crystal = 1e-6 * config.uncertainty.crystal_ppm / math.sqrt(3)
        scale_u = 2 * math.hypot(by_board.solved.scale_std, REAL_HAND_STD, crystal)
        if options.json:
            print(json.dumps(_document(name, by_board, calibration, scale_u), indent=2))
        else:
            for line in _describe(name, by_board, calibration, scale_u):
                say(line)
        if options.write:
            unchecked = [f"  {UNCHECKED_NOTE}"] if by_board.agreement is None else []
            require_agreement([f"On the board {board.identity.unique_id}: {name}", *unchecked], "store", options.yes)
            with changing():
                if options.fetch:  # a record needs a configured sensor
                    board.configure(by_board.index, config.sensors[name].rate_hz, config.sensors[name].range_deg_s)
                record = store(board, by_board.index, calibration)
            say(f"stored: {name}, record {record.sequence}", file=sys.stderr)
    return 0


def _select_sensors(config: RigConfig, wanted: str | None) -> dict[str, SensorSection]:
    """Return the command's sensors, all or only the one named. Raise Refused `no_such_sensor`."""
    among = {name: section for name, section in config.to_calibrate.items() if section.on_board}
    if not among or (wanted is not None and wanted not in among):
        raise Refused(
            "no_such_sensor",
            f"--sensor {wanted}: the configuration has no such gyroscope on its board to calibrate",
            f"Choose one of: {', '.join(among) or 'none'}",
        )
    return among if wanted is None else {wanted: among[wanted]}


@contextmanager
def _run_session(
    config: RigConfig, name: str, options: Namespace, operator: OperatorListener | None
) -> Iterator[tuple[Board, str, "CalibratedByBoard"]]:
    """Run a session on the board with the operator; yield the board, the sensor's name and the result."""
    from rig.runner.by_hand.on_board import calibrate_by_board

    def tell(event: HandEvent) -> None:
        if (line := hand_event_line(event)) is not None:
            say(line, file=sys.stderr)
        if operator is not None:
            operator.event(event)

    with calibrate_by_board(config, name, options.moves, options.scale_std, tell) as (board, by_board):
        yield board, name, by_board


@contextmanager
def _fetch_session(
    config: RigConfig, among: dict[str, SensorSection]
) -> Iterator[tuple[Board, str, "CalibratedByBoard"]]:
    """Read the board's last session; yield the board, the sensor's name and the result.

    Raise Refused `another_sensor` if the session was with a sensor that is not configured.
    """
    from rig.runner.by_hand.on_board import read_kept_solution

    section = require_board_section(config)
    with ExitStack() as stack:
        with refusing():
            board = stack.enter_context(Board(section.port, section.baud, lambda batch: None))
            refuse_other_firmware(board.identity)
            by_board = read_kept_solution(board)
        part = spell_part(board.identity.sensors[by_board.index].part)
        name = next((name for name, sensor in among.items() if sensor.part == part), None)
        if name is None:
            raise Refused(
                "another_sensor",
                f"the board has calibrated its {part} by hand, but this is not one of: {', '.join(among)}",
                "Correct --sensor or the configuration, or calibrate this sensor",
            )
        sensor = among[name]
        find_sensor(board.identity, name, sensor)
        refuse_other_sensor(
            "the board's answer by hand", part, sensor.serial_number, by_board.solved.range_deg_s, sensor
        )
        yield board, name, by_board


def _document(name: str, by_board: "CalibratedByBoard", calibration: Calibration, scale_u: float) -> dict[str, Any]:
    agreement = by_board.agreement
    return {
        "sensor": name,
        "serial_number": calibration.serial_number,
        "moves": by_board.solved.accepted,
        "scale": list(calibration.scale),
        "scale_std_of_session": by_board.solved.scale_std,
        "expanded_scale": scale_u,
        "matrix": [list(row) for row in calibration.matrix],
        "bias_rad_s": list(calibration.bias_rad_s),
        "temperature_c": calibration.temperature_c,
        "matrix_difference": None if agreement is None else agreement.matrix_difference,
        "bias_difference_rad_s": None if agreement is None else agreement.bias_difference_rad_s,
    }


def _describe(name: str, by_board: "CalibratedByBoard", calibration: Calibration, scale_u: float) -> Iterator[str]:
    scale = " ".join(f"{value:.5f}" for value in calibration.scale)
    bias = " ".join(f"{value:+.6f}" for value in calibration.bias_rad_s)
    agreement, std = by_board.agreement, by_board.solved.scale_std
    yield f"{name}: the board has calibrated it from {by_board.solved.accepted} moves"
    yield f"  scale  {scale}, U (k = 2) {scale_u:.1e}, of which {2 * std:.1e} by this session"
    yield f"  bias   {bias} rad/s"
    if agreement is None:
        yield f"  {UNCHECKED_NOTE}"
    else:
        yield (
            f"  double precision differs by {agreement.matrix_difference:.1e} of scale, "
            f"{agreement.bias_difference_rad_s:.1e} rad/s"
        )

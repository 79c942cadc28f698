"""`rig board hand`: the board calibrates a gyroscope that is turned by hand; says what to do, and checks the answer."""

import json
import math
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import ExitStack
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from firmware_host.client import Calibration
from rig.board.identify import changing, configured_board
from rig.board.store import store
from rig.commands.claims import claimed_board
from rig.commands.laboratory import simulated_laboratory
from rig.commands.own_address import loaded_here
from rig.commands.simulated_operator import SimulatedOperator
from rig.config.models import RigConfig
from rig.data.hand_events import OfTheHand
from rig.errors import Refused
from rig.estimation.by_hand.solution import REAL_HANDS
from rig.station.by_hand_words import by_hand_line
from rig.station.confirm import agreed_or_refused
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.runner.hand_on_board import CalibratedByBoard

MOVES = range(8, 201)


def hand(options: Namespace) -> int:
    """Let the board calibrate; print what it found and how far double precision differs.

    Raises Refused `bad_option`, `no_such_sensor`, `not_confirmed`, and as `calibrated_by_board`; Fault as that.
    """
    if options.moves not in MOVES or not 0 < options.scale_std < 1:
        raise Refused(
            "bad_option",
            f"--moves {options.moves} --scale-std {options.scale_std:g}",
            f"Give {MOVES.start} to {MOVES.stop - 1} moves, and a standard uncertainty between 0 and 1",
        )
    with ExitStack() as stack:
        loaded = stack.enter_context(loaded_here(options.config, options.overrides))
        name = _sensor(loaded.config, options.sensor)
        operator = None
        if loaded.simulated:
            operator = SimulatedOperator(stack.enter_context(simulated_laboratory(loaded.text)))
        stack.enter_context(claimed_board(configured_board(loaded.config).port))

        def tell(event: OfTheHand) -> None:
            if (line := by_hand_line(event)) is not None:
                say(line, file=sys.stderr)
            if operator is not None:
                operator.event(event)

        from rig.runner.hand_on_board import calibrated_by_board

        board, found = stack.enter_context(
            calibrated_by_board(loaded.config, name, options.moves, options.scale_std, tell)
        )
        calibration = Calibration(
            model="matrix_times_m_plus_b",
            serial_number=loaded.config.sensors[name].serial_number,
            written_utc=datetime.now(UTC),
            temperature_c=found.temperature_c,
            matrix=found.solved.matrix,
            bias_rad_s=found.solved.bias_rad_s,
        )
        known = loaded.config.uncertainty
        scale_u = 2 * math.hypot(found.report.scale_std, REAL_HANDS, 1e-6 * known.crystal_ppm / math.sqrt(3))
        if options.json:
            print(json.dumps(_document(name, found, calibration, scale_u), indent=2))
        else:
            for line in _lines(name, found, calibration, scale_u):
                say(line)
        if options.write:
            agreed_or_refused([f"On the board {board.identity.unique_id}: {name}"], "store", options.yes)
            with changing():
                record = store(board, found.index, calibration)
            say(f"stored: {name}, record {record.sequence}", file=sys.stderr)
    return 0


def _sensor(config: RigConfig, wanted: str | None) -> str:
    """The sensor that is meant. Raises Refused `no_such_sensor`."""
    names = [name for name, section in config.to_calibrate.items() if section.on_board]
    if not names or (wanted is not None and wanted not in names):
        raise Refused(
            "no_such_sensor",
            f"--sensor {wanted}: the configuration has no such gyroscope on its board to calibrate",
            f"Choose one of: {', '.join(names) or 'none'}",
        )
    return wanted or names[0]


def _document(name: str, found: "CalibratedByBoard", calibration: Calibration, scale_u: float) -> dict[str, Any]:
    return {
        "sensor": name,
        "serial_number": calibration.serial_number,
        "moves": found.solved.taken,
        "scale": list(calibration.scale),
        "scale_std_of_session": found.report.scale_std,
        "expanded_scale": scale_u,
        "matrix": [list(row) for row in calibration.matrix],
        "bias_rad_s": list(calibration.bias_rad_s),
        "temperature_c": calibration.temperature_c,
        "matrix_difference": found.agreement.matrix_difference,
        "bias_difference_rad_s": found.agreement.bias_difference_rad_s,
    }


def _lines(name: str, found: "CalibratedByBoard", calibration: Calibration, scale_u: float) -> Iterator[str]:
    scale = " ".join(f"{value:.5f}" for value in calibration.scale)
    bias = " ".join(f"{value:+.6f}" for value in calibration.bias_rad_s)
    agreement, std = found.agreement, found.report.scale_std
    yield f"{name}: the board has calibrated it from {found.solved.taken} moves"
    yield f"  scale  {scale}, U (k = 2) {scale_u:.1e}, of which {2 * std:.1e} by this session"
    yield f"  bias   {bias} rad/s"
    yield (
        f"  double precision differs by {agreement.matrix_difference:.1e} of scale, "
        f"{agreement.bias_difference_rad_s:.1e} rad/s"
    )

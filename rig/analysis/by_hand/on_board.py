"""The comparison of the board's solution of a session by hand with a solution in double precision. Pure functions.

The host integrates the same readings by the same equations (`rig.estimation.by_hand.on_board`), with the rests and
moves that the board reports, so only the arithmetic differs. The calibration's quality is not judged here.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firmware_host.hand_answers import BoardHandSolution, HandReport
from firmware_host.protocol import HAND_FACES
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.by_hand.on_board import BoardMove, BoardRest, BoardSolution, solve_like_board

SCALE_LIMIT = 1e-5  # largest difference of an element of the matrix
BIAS_LIMIT_RAD_S = 1e-6


@dataclass(frozen=True, slots=True)
class BoardReadings:
    """The n readings of a session, as received from the board.

    - `times_us`, `sequence` (n,): times of the board's counter, and sequence numbers.
    - `rates` (n, 3): the readings, rad/s.
    - `microsecond_s`: the true duration of one microsecond of the counter.
    """

    times_us: NDArray[np.integer]
    sequence: NDArray[np.integer]
    rates: Array
    microsecond_s: float


@dataclass(frozen=True, slots=True)
class HandAgreement:
    """The host's solution in double precision, and the largest differences of the board's matrix and bias from it."""

    host: BoardSolution
    matrix_difference: float
    bias_difference_rad_s: float


def compare_with_board(
    readings: BoardReadings, reports: Sequence[HandReport], solved: BoardHandSolution
) -> HandAgreement:
    """Return a solution in double precision from the board's `readings`, and how much the board's solution differs.

    Raise Fault `board_unverified` if readings or reports are missing, `board_disagrees` if the limits are exceeded.
    """
    host = solve_like_board(tuple(_moves(readings, reports)))
    if (used := sum(report.outcome == "accepted" for report in reports)) != solved.accepted:
        raise _verification_fault(f"it has accepted {solved.accepted} moves, of which this computer received {used}")
    matrix = float(np.max(np.abs(np.array(solved.matrix) - host.matrix)))
    bias = float(np.max(np.abs(np.array(solved.bias_rad_s) - host.bias_rad_s)))
    if not (matrix <= SCALE_LIMIT and bias <= BIAS_LIMIT_RAD_S):
        raise Fault(
            "board_disagrees",
            f"from the same readings the board finds a matrix that differs by {matrix:.1g}, and biases by "
            f"{bias:.1g} rad/s, from those of double precision",
            "Calibrate again; if the error recurs, keep the readings (rig record) and report it",
        )
    return HandAgreement(host, matrix, bias)


def _moves(readings: BoardReadings, reports: Sequence[HandReport]) -> Iterator[BoardMove]:
    counted = False  # whether the previous rest is in the solution
    for report in reports:
        used = report.outcome == "accepted"
        if used:
            yield _move(readings, report, follows=counted)
        counted = used


def _move(readings: BoardReadings, report: HandReport, *, follows: bool) -> BoardMove:
    """Return the readings of a move that the board accepted, and of the rests before and after it.

    `follows`: whether the rest before it is also that of another accepted move. Raise Fault `board_unverified` unless
    all readings arrived.
    """
    assert report.before is not None and report.after is not None, "accepted moves are between faces"
    times_us, rates = readings.times_us, readings.rates
    marks = [report.rest_us, report.move_us, report.after_us, report.end_us]
    first, begin, end, last = np.searchsorted(times_us, marks).tolist()
    complete = first > 0 and last < len(times_us) and np.array_equal(times_us[[first, begin, end, last]], marks)
    if not complete or (np.diff(readings.sequence[first - 1 : last]) != 1).any():
        raise _verification_fault(f"readings of its move from {report.before} to {report.after} did not arrive here")
    return BoardMove(
        before=BoardRest(HAND_FACES.index(report.before), rates[first:begin].mean(axis=0), begin - first),
        after=BoardRest(HAND_FACES.index(report.after), rates[end:last].mean(axis=0), last - end),
        rates=rates[begin:end],
        steps_s=readings.microsecond_s * np.diff(times_us[begin - 1 : end]),
        noise_rad_s=report.noise_rad_s,
        whole=report.whole,
        follows=follows,
        settled=report.settled,
    )


def _verification_fault(what: str) -> Fault:
    return Fault(
        "board_unverified",
        f"the board's calibration by hand cannot be checked: {what}",
        "Look at the cable, and calibrate again",
    )

"""The calibration of a gyroscope in known attitudes by the increments of angle between them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.external.attitude_budget import budget_by_causes
from rig.analysis.external.changes import check_steady
from rig.analysis.external.inverted import solve_unless_inverted
from rig.analysis.external.rate_ratios import check_rate_ratios
from rig.analysis.external.rests_agree import check_rests_agree, include_rounding
from rig.data.quantity import RATE
from rig.errors import Fault
from rig.estimation.arrays import Array, scale_of
from rig.estimation.external.increment_solution import IncrementSolution, solve_known_increments
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.refusals import check_axes, check_unit
from rig.observation.external.fixes import OmittedIncrements, gather
from rig.observation.external.means_at_rest import means_at_rest
from rig.observation.external.omission import Omitted
from rig.observation.external.reference_clock import check_offset
from rig.observation.external.reference_rows import Turning, select_covered
from rig.observation.external.robust_start import find_start

CONTRADICTIONS = ("attitude_untrustworthy", "mirrored_axis", "wrong_unit", "ill_conditioned")
MAX_ITERATIONS = 3  # the clock of one determines the increments of the next


@dataclass(frozen=True, slots=True)
class IncrementCalibration:
    """The solution from increments of angle between attitudes.

    - `window_s`: the duration over which each attitude is averaged.
    - `left_out`: the increments that could not be formed, by reason.
    - `increments`: the number of all increments, including those left out.
    """

    solution: IncrementSolution
    window_s: float
    left_out: tuple[OmittedIncrements, ...]
    increments: int

    @property
    def matrix(self) -> Array:
        """The matrix F (3, 3) of scale factors and axes."""
        return self.solution.matrix

    @property
    def budget(self) -> Budget:
        """The contributors to the uncertainty."""
        return budget_by_causes(self.solution.matrix, self.solution.causes)

    @property
    def omitted(self) -> Iterator[Omitted]:
        """The increments that could not be formed, and those that contradict the others."""
        for gap in self.left_out:
            longest = f", for up to {gap.longest_s:.2g} s" if gap.name == "lost_samples" else ""
            yield Omitted("increments", gap.count, self.increments, f"{gap.name}{longest}", _spell_time(gap.first_s))
        if count := self.solution.set_aside:
            reason = "attitude_untrustworthy: they contradict all others"
            yield Omitted("increments", count, self.increments, reason, _spell_time(float(self.solution.aside_s[0])))

    @property
    def notes(self) -> Iterator[str]:
        """A note if all attitudes after some time are rotated relative to those before it."""
        if (reset := self.solution.reset) is not None:
            yield (
                f"from {reset[0]:.2f} s on, all attitudes are rotated by {np.degrees(reset[1]):.2g}° relative to "
                "those before: the reference has a new zero, or readings are missing there"
            )


def _spell_time(time_s: float) -> str:
    return f"at {time_s:.2f} s"


def solve_turning(turning: Turning, window_s: float | None, *, any_mounting: bool) -> IncrementCalibration:
    """Return the gyroscope's calibration from attitudes averaged over windows of `window_s`; if None, it is chosen.

    Raise Fault `inverted_attitudes`, and what `gather`, `solve_known_increments`, `check_rate_ratios`, `check_offset`,
    `check_steady`, `check_rests_agree` and `check_axes` raise.
    """
    try:
        solved = solve_unless_inverted(
            turning.attitudes, lambda attitudes: _solve(replace(turning, attitudes=attitudes), window_s), CONTRADICTIONS
        )
    except Fault as fault:
        if fault.name in CONTRADICTIONS:
            check_rate_ratios(turning)
            check_offset(turning)
        raise
    if not any_mounting:
        matrix = solved.solution.matrix
        check_axes(matrix / np.linalg.norm(matrix, axis=1, keepdims=True), np.eye(3))
    at_rest = means_at_rest(turning, solved.solution.clock_s)
    solution = include_rounding(solved.solution, at_rest)
    check_rests_agree(solution, at_rest)
    check_steady(solution.change, RATE)
    return replace(solved, solution=solution)


def _solve(turning: Turning, window_s: float | None) -> IncrementCalibration:
    """Return the solution, repeated until the estimated clock offset no longer changes which readings are missing."""
    start = find_start(select_covered(turning)).state
    check_unit(scale_of(start.matrix))
    gathered = gather(turning, window_s, start.clock_s)
    for _ in range(MAX_ITERATIONS):
        solution = solve_known_increments(turning.time_s, turning.readings_rad_s, gathered.fixes, start)
        regathered = gather(turning, window_s, solution.clock_s)
        if np.array_equal(gathered.fixes.joined, regathered.fixes.joined):
            break
        gathered = regathered
    left_out, increments = gathered.left_out, gathered.increments
    return IncrementCalibration(solution, gathered.window_s, left_out, increments)  # pyrefly: ignore[unbound-name]  # MAX_ITERATIONS > 0

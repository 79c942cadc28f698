"""A gyroscope in known attitudes, by how far it turned between them: fixes, solution, and what the sensor can be."""

from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.inverted import solved_in
from rig.analysis.placed_budget import budget_by_causes
from rig.estimation.arrays import scale_of
from rig.estimation.budget import Budget
from rig.estimation.known_increments import KnownIncrements, solve_known_increments
from rig.estimation.refusals import check_axes, check_unit
from rig.observation.fixes import LeftOut, Turning, gather, rough_matrix

CONTRADICTING = ("attitude_untrustworthy", "mirrored_axis", "wrong_unit", "ill_conditioned")


@dataclass(frozen=True, slots=True)
class InIncrements:
    """The solution, the length of the windows that its fixes are means over, and what had to be left out."""

    solution: KnownIncrements
    window_s: float
    left_out: tuple[LeftOut, ...]

    @property
    def budget(self) -> Budget:
        """What the uncertainty is made of."""
        return budget_by_causes(self.solution.matrix, self.solution.causes)


def solve_turning(turning: Turning, window_s: float | None, *, any_mounting: bool) -> InIncrements:
    """The gyroscope's matrix and bias, from windows of a given or a suitable length.

    Raises Fault as `gather`, `solve_known_increments` and `check_axes` do, and `inverted_attitudes`.
    """
    found = solved_in(
        turning.attitudes, lambda each: _solved(replace(turning, attitudes=each), window_s), CONTRADICTING
    )
    if not any_mounting:
        matrix = found.solution.matrix
        check_axes(matrix / np.linalg.norm(matrix, axis=1, keepdims=True), np.eye(3))
    return found


def _solved(turning: Turning, window_s: float | None) -> InIncrements:
    start = rough_matrix(turning)
    check_unit(scale_of(start))
    gathered = gather(turning, window_s)
    solution = solve_known_increments(turning.time_s, turning.readings_rad_s, gathered.fixes, start)
    return InIncrements(solution, gathered.window_s, gathered.left_out)

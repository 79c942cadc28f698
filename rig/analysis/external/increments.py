"""A gyroscope in known attitudes, by how far it turned between them: fixes, solution, and what the sensor can be."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.external.inverted import solved_in
from rig.analysis.external.placed_budget import budget_by_causes
from rig.analysis.external.rests_agree import check_rests_agree
from rig.estimation.arrays import scale_of
from rig.estimation.external.known_increments import KnownIncrements, solve_known_increments
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.refusals import check_axes, check_unit
from rig.observation.external.fixes import Gathered, LeftOut, Turning, gather, rough_matrix
from rig.observation.external.omitted import Omitted

CONTRADICTING = ("attitude_untrustworthy", "mirrored_axis", "wrong_unit", "ill_conditioned")
PASSES = 3  # by the clock of the one before


@dataclass(frozen=True, slots=True)
class InIncrements:
    """The solution, the length of the windows that its fixes are means over, and what had to be left out.

    `increments` is how many there would be, were nothing left out.
    """

    solution: KnownIncrements
    window_s: float
    left_out: tuple[LeftOut, ...]
    increments: int

    @property
    def budget(self) -> Budget:
        """What the uncertainty is made of."""
        return budget_by_causes(self.solution.matrix, self.solution.causes)

    @property
    def omitted(self) -> Iterator[Omitted]:
        """The increments that could not be made, and those that contradict all others."""
        for each in self.left_out:
            longest = f", for up to {each.longest_s:.2g} s" if each.name == "lost_samples" else ""
            yield Omitted("increments", each.count, self.increments, f"{each.name}{longest}", _at(each.first_s))
        if count := self.solution.set_aside:
            reason = "attitude_untrustworthy: they contradict all others"
            yield Omitted("increments", count, self.increments, reason, _at(float(self.solution.aside_s[0])))


def _at(time_s: float) -> str:
    return f"at {time_s:.2f} s"


def solve_turning(turning: Turning, window_s: float | None, *, any_mounting: bool) -> InIncrements:
    """The gyroscope's matrix and bias, from windows of a given or a suitable length.

    Raises Fault as `gather`, `solve_known_increments`, `check_rests_agree` and `check_axes` do, and
    `inverted_attitudes`.
    """
    found = solved_in(
        turning.attitudes, lambda each: _solved(replace(turning, attitudes=each), window_s), CONTRADICTING
    )
    if not any_mounting:
        matrix = found.solution.matrix
        check_axes(matrix / np.linalg.norm(matrix, axis=1, keepdims=True), np.eye(3))
    check_rests_agree(turning, found.solution)
    return found


def _solved(turning: Turning, window_s: float | None) -> InIncrements:
    """The solution; readings are missing where they are by the clock that it finds itself."""
    start = rough_matrix(turning)
    check_unit(scale_of(start))
    gathered = gather(turning, window_s)
    for _ in range(PASSES):
        solution = solve_known_increments(turning.time_s, turning.readings_rad_s, gathered.fixes, start)
        again = gather(turning, window_s, solution.clock_s)
        if _same(gathered, again):
            break
        gathered = again
    return InIncrements(solution, gathered.window_s, gathered.left_out, gathered.increments)


def _same(one: Gathered, other: Gathered) -> bool:
    return bool(np.array_equal(one.fixes.joined, other.fixes.joined))

"""The shortest run that reaches a wanted uncertainty: a search among candidates by what is predicted of each. Pure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf

from rig.config.models import ProcedureSection
from rig.estimation.arrays import Array
from rig.estimation.budget import Budget

Budgets = Mapping[str, Budget]  # by sensor


@dataclass(frozen=True, slots=True)
class Reached:
    """U of scale and of bias (rad/s), each of the axis and the sensor that is known worst."""

    scale: float
    bias_rad_s: float

    @classmethod
    def by(cls, budgets: Budgets) -> "Reached":
        """The worst U in the budgets of all sensors."""
        expanded = [each.expanded for each in budgets.values()]
        return cls(float(max(each[:3].max() for each in expanded)), float(max(each[3:].max() for each in expanded)))


@dataclass(frozen=True, slots=True)
class Wanted:
    """The U that is wanted of scale and of bias (rad/s), infinite where nothing is, in a run of `at_most_s`."""

    scale: float = inf
    bias_rad_s: float = inf
    at_most_s: float = inf

    def met_by(self, reached: Reached) -> bool:
        """Whether both are reached."""
        return self.share(reached) <= 1.0

    def share(self, reached: Reached) -> float:
        """What is reached by what is wanted, of the worse of both."""
        return max(reached.scale / self.scale, reached.bias_rad_s / self.bias_rad_s)


@dataclass(frozen=True, slots=True)
class Candidate:
    """A procedure that may be run, and how long it takes.

    Those of one `family` differ in `sizes` alone, of which a larger one never tells less: turns, repeats, rests.
    """

    procedure: ProcedureSection
    family: tuple[object, ...]
    sizes: tuple[float, ...]
    duration_s: float

    def within(self, other: "Candidate") -> bool:
        """Whether it tells no more than another."""
        return self.family == other.family and all(
            mine <= its for mine, its in zip(self.sizes, other.sizes, strict=True)
        )


@dataclass(frozen=True, slots=True)
class Planned:
    """A candidate and the budgets that are predicted of it."""

    candidate: Candidate
    budgets: Budgets

    @property
    def reached(self) -> Reached:
        """U that is predicted of it."""
        return Reached.by(self.budgets)


@dataclass(frozen=True, slots=True)
class Searched:
    """What a search came to: the shortest that does, None of none; the one that comes nearest; how many were tried."""

    best: Planned | None = None
    nearest: Planned | None = None
    tried: int = 0
    among: int = 0


@dataclass(frozen=True, slots=True)
class Shortest:
    """The shortest run for what is wanted.

    `before` is the file's own procedure, None where it tells nothing; `nearest` what comes nearest where none does, and
    `endless` the budgets of the endless runs that know the scale best, and the bias. `cannot_be_had`: no run of this
    kind has what is wanted, however long. `directions` (N, 3) are those of the sweeps, None by hand.
    """

    wanted: Wanted
    before: Planned | None
    best: Planned | None
    nearest: Planned | None
    endless: tuple[Budgets, Budgets]
    cannot_be_had: bool
    tried: int
    among: int
    directions: Array | None

    @property
    def at_any_length(self) -> Reached:
        """The least U of scale and the least U of bias that endless runs have, which may be different runs."""
        of_scale, of_bias = (Reached.by(each) for each in self.endless)
        return Reached(of_scale.scale, of_bias.bias_rad_s)


def shortest(
    candidates: Sequence[Candidate], predict: Callable[[Candidate], Budgets | None], wanted: Wanted
) -> Searched:
    """The shortest of the candidates whose predicted U is what is wanted, without a look at every one.

    One that does leaves only those that are shorter; of one that does not, none `within` it does. `predict` is None
    of a candidate that cannot be run, and says nothing of others.
    """
    left = sorted(
        (each for each in candidates if each.duration_s <= wanted.at_most_s), key=lambda each: each.duration_s
    )
    among, tried = len(left), 0
    best: Planned | None = None
    nearest: Planned | None = None
    while left:
        middle = len(left) // 2
        candidate, tried = left[middle], tried + 1
        budgets = predict(candidate)
        if budgets is None:
            del left[middle]
            continue
        planned = Planned(candidate, budgets)
        if nearest is None or wanted.share(planned.reached) < wanted.share(nearest.reached):
            nearest = planned
        if wanted.met_by(planned.reached):
            best, left = planned, [each for each in left if each.duration_s < candidate.duration_s]
        else:
            left = [each for each in left if not each.within(candidate)]
    return Searched(best, nearest, tried, among)

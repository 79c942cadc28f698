"""The shortest run that reaches a wanted uncertainty: a search among candidates by what is predicted of each. Pure."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from types import MappingProxyType

from rig.config.models import ProcedureSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget

NONE: Mapping[str, Budget] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Reached:
    """U of scale and of bias (rad/s), each of the axis and the sensor that is known worst; 0 where there is none.

    Those of accelerometers (m/s²) beside them.
    """

    scale: float
    bias_rad_s: float
    acceleration_scale: float = 0.0
    acceleration_bias_m_s2: float = 0.0

    @classmethod
    def by(cls, rates: Mapping[str, Budget], accelerations: Mapping[str, Budget] = NONE) -> "Reached":
        """The worst U in the budgets of all gyroscopes, and in those of all accelerometers."""
        return cls(*_worst(rates), *_worst(accelerations))


@dataclass(frozen=True, slots=True)
class Budgets:
    """The budgets of a run by sensor: of gyroscopes, and of the accelerometers that attitudes calibrate."""

    rates: Mapping[str, Budget]
    accelerations: Mapping[str, Budget] = field(default_factory=dict)

    @property
    def reached(self) -> Reached:
        """The worst U of them."""
        return Reached.by(self.rates, self.accelerations)

    def without(self, names: Collection[str]) -> "Budgets":
        """The budgets without contributors of these names."""
        rates, accelerations = (
            {sensor: each.without(names) for sensor, each in budgets.items()}
            for budgets in (self.rates, self.accelerations)
        )
        return Budgets(rates, accelerations)


@dataclass(frozen=True, slots=True)
class Wanted:
    """The U that is wanted of what is `Reached`, infinite where nothing is, in a run of `at_most_s`."""

    scale: float = inf
    bias_rad_s: float = inf
    at_most_s: float = inf
    acceleration_scale: float = inf
    acceleration_bias_m_s2: float = inf

    def met_by(self, reached: Reached) -> bool:
        """Whether all of it is reached."""
        return self.share(reached) <= 1.0

    def share(self, reached: Reached) -> float:
        """What is reached by what is wanted, of the worst."""
        shares: list[float] = [getattr(reached, each) / getattr(self, each) for each in SIZES]
        return max(shares)


def wanted_by(section: SixObservationSection) -> Wanted | None:
    """The wish at which a run of several repeats ends; None where it makes all of them."""
    scale, bias_rad_s = section.target_scale_u, section.target_bias_u_rad_s
    return None if scale is bias_rad_s is None else Wanted(scale or inf, bias_rad_s or inf)


SIZES = tuple(Reached.__dataclass_fields__)  # what may be wanted, as the fields of both are called


@dataclass(frozen=True, slots=True)
class Candidate:
    """A procedure that may be run, and how long it takes.

    Those of one `family` differ in `sizes`, of which a larger one never tells less: turns, repeats, dwells; and
    in `rests_s` after sweeps. Longer rests may tell less: meanwhile the bias wanders on.
    """

    procedure: ProcedureSection
    family: tuple[object, ...]
    sizes: tuple[float, ...]
    duration_s: float
    rests_s: tuple[float, ...] = ()

    def within(self, other: "Candidate") -> bool:
        """Whether it tells no more than another."""
        return (self.family, self.rests_s) == (other.family, other.rests_s) and all(
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
        return self.budgets.reached


@dataclass(frozen=True, slots=True)
class Searched:
    """What a search came to: the shortest that does, None of none; the one that comes nearest; what all had."""

    best: Planned | None = None
    nearest: Planned | None = None
    looked: Sequence[Budgets] = ()
    among: int = 0


@dataclass(frozen=True, slots=True)
class Shortest:
    """The shortest run for what is wanted.

    `before` is the file's own procedure, None where it tells nothing; `nearest` what comes nearest where none does, and
    `endless` the budgets of the endless runs of each family, and of all plans that were looked at. `cannot_be_had`: no
    run of this kind has what is wanted, however long. `directions` (N, 3) are those of the sweeps, None without.
    """

    wanted: Wanted
    before: Planned | None
    best: Planned | None
    nearest: Planned | None
    endless: Sequence[Budgets]
    cannot_be_had: bool
    tried: int
    among: int
    directions: Array | None

    def least(self, size: str) -> Budgets:
        """The budgets of the run that knows best what is called so in `Reached`."""
        return min(self.endless, key=lambda each: float(getattr(each.reached, size)))

    @property
    def at_any_length(self) -> Reached:
        """The least U of all runs, of each size for itself: these may be different runs."""
        return Reached(*(getattr(self.least(each).reached, each) for each in SIZES))


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
    among, looked = len(left), list[Budgets]()
    best: Planned | None = None
    nearest: Planned | None = None
    while left:
        middle = len(left) // 2
        candidate = left[middle]
        budgets = predict(candidate)
        if budgets is None:
            del left[middle]
            continue
        looked.append(budgets)
        planned = Planned(candidate, budgets)
        if nearest is None or wanted.share(planned.reached) < wanted.share(nearest.reached):
            nearest = planned
        if wanted.met_by(planned.reached):
            best, left = planned, [each for each in left if each.duration_s < candidate.duration_s]
        else:
            left = [each for each in left if not each.within(candidate)]
    return Searched(best, nearest, looked, among)


def _worst(budgets: Mapping[str, Budget]) -> tuple[float, float]:
    """U of the scale factor and of the bias that are known worst."""
    expanded = [each.expanded for each in budgets.values()]
    scale, bias = (max((float(each[of].max()) for each in expanded), default=0.0) for of in (slice(3), slice(3, 6)))
    return scale, bias

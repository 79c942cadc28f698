"""The search for the shortest run that reaches a target uncertainty, by predictions of candidates. Pure functions."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from types import MappingProxyType

from rig.config.models import ProcedureSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget

NO_BUDGETS: Mapping[str, Budget] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class ReachedUncertainty:
    """The largest U of any axis and sensor: of gyroscopes, then of accelerometers; 0 without such sensors."""

    scale: float
    bias_rad_s: float
    acceleration_scale: float = 0.0
    acceleration_bias_m_s2: float = 0.0

    @classmethod
    def worst_case(
        cls, rates: Mapping[str, Budget], accelerations: Mapping[str, Budget] = NO_BUDGETS
    ) -> "ReachedUncertainty":
        """Return the largest U in the budgets of all gyroscopes, and in those of all accelerometers."""
        return cls(*_worst_expanded(rates), *_worst_expanded(accelerations))


@dataclass(frozen=True, slots=True)
class Budgets:
    """The budgets of a run by sensor: of gyroscopes, and of accelerometers calibrated in attitudes."""

    rates: Mapping[str, Budget]
    accelerations: Mapping[str, Budget] = field(default_factory=dict)

    @property
    def reached(self) -> ReachedUncertainty:
        """The largest U of the budgets."""
        return ReachedUncertainty.worst_case(self.rates, self.accelerations)

    def omit(self, names: Collection[str]) -> "Budgets":
        """Return the budgets without the named contributors."""
        rates, accelerations = (
            {sensor: budget.omit(names) for sensor, budget in budgets.items()}
            for budgets in (self.rates, self.accelerations)
        )
        return Budgets(rates, accelerations)


@dataclass(frozen=True, slots=True)
class TargetUncertainty:
    """The targets of each U in `ReachedUncertainty` and of the run's duration (`at_most_s`), infinite if not set."""

    scale: float = inf
    bias_rad_s: float = inf
    at_most_s: float = inf
    acceleration_scale: float = inf
    acceleration_bias_m_s2: float = inf

    def is_met_by(self, reached: ReachedUncertainty) -> bool:
        """Return whether all targets are reached."""
        return self.ratio_to_target(reached) <= 1.0

    def ratio_to_target(self, reached: ReachedUncertainty) -> float:
        """Return the largest ratio of reached to target uncertainty."""
        ratios: list[float] = [getattr(reached, size) / getattr(self, size) for size in TARGET_NAMES]
        return max(ratios)


def target_of(section: SixObservationSection) -> TargetUncertainty | None:
    """Return the target at which a run stops repeating its sweeps; None if it has none, and makes all repeats."""
    if not section.has_target:
        return None
    return TargetUncertainty(section.target_scale_u or inf, section.target_bias_u_rad_s or inf)


TARGET_NAMES = tuple(ReachedUncertainty.__dataclass_fields__)  # fields of `TargetUncertainty` too


@dataclass(frozen=True, slots=True)
class Candidate:
    """A possible procedure, and its duration.

    Candidates of one `family` differ only in `sizes` (such as the numbers of turns, repeats and dwells), and in
    `rests_s`, the durations of rests after sweeps. Larger sizes never give a larger U, but longer rests may, because
    the bias drifts.
    """

    procedure: ProcedureSection
    family: tuple[object, ...]
    sizes: tuple[float, ...]
    duration_s: float
    rests_s: tuple[float, ...] = ()

    def is_contained_in(self, other: "Candidate") -> bool:
        """Return whether the `other` differs at most by larger sizes, so that its U is not larger."""
        return (self.family, self.rests_s) == (other.family, other.rests_s) and all(
            size <= other_size for size, other_size in zip(self.sizes, other.sizes, strict=True)
        )


@dataclass(frozen=True, slots=True)
class PlannedCandidate:
    """A candidate with its predicted budgets."""

    candidate: Candidate
    budgets: Budgets

    @property
    def reached(self) -> ReachedUncertainty:
        """The predicted U."""
        return self.budgets.reached


@dataclass(frozen=True, slots=True)
class SearchResult:
    """The result of a search.

    - `best`: the shortest candidate that meets the target, None if none does.
    - `nearest`: the evaluated candidate with the smallest ratio of U to the target, None if none was evaluated.
    - `evaluated`: the budgets of all evaluated candidates.
    - `candidates_count`: the number of all candidates that are short enough.
    """

    best: PlannedCandidate | None = None
    nearest: PlannedCandidate | None = None
    evaluated: Sequence[Budgets] = ()
    candidates_count: int = 0


@dataclass(frozen=True, slots=True)
class ShortestRun:
    """The shortest run for a target.

    - wanted: the target.
    - before: the procedure in the configuration file, None if its uncertainty cannot be predicted.
    - best, nearest: as in `SearchResult`.
    - endless: the budgets of all evaluated plans, and those of a run of unlimited length for each family.
    - unreachable: whether no run of this kind meets the target, however long.
    - tried: the number of candidates that were evaluated, of `candidates_count` in all.
    - directions (N, 3): the sweeps' directions, None if there are none.
    """

    wanted: TargetUncertainty
    before: PlannedCandidate | None
    best: PlannedCandidate | None
    nearest: PlannedCandidate | None
    endless: Sequence[Budgets]
    unreachable: bool
    tried: int
    candidates_count: int
    directions: Array | None

    def least(self, size: str) -> Budgets:
        """Return the budgets of the run with the smallest value of `size`, a field of `ReachedUncertainty`."""
        return min(self.endless, key=lambda candidate: float(getattr(candidate.reached, size)))

    @property
    def at_any_length(self) -> ReachedUncertainty:
        """The smallest value of each U that any run reaches, however long."""
        return ReachedUncertainty(*(getattr(self.least(size).reached, size) for size in TARGET_NAMES))


def find_shortest(
    candidates: Sequence[Candidate], predict: Callable[[Candidate], Budgets | None], target: TargetUncertainty
) -> SearchResult:
    """Return the shortest candidate whose predicted U meets the target.

    If a candidate meets the target, longer candidates are not tried; if it does not, those contained in it are not
    tried. `predict` returns a candidate's budgets, None if it cannot be run.
    """
    remaining = sorted(
        (candidate for candidate in candidates if candidate.duration_s <= target.at_most_s),
        key=lambda candidate: candidate.duration_s,
    )
    candidates_count, evaluated = len(remaining), list[Budgets]()
    best: PlannedCandidate | None = None
    nearest: PlannedCandidate | None = None
    while remaining:
        middle = len(remaining) // 2
        candidate = remaining[middle]
        budgets = predict(candidate)
        if budgets is None:
            del remaining[middle]
            continue
        evaluated.append(budgets)
        planned = PlannedCandidate(candidate, budgets)
        if nearest is None or target.ratio_to_target(planned.reached) < target.ratio_to_target(nearest.reached):
            nearest = planned
        if target.is_met_by(planned.reached):
            best, remaining = planned, [other for other in remaining if other.duration_s < candidate.duration_s]
        else:
            remaining = [other for other in remaining if not other.is_contained_in(candidate)]
    return SearchResult(best, nearest, evaluated, candidates_count)


def _worst_expanded(budgets: Mapping[str, Budget]) -> tuple[float, float]:
    """Return the largest U of any scale factor and of any bias in the budgets, 0 if there are none."""
    expanded = [budget.expanded for budget in budgets.values()]
    scale, bias = (
        max((float(uncertainty[columns].max()) for uncertainty in expanded), default=0.0)
        for columns in (slice(3), slice(3, 6))
    )
    return scale, bias

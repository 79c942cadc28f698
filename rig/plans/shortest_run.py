"""The search for the shortest run of a configuration that reaches a target uncertainty. Pure functions.

The order, directions, stages, several speeds and six axes that the file states are kept; if there are magnetometers,
the attitudes are kept too.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from math import inf
from typing import Protocol, TypeVar

import numpy as np
from pydantic import ValidationError

from rig.analysis.by_hand.hand_prediction import duration_s, predict_hand_budgets
from rig.analysis.design.budget_prediction import predict_budgets
from rig.analysis.design.candidate_search import (
    TARGET_NAMES,
    Budgets,
    Candidate,
    PlannedCandidate,
    SearchResult,
    ShortestRun,
    TargetUncertainty,
    find_shortest,
)
from rig.analysis.design.predicted_accelerations import predict_accelerometer_budgets
from rig.config.models import ProcedureSection, RigConfig
from rig.config.procedures.hand_sections import ByHandSection
from rig.config.procedures.procedure_sections import SixObservationSection, StaticAttitudesSection
from rig.config.section import Section
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.by_hand.solution import CONTRIBUTORS, REAL_HAND_STD
from rig.estimation.gyroscope.budget import BIAS_DRIFT, FLICKER, NOISE, STATE_TIMES
from rig.motion.by_hand import Instruction
from rig.motion.steps import Plan
from rig.plans.by_hand import WantedMoves as Asked
from rig.plans.by_hand import simulate_session
from rig.plans.phase import turner_for
from rig.plans.procedure_registry import load_procedures
from rig.plans.shortest_motions import Motion, vary_arm, vary_attitudes, vary_imu, vary_servo
from rig.turners.turner_registry import kind_of

SectionT = TypeVar("SectionT", bound=Section)
REPEATS = (1, 2, 3, 4, 6, 8, 12, 16)
MAX_SIZE = 100  # sweeps or dwells of one plan
RESTS_S = (1.0, 2.0, 3.0, 5.0, 10.0, 20.0)  # durations of a rest, and of a dwell, that are tried
# A run without end is predicted from a plan of two repeats, because in a single one noise is too large relative to the
# errors that repeats share. Other rests and more repeats reduce U further, but by no more than this factor.
PREDICTED_REPEATS, MAX_U_REDUCTION = 2, 2.0
REPEAT_CAUSES = NOISE, BIAS_DRIFT, FLICKER, STATE_TIMES  # the budget lines that repeats reduce, also for accelerometers
FLIP_COUNTS, TURN_COUNTS = (8, 10, 12, 16, 24, 36, 48), (0, 3, 6)
REST_STEP_S = 0.1  # step of the last, fine search


class RunSearch(Protocol):
    """The candidate runs of a procedure, with their predictions.

    - `predict`: returns the budgets, None for a run that is not possible.
    - `per_repeat`: the contributors whose error is new in each repeat, so that endless repetition averages them out.
    - `ending`: the keys that end a run before its last repeat, when the target is reached.
    """

    @property
    def per_repeat(self) -> Collection[str]: ...
    def candidates(self) -> Sequence[Candidate]: ...
    def select_endless(self, candidates: Sequence[Candidate]) -> Sequence[Candidate]: ...
    def finer(self, best: Candidate) -> Sequence[Candidate]: ...
    def duration_s(self, procedure: ProcedureSection) -> float: ...
    def predict(self, candidate: Candidate) -> Budgets | None: ...
    def ending(self, procedure: ProcedureSection, wanted: TargetUncertainty) -> Mapping[str, float]: ...


def shortest_run(config: RigConfig, wanted: TargetUncertainty) -> ShortestRun:
    """Return the shortest run of this configuration whose predicted uncertainty meets the target.

    A family of candidates is skipped if even its run of unlimited length misses the target by more than the factor
    `MAX_U_REDUCTION`. If all families are skipped, only the longest run of the best one is evaluated. Raise Refused
    `not_predictable` if the uncertainty of the procedure or of the target's quantity cannot be predicted.
    """
    what = find_search(config)
    _refuse_others(wanted, config)
    candidates = what.candidates()
    floors = [
        (candidate.family, once.omit(what.per_repeat))
        for candidate in what.select_endless(candidates)
        if (once := what.predict(candidate)) is not None
    ]
    able = {family for family, floor in floors if wanted.ratio_to_target(floor.reached) <= MAX_U_REDUCTION}
    least = min(floors, key=lambda floor: wanted.ratio_to_target(floor[1].reached))[0]
    hopeful = [run for run in candidates if run.family in able] or _longest(candidates, least, wanted.at_most_s)
    coarse = find_shortest(hopeful, what.predict, wanted)
    evaluated = [*(floor for _, floor in floors), *coarse.evaluated]
    unreachable = not any(wanted.is_met_by(budgets.reached) for budgets in evaluated)
    if coarse.best is None and unreachable and able and wanted.at_most_s < inf:
        unreachable = find_shortest(hopeful, what.predict, replace(wanted, at_most_s=inf)).best is None  # no time limit
    fine = find_shortest(what.finer(coarse.best.candidate), what.predict, wanted) if coarse.best else SearchResult()
    best = fine.best or coarse.best
    best = best and _add_target(best, what.ending(best.candidate.procedure, wanted))
    shown = best or coarse.nearest
    before = Candidate(config.procedure, (), (), what.duration_s(config.procedure))
    configured = what.predict(before)
    return ShortestRun(
        wanted,
        None if configured is None else PlannedCandidate(before, configured),
        best,
        coarse.nearest,
        evaluated,
        unreachable,
        len(coarse.evaluated) + len(fine.evaluated),
        len(candidates),
        None if shown is None else _directions(plan_of(config, shown.candidate.procedure)),
    )


def find_search(config: RigConfig) -> RunSearch:
    """Return the search among the runs of a configuration. Raise Refused `not_predictable`."""
    procedure = config.procedure
    if not config.to_calibrate:
        raise _not_predictable("nothing is to be calibrated")
    if procedure.name not in SEARCHES or procedure.finds_earth_rate:
        raise _not_predictable(f"the uncertainty of the procedure {procedure.name} is not predicted")
    return SEARCHES[procedure.name](config)


def _not_predictable(what: str) -> Refused:
    return Refused(
        "not_predictable",
        what,
        "Use six_observation or imu with the Earth's rate known or left out, static_attitudes, servo_six_observation, "
        "or by_hand",
    )


def _refuse_others(wanted: TargetUncertainty, config: RigConfig) -> None:
    """Raise Refused `not_predictable` if the target is for a kind of sensor that is not calibrated."""
    kinds = {"gyroscope": not isinstance(config.procedure, StaticAttitudesSection)}
    kinds["accelerometer"] = config.procedure.accelerometer_order > 0 and any(
        sensor.acceleration is not None for sensor in config.to_calibrate.values()
    )
    for (kind, calibrated), sizes in zip(kinds.items(), (TARGET_NAMES[:2], TARGET_NAMES[2:]), strict=True):
        if not calibrated and any(getattr(wanted, size) < inf for size in sizes):
            raise _not_predictable(f"the procedure calibrates no {kind}, so no uncertainty of one can be reached")


def plan_of(config: RigConfig, procedure: ProcedureSection) -> Plan:
    """Return the motions of a procedure; empty if the item is turned by hand. Raise Refused `other_turner`."""
    script = load_procedures()[procedure.name]
    return script.plan(turner_for(script, config), procedure)


def _change(section: SectionT, **keys: object) -> SectionT:
    """Return the section with changed values. Raise ValidationError for values that a file may not have."""
    kind: type[SectionT] = type(section)
    return kind.model_validate({**dict(section), **keys})


def _add_target(planned: PlannedCandidate, keys: Mapping[str, float]) -> PlannedCandidate:
    """Return the planned run with `keys` set in its procedure, so that it ends when it reaches the target."""
    procedure = planned.candidate.procedure
    with suppress(ValidationError):  # the target is larger than a configuration may state
        procedure = _change(procedure, **keys)
    return replace(planned, candidate=replace(planned.candidate, procedure=procedure))


def _directions(plan: Plan) -> Array | None:
    """Return the axes (N, 3) of the sweeps in the item's frame; None without sweeps."""
    mounts = {index: stage.mount for stage in plan.stages for index in stage.indices}
    axes = [np.array(mounts.get(sweep.index, np.eye(3))) @ sweep.axis_flange for sweep in plan.sweeps]
    return np.array(axes) if axes else None


def _longest(candidates: Sequence[Candidate], family: tuple[object, ...], at_most_s: float) -> list[Candidate]:
    """Return a list with only the longest candidate of a `family` within `at_most_s`; empty if there is none."""
    same = [candidate for candidate in candidates if candidate.family == family and candidate.duration_s <= at_most_s]
    return sorted(same, key=lambda candidate: candidate.duration_s)[-1:]


@dataclass(frozen=True, slots=True)
class _TurnerSearch:
    """The search among runs of a turner with joints, by sweeps or attitudes.

    - `motions`: yields the family and the angle of each motion, and the procedure's keys that state this motion.
    - `waits`: the keys of the times at standstill, after a sweep or in an attitude.
    """

    motions: Callable[[RigConfig], Iterator[Motion]]
    waits: tuple[str, ...]
    config: RigConfig
    per_repeat: Collection[str] = REPEAT_CAUSES

    def candidates(self) -> Sequence[Candidate]:
        """Return all possible runs: each motion with coarse choices of repeats and waits, and its duration."""
        candidates = []
        least_s = dict.fromkeys(self.waits, RESTS_S[0])
        for family, turned, keys in self.motions(self.config):
            once, twice = (_change(self.config.procedure, **keys, **least_s, repeats=repeats) for repeats in (1, 2))
            plan = plan_of(self.config, once)
            if kind_of(self.config.turner).problems([plan], self.config.turner, None):
                continue
            counts, again_s = self._counts(plan), plan_of(self.config, twice).duration_s - plan.duration_s
            some = [number for number in REPEATS if number * len(plan.sweeps or plan.dwells) <= MAX_SIZE or number == 1]
            if any(twice.problems(self.config)):
                some = [1]
            for repeats, *values_s in product(some, *[RESTS_S] * len(self.waits)):
                waits_s = dict(zip(self.waits, values_s, strict=True))
                lasting_s = plan.duration_s + (repeats - 1) * again_s + repeats * _longer_s(counts, least_s, waits_s)
                rests_s, dwells_s = (  # longer dwells determine more
                    tuple(wait_s for key, wait_s in waits_s.items() if key == name) for name in ("rest_s", "dwell_s")
                )
                procedure = once.model_copy(update={**waits_s, "repeats": repeats})  # too many to validate each
                candidates.append(Candidate(procedure, family, (turned, repeats, *dwells_s), lasting_s, rests_s))
        return candidates

    def select_endless(self, candidates: Sequence[Candidate]) -> Sequence[Candidate]:
        """Return runs that show whether a family can reach the uncertainty at all, however long a run may last.

        They are the runs with the most sweeps and repeats, at most `PREDICTED_REPEATS`, for each combination of the
        shortest and the longest rests.
        """
        selected = {
            (candidate.family, candidate.rests_s): candidate
            for candidate in sorted(candidates, key=lambda candidate: candidate.sizes)
            if set(candidate.rests_s) <= {RESTS_S[0], RESTS_S[-1]} and candidate.sizes[1] <= PREDICTED_REPEATS
        }
        return list(selected.values())

    def finer(self, best: Candidate) -> Sequence[Candidate]:
        """Return the candidates with slightly shorter waits, down to the next coarse value.

        Because the steps are small, a longer wait is assumed to give a smaller uncertainty.
        """
        waits_s = {key: float(getattr(best.procedure, key)) for key in self.waits}
        counts = self._counts(plan_of(self.config, best.procedure))  # waits of all repeats
        candidates = []
        for values_s in product(*map(_down_from, waits_s.values())):
            shorter_s = dict(zip(waits_s, values_s, strict=True))
            procedure = best.procedure.model_copy(update=shorter_s)  # too many to validate each
            lasting_s = best.duration_s + _longer_s(counts, waits_s, shorter_s)
            candidates.append(Candidate(procedure, best.family, (*best.sizes, *values_s), lasting_s))
        return candidates

    def _counts(self, plan: Plan) -> Mapping[str, int]:
        """Return for each key of `waits` the number of waits in a plan that last as long as the key states."""
        # By their names: a field test is a Rest as well, but its duration has another key.
        rests = sum(step.name.startswith("rest") for step in plan.steps)
        return {key: {"rest_s": rests, "dwell_s": len(plan.dwells)}[key] for key in self.waits}

    def duration_s(self, procedure: ProcedureSection) -> float:
        return plan_of(self.config, procedure).duration_s

    def predict(self, candidate: Candidate) -> Budgets | None:
        config = _change(self.config, procedure=candidate.procedure)
        plan, turner = plan_of(config, candidate.procedure), kind_of(config.turner).describe_configured(config.turner)
        try:
            rates = predict_budgets(config, plan, turner) if plan.sweeps else {}
            return Budgets(rates, predict_accelerometer_budgets(config, plan, turner.kinematics))
        except (Fault, np.linalg.LinAlgError):  # these sweeps, rests or attitudes do not determine it
            return None

    def ending(self, procedure: ProcedureSection, wanted: TargetUncertainty) -> Mapping[str, float]:
        """Return the procedure's keys that state the target; there are none without repeats, or with stages."""
        if not isinstance(procedure, SixObservationSection) or procedure.repeats == 1 or procedure.stages:
            return {}
        sizes = {"target_scale_u": wanted.scale, "target_bias_u_rad_s": wanted.bias_rad_s}
        return {key: size for key, size in sizes.items() if size < inf}


def _longer_s(counts: Mapping[str, int], waits_s: Mapping[str, float], others_s: Mapping[str, float]) -> float:
    """Return by how many seconds a run is longer if its waits last `others_s` instead of `waits_s`.

    Both, and the numbers of waits `counts`, are by the key that states the wait.
    """
    return sum(count * (others_s[key] - waits_s[key]) for key, count in counts.items())


def _down_from(wait_s: float) -> list[float]:
    """Return waits, s, from `wait_s` down to the next coarse value."""
    below = max((rest_s for rest_s in RESTS_S if rest_s < wait_s), default=wait_s - REST_STEP_S)
    return np.arange(wait_s, below + REST_STEP_S / 2, -REST_STEP_S).round(3).tolist()


@dataclass(frozen=True, slots=True)
class _HandSearch:
    """Sessions by hand with different numbers of flips and turns."""

    config: RigConfig
    per_repeat: Collection[str] = tuple(CONTRIBUTORS)  # all that the readings determine

    def candidates(self) -> Sequence[Candidate]:
        return [self._candidate(*numbers) for numbers in product(FLIP_COUNTS, TURN_COUNTS, RESTS_S[:4])]

    def select_endless(self, candidates: Sequence[Candidate]) -> Sequence[Candidate]:
        """Return only the candidate with the most flips, fewest turns and shortest rests: the best if noise is zero."""
        return [max(candidates, key=lambda candidate: (candidate.sizes[0], -candidate.sizes[1], -candidate.sizes[2]))]

    def finer(self, best: Candidate) -> Sequence[Candidate]:
        """Return the candidates with fewer flips than `best`, down to the next number that the first search tried."""
        flips, turns, rest_s = best.sizes
        below = max((number for number in FLIP_COUNTS if number < flips), default=int(flips))
        return [self._candidate(number, int(turns), rest_s) for number in range(below + 1, int(flips))]

    def duration_s(self, procedure: ProcedureSection) -> float:
        _, moves, rest_s = _session(procedure)
        return duration_s(moves, rest_s)

    def predict(self, candidate: Candidate) -> Budgets | None:
        try:
            return Budgets(predict_hand_budgets(self.config, *_session(candidate.procedure)))
        except Fault:
            return None

    def ending(self, procedure: ProcedureSection, wanted: TargetUncertainty) -> Mapping[str, float]:
        """Return the key that ends a session at the target; the part of U that no session can reduce is subtracted."""
        remaining = wanted.scale**2 - (2 * REAL_HAND_STD) ** 2
        return {"target_scale_u": round(remaining**0.5, 7)} if 0 < remaining < inf else {}

    def _candidate(self, flips: int, turns: int, rest_s: float) -> Candidate:
        procedure = _change(self.config.procedure, flips=flips, turns=turns, rest_s=rest_s)
        return Candidate(procedure, (), (flips, turns, rest_s), self.duration_s(procedure))


def _session(procedure: ProcedureSection) -> tuple[ByHandSection, Sequence[Instruction], float]:
    """Return the section of a session by hand, its instructions, and the duration of a rest, s."""
    assert isinstance(procedure, ByHandSection)
    return procedure, list(simulate_session(Asked(procedure.flips, procedure.turns))), procedure.rest_s


# The search among the runs of a procedure, by its name.
SEARCHES: Mapping[str, Callable[[RigConfig], RunSearch]] = {
    "six_observation": partial(_TurnerSearch, vary_arm, ("rest_s",)),
    "servo_six_observation": partial(_TurnerSearch, vary_servo, ("rest_s",)),
    "static_attitudes": partial(_TurnerSearch, vary_attitudes, ("dwell_s",)),
    "imu": partial(_TurnerSearch, vary_imu, ("rest_s", "dwell_s")),
    "by_hand": _HandSearch,
}

"""The shortest run of a configuration: which procedures are tried, and the shortest of them. Pure.

What the file asks for beside the uncertainty stays: order, directions, stages, several speeds, six axes, and the
attitudes where magnetometers need theirs.
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

from rig.analysis.by_hand.predicted import duration_s, predict_hand_budgets
from rig.analysis.design.predicted import predict_budgets
from rig.analysis.design.predicted_accelerations import predict_accelerometer_budgets
from rig.analysis.design.shortest import (
    SIZES,
    Budgets,
    Candidate,
    Planned,
    Searched,
    Shortest,
    TargetUncertainty,
    find_shortest,
)
from rig.config.models import ProcedureSection, RigConfig
from rig.config.procedures.hand_sections import ByHandSection
from rig.config.procedures.procedure_sections import SixObservationSection, StaticAttitudesSection
from rig.config.section import Section
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.by_hand.solution import LINES, REAL_HANDS
from rig.estimation.gyroscope.budget import FLICKER, NOISE, STATES, WANDERING
from rig.motion.by_hand import Instruction
from rig.motion.steps import Plan
from rig.plans.by_hand import WantedMoves as Asked
from rig.plans.by_hand import simulate_session
from rig.plans.phase import turner_for
from rig.plans.registry import installed
from rig.plans.shortest_motions import Motion, of_arm, of_attitudes, of_imu, of_servo
from rig.turners.registry import kind_of

SectionT = TypeVar("SectionT", bound=Section)
REPEATS = (1, 2, 3, 4, 6, 8, 12, 16)
MOST = 100  # sweeps of one plan
RESTS_S = (1.0, 2.0, 3.0, 5.0, 10.0, 20.0)  # of a rest, and of a dwell
# Of the endless run a plan of two repeats is looked at: in one alone, noise weighs too much beside what repeats have
# alike. Other rests, and more repeats, make U of it smaller yet, but not by more than this.
TWICE, HOPELESS = 2, 2.0
ANEW = NOISE, WANDERING, FLICKER, STATES  # the lines that repeats lessen, of accelerometers too
FLIPS, TURNS_BY_HAND = (8, 10, 12, 16, 24, 36, 48), (0, 3, 6)
REST_STEP_S = 0.1  # of the last, fine search


class Tried(Protocol):
    """The runs of a procedure that are tried: which there are, and what each is predicted to reach.

    `predict` is None of what cannot be run; the lines of its budgets that come `anew` each time are gone from those of
    a run that is repeated without end. `ending` are the keys that let a run end before, when what is wanted is reached.
    """

    @property
    def anew(self) -> Collection[str]: ...
    def candidates(self) -> Sequence[Candidate]: ...
    def made_endless(self, candidates: Sequence[Candidate]) -> Sequence[Candidate]: ...
    def finer(self, best: Candidate) -> Sequence[Candidate]: ...
    def duration_s(self, procedure: ProcedureSection) -> float: ...
    def predict(self, candidate: Candidate) -> Budgets | None: ...
    def ending(self, procedure: ProcedureSection, wanted: TargetUncertainty) -> Mapping[str, float]: ...


def shortest_run(config: RigConfig, wanted: TargetUncertainty) -> Shortest:
    """The shortest run of this configuration that is predicted to reach what is wanted.

    Raises Refused `not_foretold` where its procedure is none whose uncertainty is predicted, or not of what is wanted.
    """
    what = tried(config)
    _refuse_others(wanted, config)
    candidates = what.candidates()
    floors = [
        (each.family, once.without(what.anew))
        for each in what.made_endless(candidates)
        if (once := what.predict(each)) is not None
    ]
    able = {family for family, floor in floors if wanted.ratio_to_target(floor.reached) <= HOPELESS}
    least = min(floors, key=lambda each: wanted.ratio_to_target(each[1].reached))[0]
    hopeful = [each for each in candidates if each.family in able] or _longest(candidates, least, wanted.at_most_s)
    found = find_shortest(hopeful, what.predict, wanted)
    evaluated = [*(floor for _, floor in floors), *found.evaluated]
    unreachable = not any(wanted.is_met_by(each.reached) for each in evaluated)
    if found.best is None and unreachable and able and wanted.at_most_s < inf:
        unreachable = find_shortest(hopeful, what.predict, replace(wanted, at_most_s=inf)).best is None
    fine = find_shortest(what.finer(found.best.candidate), what.predict, wanted) if found.best else Searched()
    best = fine.best or found.best
    best = best and _ending(best, what.ending(best.candidate.procedure, wanted))
    shown = best or found.nearest
    before = Candidate(config.procedure, (), (), what.duration_s(config.procedure))
    own = what.predict(before)
    return Shortest(
        wanted,
        None if own is None else Planned(before, own),
        best,
        found.nearest,
        evaluated,
        unreachable,
        len(found.evaluated) + len(fine.evaluated),
        len(candidates),
        None if shown is None else _directions(plan_of(config, shown.candidate.procedure)),
    )


def tried(config: RigConfig) -> Tried:
    """What may be tried of a configuration. Raises Refused `not_foretold`."""
    procedure = config.procedure
    if not config.to_calibrate:
        raise _not_foretold("nothing is to be calibrated")
    if procedure.name not in TRIED or procedure.finds_earth_rate:
        raise _not_foretold(f"the uncertainty of the procedure {procedure.name} is not predicted")
    return TRIED[procedure.name](config)


def _not_foretold(what: str) -> Refused:
    return Refused(
        "not_foretold",
        what,
        "Use six_observation or imu with the Earth's rate known or left out, static_attitudes, servo_six_observation, "
        "or by_hand",
    )


def _refuse_others(wanted: TargetUncertainty, config: RigConfig) -> None:
    """Raise Refused `not_foretold` where something is wanted of a kind of sensor that is not calibrated."""
    kinds = {"gyroscope": not isinstance(config.procedure, StaticAttitudesSection)}
    kinds["accelerometer"] = config.procedure.accelerometer_order > 0 and any(
        each.acceleration is not None for each in config.to_calibrate.values()
    )
    for (kind, calibrated), sizes in zip(kinds.items(), (SIZES[:2], SIZES[2:]), strict=True):
        if not calibrated and any(getattr(wanted, each) < inf for each in sizes):
            raise _not_foretold(f"the procedure calibrates no {kind} whose uncertainty could be wanted")


def plan_of(config: RigConfig, procedure: ProcedureSection) -> Plan:
    """The motions of a procedure; none by hand. Raises Refused `other_turner`."""
    known = installed()[procedure.name]
    return known.plan(turner_for(known, config), procedure)


def _changed(section: SectionT, **keys: object) -> SectionT:
    """The section with other values of these keys. Raises ValidationError where no file may say them."""
    return type(section).model_validate({**dict(section), **keys})


def _ending(planned: Planned, keys: Mapping[str, float]) -> Planned:
    """The run that also ends before, by these keys of its procedure."""
    procedure = planned.candidate.procedure
    with suppress(ValidationError):  # so loose a wish that no file may say it
        procedure = _changed(procedure, **keys)
    return replace(planned, candidate=replace(planned.candidate, procedure=procedure))


def _directions(plan: Plan) -> Array | None:
    """(N, 3) the axes of the sweeps in the item's frame; None without sweeps."""
    mounts = {index: stage.mount for stage in plan.stages for index in stage.indices}
    axes = [np.array(mounts.get(sweep.index, np.eye(3))) @ sweep.axis_flange for sweep in plan.sweeps]
    return np.array(axes) if axes else None


def _longest(candidates: Sequence[Candidate], family: tuple[object, ...], at_most_s: float) -> list[Candidate]:
    """The longest of a family, alone."""
    own = [each for each in candidates if each.family == family and each.duration_s <= at_most_s]
    return sorted(own, key=lambda each: each.duration_s)[-1:]


@dataclass(frozen=True, slots=True)
class _Swept:
    """Sweeps or attitudes of a turner with joints; `motions` are what may be told of them but repeats and waits.

    Of each its family, how far it turns, and the keys of the procedure. `waits` are the keys that say how long is
    stood still: after a sweep, in an attitude.
    """

    motions: Callable[[RigConfig], Iterator[Motion]]
    waits: tuple[str, ...]
    config: RigConfig
    anew: Collection[str] = ANEW

    def candidates(self) -> Sequence[Candidate]:
        found = []
        least_s = dict.fromkeys(self.waits, RESTS_S[0])
        for family, turned, keys in self.motions(self.config):
            once, twice = (_changed(self.config.procedure, **keys, **least_s, repeats=repeats) for repeats in (1, 2))
            plan = plan_of(self.config, once)
            if kind_of(self.config.turner).problems([plan], self.config.turner, None):
                continue
            counts, again_s = self._counts(plan), plan_of(self.config, twice).duration_s - plan.duration_s
            some = [each for each in REPEATS if each * len(plan.sweeps or plan.dwells) <= MOST or each == 1]
            if any(twice.problems(self.config)):
                some = [1]
            for repeats, *values_s in product(some, *[RESTS_S] * len(self.waits)):
                waits_s = dict(zip(self.waits, values_s, strict=True))
                lasting_s = plan.duration_s + (repeats - 1) * again_s + repeats * _longer_s(counts, least_s, waits_s)
                rests_s, dwells_s = (  # of which longer dwells tell more
                    tuple(wait_s for key, wait_s in waits_s.items() if key == of) for of in ("rest_s", "dwell_s")
                )
                procedure = once.model_copy(update={**waits_s, "repeats": repeats})  # too many to validate each
                found.append(Candidate(procedure, family, (turned, repeats, *dwells_s), lasting_s, rests_s))
        return found

    def made_endless(self, candidates: Sequence[Candidate]) -> Sequence[Candidate]:
        """The candidate of each family that turns and dwells most, made twice at most, with short rests and long."""
        found = {
            (each.family, each.rests_s): each
            for each in sorted(candidates, key=lambda each: each.sizes)
            if set(each.rests_s) <= {RESTS_S[0], RESTS_S[-1]} and each.sizes[1] <= TWICE
        }
        return list(found.values())

    def finer(self, best: Candidate) -> Sequence[Candidate]:
        """The candidates that stand still a little shorter, down to the next of the coarse ones.

        By so little that those which stand still longer are taken to tell more.
        """
        waits_s = {key: float(getattr(best.procedure, key)) for key in self.waits}
        counts, found = self._counts(plan_of(self.config, best.procedure)), []  # of all repeats
        for values_s in product(*map(_down_from, waits_s.values())):
            shorter_s = dict(zip(waits_s, values_s, strict=True))
            procedure = best.procedure.model_copy(update=shorter_s)  # too many to validate each
            lasting_s = best.duration_s + _longer_s(counts, waits_s, shorter_s)
            found.append(Candidate(procedure, best.family, (*best.sizes, *values_s), lasting_s))
        return found

    def _counts(self, plan: Plan) -> Mapping[str, int]:
        """How many waits of each key a plan has."""
        # By their names: a field test is a Rest as well, and how long it lasts is another key.
        rests = sum(step.name.startswith("rest") for step in plan.steps)
        return {key: {"rest_s": rests, "dwell_s": len(plan.dwells)}[key] for key in self.waits}

    def duration_s(self, procedure: ProcedureSection) -> float:
        return plan_of(self.config, procedure).duration_s

    def predict(self, candidate: Candidate) -> Budgets | None:
        config = _changed(self.config, procedure=candidate.procedure)
        plan, made = plan_of(config, candidate.procedure), kind_of(config.turner).describe_configured(config.turner)
        try:
            rates = predict_budgets(config, plan, made) if plan.sweeps else {}
            return Budgets(rates, predict_accelerometer_budgets(config, plan, made.kinematics))
        except (Fault, np.linalg.LinAlgError):  # so few sweeps and rests, or such attitudes, tell nothing
            return None

    def ending(self, procedure: ProcedureSection, wanted: TargetUncertainty) -> Mapping[str, float]:
        """The wish, after an earlier repeat."""
        if not isinstance(procedure, SixObservationSection) or procedure.repeats == 1 or procedure.stages:
            return {}
        sizes = {"target_scale_u": wanted.scale, "target_bias_u_rad_s": wanted.bias_rad_s}
        return {key: size for key, size in sizes.items() if size < inf}


def _longer_s(counts: Mapping[str, int], waits_s: Mapping[str, float], others_s: Mapping[str, float]) -> float:
    """How much longer so many waits take when they are the others."""
    return sum(count * (others_s[key] - waits_s[key]) for key, count in counts.items())


def _down_from(wait_s: float) -> list[float]:
    """The waits of so long and of less, down to the next of the coarse ones."""
    below = max((each for each in RESTS_S if each < wait_s), default=wait_s - REST_STEP_S)
    return np.arange(wait_s, below + REST_STEP_S / 2, -REST_STEP_S).round(3).tolist()


@dataclass(frozen=True, slots=True)
class _ByHand:
    """A session by hand of so many flips and turns."""

    config: RigConfig
    anew: Collection[str] = tuple(LINES)  # all that readings tell

    def candidates(self) -> Sequence[Candidate]:
        return [self._candidate(*each) for each in product(FLIPS, TURNS_BY_HAND, RESTS_S[:4])]

    def made_endless(self, candidates: Sequence[Candidate]) -> Sequence[Candidate]:
        """The candidate of most flips and least rests: without noise, more adds nothing."""
        return [max(candidates, key=lambda each: (each.sizes[0], -each.sizes[1], -each.sizes[2]))]

    def finer(self, best: Candidate) -> Sequence[Candidate]:
        """The candidates with a few flips less, down to the next of the coarse numbers."""
        flips, turns, rest_s = best.sizes
        below = max((each for each in FLIPS if each < flips), default=int(flips))
        return [self._candidate(each, int(turns), rest_s) for each in range(below + 1, int(flips))]

    def duration_s(self, procedure: ProcedureSection) -> float:
        _, moves, rest_s = _session(procedure)
        return duration_s(moves, rest_s)

    def predict(self, candidate: Candidate) -> Budgets | None:
        try:
            return Budgets(predict_hand_budgets(self.config, *_session(candidate.procedure)))
        except Fault:
            return None

    def ending(self, procedure: ProcedureSection, wanted: TargetUncertainty) -> Mapping[str, float]:
        """The wish, before the list is done: beside what no session shows of hands."""
        own = wanted.scale**2 - (2 * REAL_HANDS) ** 2
        return {"target_scale_u": round(own**0.5, 7)} if 0 < own < inf else {}

    def _candidate(self, flips: int, turns: int, rest_s: float) -> Candidate:
        procedure = _changed(self.config.procedure, flips=flips, turns=turns, rest_s=rest_s)
        return Candidate(procedure, (), (flips, turns, rest_s), self.duration_s(procedure))


def _session(procedure: ProcedureSection) -> tuple[ByHandSection, Sequence[Instruction], float]:
    """The section of a session by hand, what is asked for in it, and how long the item rests between."""
    assert isinstance(procedure, ByHandSection)
    return procedure, list(simulate_session(Asked(procedure.flips, procedure.turns))), procedure.rest_s


# What is tried of a procedure, by its name.
TRIED: Mapping[str, Callable[[RigConfig], Tried]] = {
    "six_observation": partial(_Swept, of_arm, ("rest_s",)),
    "servo_six_observation": partial(_Swept, of_servo, ("rest_s",)),
    "static_attitudes": partial(_Swept, of_attitudes, ("dwell_s",)),
    "imu": partial(_Swept, of_imu, ("rest_s", "dwell_s")),
    "by_hand": _ByHand,
}

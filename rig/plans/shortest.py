"""The shortest run of a configuration: which procedures are tried, and the shortest of them. Pure.

What the file asks for beside the uncertainty stays: order, directions, stages, several speeds, six axes, and the
attitudes where magnetometers need theirs.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf
from typing import Protocol

import numpy as np

from rig.analysis.predicted import predicted
from rig.analysis.predicted_accelerations import predicted_accelerations
from rig.analysis.predicted_by_hand import duration_s, predicted_by_hand
from rig.analysis.shortest import SIZES, Budgets, Candidate, Planned, Searched, Shortest, Wanted, shortest
from rig.config.hand_sections import ByHandSection
from rig.config.models import ProcedureSection, RigConfig
from rig.config.procedure_sections import (
    ImuSection,
    SixObservationSection,
    StaticAttitudesSection,
)
from rig.config.servo_procedure import ServoSixObservationSection
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.budget import FLICKER, NOISE, STATES, WANDERING
from rig.estimation.by_hand.solution import LINES, REAL_HANDS
from rig.motion.state import Made
from rig.motion.steps import Plan
from rig.plans.by_hand import Wanted as Asked
from rig.plans.by_hand import listed
from rig.plans.imu import plan_imu
from rig.plans.servo_sweeps import plan_servo_six_observation
from rig.plans.shortest_motions import Motion, of_arm, of_attitudes, of_imu, of_servo
from rig.plans.six_sweeps import plan_six_observation
from rig.plans.static_attitudes import plan_static_attitudes
from rig.turners.registry import kind_of

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
    """What may be run: the candidates there are, and what each is predicted to reach, None of what cannot be run.

    The lines of its budgets that come `anew` each time are gone from those of a run that is repeated without end.
    """

    @property
    def anew(self) -> Collection[str]: ...
    def candidates(self) -> Sequence[Candidate]: ...
    def made_endless(self, candidates: Sequence[Candidate]) -> Sequence[Candidate]: ...
    def finer(self, best: Candidate) -> Sequence[Candidate]: ...
    def predict(self, candidate: Candidate) -> Budgets | None: ...
    def final(self, best: Planned | None, wanted: Wanted) -> Planned | None: ...
    def directions(self, procedure: ProcedureSection) -> Array | None: ...


def shortest_run(config: RigConfig, wanted: Wanted) -> Shortest:
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
    able = {family for family, floor in floors if wanted.share(floor.reached) <= HOPELESS}
    least = min(floors, key=lambda each: wanted.share(each[1].reached))[0]
    hopeful = [each for each in candidates if each.family in able] or _longest(candidates, least, wanted.at_most_s)
    found = shortest(hopeful, what.predict, wanted)
    endless = [floor for _, floor in floors]
    cannot_be_had = not any(wanted.met_by(each.reached) for each in (*endless, *found.looked))
    if found.best is None and cannot_be_had and able and wanted.at_most_s < inf:
        cannot_be_had = shortest(hopeful, what.predict, replace(wanted, at_most_s=inf)).best is None
    fine = shortest(what.finer(found.best.candidate), what.predict, wanted) if found.best else Searched()
    best = what.final(fine.best or found.best, wanted)
    shown = best or found.nearest
    before = Candidate(config.procedure, (), (), 0.0)
    own = what.predict(before)
    return Shortest(
        wanted,
        None if own is None else Planned(replace(before, duration_s=_duration_s(config)), own),
        best,
        found.nearest,
        [*endless, *found.looked],
        cannot_be_had,
        len(found.looked) + len(fine.looked),
        len(candidates),
        None if shown is None else what.directions(shown.candidate.procedure),
    )


def tried(config: RigConfig) -> Tried:
    """What may be tried of a configuration. Raises Refused `not_foretold`."""
    procedure = config.procedure
    if not config.to_calibrate:
        raise _not_foretold("nothing is to be calibrated")
    if isinstance(procedure, ByHandSection):
        return _ByHand(config, procedure)
    made = kind_of(config.turner).meant(config.turner)
    if isinstance(procedure, ServoSixObservationSection):
        return _Swept(config, made, of_servo)
    if type(procedure) is StaticAttitudesSection:
        return _Swept(config, made, of_attitudes, ("dwell_s",))
    if type(procedure) is ImuSection and not procedure.finds_earth_rate:
        return _Swept(config, made, of_imu, ("rest_s", "dwell_s"))
    if type(procedure) is SixObservationSection and not procedure.finds_earth_rate:
        return _Swept(config, made, of_arm)
    raise _not_foretold(f"the uncertainty of the procedure {procedure.name} is not predicted")


def _not_foretold(what: str) -> Refused:
    return Refused(
        "not_foretold",
        what,
        "Use six_observation or imu with the Earth's rate known or left out, static_attitudes, servo_six_observation, "
        "or by_hand",
    )


def _refuse_others(wanted: Wanted, config: RigConfig) -> None:
    """Raise Refused `not_foretold` where something is wanted of a kind of sensor that is not calibrated."""
    kinds = {"gyroscope": not isinstance(config.procedure, StaticAttitudesSection)}
    kinds["accelerometer"] = config.procedure.accelerometer_order > 0 and any(
        each.acceleration is not None for each in config.to_calibrate.values()
    )
    for (kind, calibrated), sizes in zip(kinds.items(), (SIZES[:2], SIZES[2:]), strict=True):
        if not calibrated and any(getattr(wanted, each) < inf for each in sizes):
            raise _not_foretold(f"the procedure calibrates no {kind} whose uncertainty could be wanted")


def plan_of(config: RigConfig, procedure: ProcedureSection) -> Plan:
    """The motions of a procedure; none by hand."""
    if isinstance(procedure, ServoSixObservationSection):
        return plan_servo_six_observation(config.turner, procedure)  # type: ignore[arg-type]
    if isinstance(procedure, ImuSection):
        return plan_imu(config.arm, procedure)
    if isinstance(procedure, StaticAttitudesSection):
        return plan_static_attitudes(config.arm, procedure)
    if isinstance(procedure, SixObservationSection):
        return plan_six_observation(config.arm, procedure)
    return Plan((), (), ())


def _duration_s(config: RigConfig) -> float:
    procedure = config.procedure
    if isinstance(procedure, ByHandSection):
        return duration_s(list(listed(Asked(procedure.flips, procedure.turns))), procedure.rest_s)
    return plan_of(config, procedure).duration_s


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

    config: RigConfig
    made: Made
    motions: Callable[[RigConfig], Iterator[Motion]]
    waits: tuple[str, ...] = ("rest_s",)
    anew: Collection[str] = ANEW

    def candidates(self) -> Sequence[Candidate]:
        found = []
        shortest_s = dict.fromkeys(self.waits, RESTS_S[0])
        for family, turned, keys in self.motions(self.config):
            once, twice = (self._procedure(**keys, repeats=repeats, **shortest_s) for repeats in (1, 2))
            plan = plan_of(self.config, once)
            if kind_of(self.config.turner).problems([plan], self.config.turner, None):
                continue
            again_s = plan_of(self.config, twice).duration_s - plan.duration_s
            some = [each for each in REPEATS if each * len(plan.sweeps or plan.dwells) <= MOST or each == 1]
            if any(twice.problems(self.config)):
                some = [1]
            for repeats, waits_s in product(some, product(RESTS_S, repeat=len(self.waits))):
                longer_s = sum(
                    count * (wait_s - RESTS_S[0]) for count, wait_s in zip(self._counts(plan), waits_s, strict=True)
                )
                lasting_s = plan.duration_s + (repeats - 1) * again_s + repeats * longer_s
                procedure = self._procedure(**keys, repeats=repeats, **dict(zip(self.waits, waits_s, strict=True)))
                rests_s, dwells_s = self._apart(waits_s)
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
        waits_s = [float(getattr(best.procedure, key)) for key in self.waits]
        counts = self._counts(plan_of(self.config, best.procedure))  # of all repeats
        found = []
        for shorter_s in product(*map(_down_from, waits_s)):
            less_s = sum(
                count * (wait_s - each_s) for count, wait_s, each_s in zip(counts, waits_s, shorter_s, strict=True)
            )
            procedure = best.procedure.model_copy(update=dict(zip(self.waits, shorter_s, strict=True)))
            sizes, lasting_s = (*best.sizes, *shorter_s), best.duration_s - less_s
            found.append(Candidate(procedure, best.family, sizes, lasting_s))
        return found

    def _apart(self, waits_s: Sequence[float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The rests among waits, and the dwells, of which longer ones tell more."""
        rests_s, dwells_s = (
            tuple(each for key, each in zip(self.waits, waits_s, strict=True) if (key == "dwell_s") == dwells)
            for dwells in (False, True)
        )
        return rests_s, dwells_s

    def _counts(self, plan: Plan) -> list[int]:
        """How many waits of each key a plan has."""
        rests = sum(1 for step in plan.steps if step.name.startswith("rest"))
        return [{"rest_s": rests, "dwell_s": len(plan.dwells)}[each] for each in self.waits]

    def predict(self, candidate: Candidate) -> Budgets | None:
        config = self.config.model_copy(update={"procedure": candidate.procedure})
        plan = plan_of(config, candidate.procedure)
        try:
            rates = predicted(config, plan, self.made) if plan.sweeps else {}
            return Budgets(rates, predicted_accelerations(config, plan, self.made.kinematics))
        except (Fault, np.linalg.LinAlgError):  # so few sweeps and rests, or such attitudes, tell nothing
            return None

    def final(self, best: Planned | None, wanted: Wanted) -> Planned | None:
        """The run that also ends after an earlier repeat, when U is reached."""
        procedure = None if best is None else best.candidate.procedure
        if best is None or not isinstance(procedure, SixObservationSection) or procedure.repeats == 1:
            return best
        if procedure.stages:
            return best
        sizes = ("wanted_scale_u", wanted.scale), ("wanted_bias_u_rad_s", wanted.bias_rad_s)
        ending = procedure.model_copy(update={key: size for key, size in sizes if size < inf})
        return replace(best, candidate=replace(best.candidate, procedure=ending))

    def directions(self, procedure: ProcedureSection) -> Array | None:
        plan = plan_of(self.config, procedure)
        if not plan.sweeps:
            return None
        turned = [np.array(sweep.axis_flange) for sweep in plan.sweeps]
        for stage in plan.stages:
            for each in (each for each in plan.sweeps if each.index in stage.indices):
                turned[each.index] = np.array(stage.mount) @ np.array(each.axis_flange)
        return np.array(turned)

    def _procedure(self, **keys: object) -> ProcedureSection:
        return self.config.procedure.model_copy(update=keys)


def _down_from(wait_s: float) -> list[float]:
    """The waits of so long and of less, down to the next of the coarse ones."""
    below = max((each for each in RESTS_S if each < wait_s), default=wait_s - REST_STEP_S)
    return np.arange(wait_s, below + REST_STEP_S / 2, -REST_STEP_S).round(3).tolist()


@dataclass(frozen=True, slots=True)
class _ByHand:
    """A session by hand of so many flips and turns."""

    config: RigConfig
    section: ByHandSection
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

    def predict(self, candidate: Candidate) -> Budgets | None:
        flips, turns, rest_s = (getattr(candidate.procedure, each) for each in ("flips", "turns", "rest_s"))
        try:
            moves = list(listed(Asked(flips, turns)))
            return Budgets(predicted_by_hand(self.config, self.section, moves, rest_s))
        except Fault:
            return None

    def final(self, best: Planned | None, wanted: Wanted) -> Planned | None:
        """The session that also ends before its list, when U is reached: beside what no session shows of hands."""
        own = wanted.scale**2 - (2 * REAL_HANDS) ** 2
        if best is None or not 0 < own < inf:
            return best
        procedure = best.candidate.procedure.model_copy(update={"wanted_scale_u": round(own**0.5, 7)})
        return replace(best, candidate=replace(best.candidate, procedure=procedure))

    def directions(self, procedure: ProcedureSection) -> Array | None:
        return None

    def _candidate(self, flips: int, turns: int, rest_s: float) -> Candidate:
        procedure = self.section.model_copy(update={"flips": flips, "turns": turns, "rest_s": rest_s})
        lasting_s = duration_s(list(listed(Asked(flips, turns))), rest_s)
        return Candidate(procedure, (), (flips, turns, rest_s), lasting_s)

"""Sweeps, and attitudes where an accelerometer is calibrated, again and again while the sensors warm and cool."""

from collections.abc import Collection, Iterator
from dataclasses import replace

from rig.config.models import ArmSection
from rig.config.procedure_sections import ThermalSection
from rig.motion.model import home_of
from rig.motion.state import Joints
from rig.motion.steps import Dwell, Plan, Rest, Step, Sweep
from rig.plans.six_sweeps import approach_home, sets_of_sweeps
from rig.plans.static_attitudes import dwells

LEAST_WAIT_S = 1.0


def plan_thermal(
    arm: ArmSection,
    procedure: ThermalSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """The sets one after the other, `procedure.repeats` of them at most, each from home and back.

    Before each the arm rests at home until the temperature is right. A set that is not whole in `done` is made anew:
    its sweeps belong to one temperature. Raises Refused `axes_do_not_span`.
    """
    home = home_of(arm)
    start = home if start_q_rad is None else start_q_rad
    steps: list[Step] = list(approach_home(arm, procedure, start))
    for each in _sets(arm, procedure):
        if not set(_indices(each)) <= set(done):
            steps += [Rest("wait for the next temperature", _wait_s(procedure, each), for_temperature=True), *each]
    return Plan(tuple(steps), start_q_rad=start, home_q_rad=home)


def _sets(arm: ArmSection, procedure: ThermalSection) -> Iterator[list[Step]]:
    """The steps of each set, whose sweeps and dwells are counted through."""
    first = 0
    once = procedure.model_copy(update={"repeats": 1})
    for swept in sets_of_sweeps(arm, procedure):
        steps = _counted(swept, first)
        if procedure.with_attitudes:
            steps += dwells(arm, once, first=first + len(_indices(steps)))
        first += len(_indices(steps))
        yield steps


def _counted(steps: list[Step], first: int) -> list[Step]:
    places = iter(range(first, first + len(steps)))
    return [replace(step, index=next(places)) if isinstance(step, Sweep) else step for step in steps]


def _indices(steps: list[Step]) -> list[int]:
    return [step.index for step in steps if isinstance(step, (Sweep, Dwell))]


def _wait_s(procedure: ThermalSection, steps: list[Step]) -> float:
    """How long the temperature takes to the next set at its fastest, without the set itself: a guess, for the plan."""
    gap_s = 60 * procedure.gap_k / (procedure.most_rate_k_per_min * 2)
    return max(LEAST_WAIT_S, gap_s - sum(step.duration_s for step in steps))

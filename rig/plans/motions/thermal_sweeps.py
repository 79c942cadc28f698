"""Sweeps, and attitudes for an accelerometer, repeated while the sensors warm and cool."""

from collections.abc import Collection, Iterator
from dataclasses import replace

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import ThermalSection
from rig.motion.model import find_home
from rig.motion.steps import Dwell, Plan, Rest, Step, Sweep
from rig.motion.turner_state import Joints
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.plans.motions.static_attitudes import dwells
from rig.plans.motions.temperature_course import NEXT_SET_FRACTION
from rig.plans.motions.transfer_steps import append_steps, approach, pace_of

MIN_WAIT_S = 1.0


def plan_thermal(
    arm: ArmSection,
    procedure: ThermalSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """Return the plan of at most `procedure.repeats` sets of sweeps and attitudes; each set begins and ends at home.

    Before each set the arm rests at home until the temperature is right. A set that is incomplete in `done` is
    repeated, because its sweeps belong to one temperature. Raise Refused `axes_do_not_span`.
    """
    plan = approach(start_q_rad, find_home(arm), pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2))
    for steps in _sets(arm, procedure):
        if not {step.index for step in steps if isinstance(step, (Sweep, Dwell))} <= set(done):
            wait = Rest("wait for the next temperature", _wait_s(procedure, steps), for_temperature=True)
            plan = append_steps(plan, (wait, *steps))
    return plan


def _sets(arm: ArmSection, procedure: ThermalSection) -> Iterator[list[Step]]:
    """Yield the steps of each set: one series of the sweeps, then the attitudes; numbers continue from set to set."""
    sweeps = len(plan_six_observation(arm, procedure).sweeps)
    in_each, attitudes = sweeps // procedure.repeats, len(procedure.attitudes) if procedure.with_attitudes else 0
    for number in range(procedure.repeats):
        indices, dwells_before = range(number * in_each, (number + 1) * in_each), number * attitudes
        sweep_steps = plan_six_observation(arm, procedure, None, {*range(sweeps)} - {*indices}).steps
        steps = [
            replace(step, index=step.index + dwells_before) if isinstance(step, Sweep) else step for step in sweep_steps
        ]
        if attitudes:
            steps += dwells(arm, procedure, 1, first=indices.stop + dwells_before)
        yield steps


def _wait_s(procedure: ThermalSection, steps: list[Step]) -> float:
    """Return the wait before the next set of sweeps, s, if the temperature changes at its largest permitted rate."""
    gap_s = 60 * NEXT_SET_FRACTION * procedure.max_step_k / procedure.max_rate_k_per_min
    return max(MIN_WAIT_S, gap_s - sum(step.duration_s for step in steps))

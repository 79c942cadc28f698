"""Sweeps and attitudes in one run, for a gyroscope and the accelerometer in the same device."""

from collections.abc import Collection

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import ImuSection
from rig.motion.steps import Plan
from rig.motion.turner_state import Joints
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.plans.motions.static_attitudes import dwells
from rig.plans.motions.transfer_steps import append_steps


def plan_imu(
    arm: ArmSection,
    procedure: ImuSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """Return the plan of all sweeps, then all attitudes; the arm is at home before, between and after these.

    Sweeps (`plan_six_observation`) are counted first, dwells (`plan_static_attitudes`) after them; `done` are the
    indices of sweeps and dwells to leave out. Raise Refused `axes_do_not_span`.
    """
    sweeps = plan_six_observation(arm, procedure, start_q_rad, done)
    first = len(plan_six_observation(arm, procedure).sweeps)
    return append_steps(sweeps, dwells(arm, procedure, procedure.repeats, done, first))

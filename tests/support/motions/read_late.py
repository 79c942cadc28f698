"""One sweep on a computer that is too busy to read what the sensors send until the arm is home again."""

from collections.abc import Collection
from typing import Literal

from firmware_host import serial_port
from rig.procedure import (
    ArmSection,
    Joints,
    Plan,
    Procedure,
    Rest,
    SixSweepsSection,
    Sweep,
    Transfer,
    Verbs,
    plan_six_observation,
)

BUSY_S = 4.0  # longer than a fast laboratory waits for this computer, and moves after that


class ReadLateSection(SixSweepsSection):
    """The sweep."""

    name: Literal["read_late"] = "read_late"


def plan(
    arm: ArmSection, procedure: ReadLateSection, start_q_rad: Joints | None = None, done: Collection[int] = ()
) -> Plan:
    """Plan the first of six sweeps."""
    return plan_six_observation(arm, procedure, start_q_rad, {*done, *range(1, 6)})


def read_late(rig: Verbs) -> None:
    """Let the threads that read sensors read only after the last motion."""
    usual_s = serial_port.READ_TIMEOUT_S
    rig.preflight()
    rig.start_sampling()
    for step in rig.plan.steps:
        match step:
            case Transfer():
                rig.move(step)
            case Sweep():
                serial_port.READ_TIMEOUT_S = BUSY_S
                rig.sweep(step)
            case Rest():
                rig.rest(step)
    serial_port.READ_TIMEOUT_S = usual_s


PROCEDURE = Procedure(name="read_late", section=ReadLateSection, plan=plan, script=read_late)

"""The phases of a run: each a movement that is recorded into files of its own and judged."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol

from rig.arm.motion import Plan
from rig.arm.state import Joints
from rig.config.models import RigConfig
from rig.plans.registry import AnyProcedure, Procedures


class PhasePlanner(Protocol):
    """As `Planner`, for the arm and the section of one configuration."""

    def __call__(self, start_q_rad: Joints | None = None, done: Collection[int] = ()) -> Plan: ...


@dataclass(frozen=True, slots=True)
class Phase:
    """One movement of a run.

    `procedure` says what streams, what is done and how it is judged, `plan` makes the steps. The operator has `agreed`
    to it with the phase before, and `follows` is what comes after it if it passes.
    """

    procedure: AnyProcedure
    plan: PhasePlanner
    agreed: bool = False
    follows: "Phase | None" = None


def first_phase(procedure: AnyProcedure, config: RigConfig, procedures: Procedures) -> Phase:
    """The phase a run of `procedure` begins with; what follows repeats its movement."""

    def plan(start_q_rad: Joints | None = None, done: Collection[int] = ()) -> Plan:
        return procedure.plan(config.arm, config.procedure, start_q_rad, done)

    follows = None
    if config.procedure.then_verify and procedure.then is not None:
        follows = Phase(procedures[procedure.then], plan, agreed=True)
    return Phase(procedure, plan, follows=follows)

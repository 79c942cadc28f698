"""The phases of a run: movements with their own recordings and verdicts."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol

from rig.config.models import RigConfig, TurnerSection
from rig.errors import Refused
from rig.motion.steps import Plan
from rig.motion.turner_state import Joints
from rig.plans.procedure_registry import AnyProcedure, Procedures
from rig.plans.script_errors import script_errors


class PhasePlanner(Protocol):
    """A `Planner` whose turner and section are those of one configuration."""

    def __call__(self, start_q_rad: Joints | None = None, done: Collection[int] = ()) -> Plan: ...


@dataclass(frozen=True, slots=True)
class Phase:
    """One movement of a run.

    `procedure` determines readings, steps and verdict; `plan` makes the steps. `agreed`: whether the operator agreed to
    this phase together with the previous one; `follows`: the next phase, if this one passes.
    """

    procedure: AnyProcedure
    plan: PhasePlanner
    agreed: bool = False
    follows: "Phase | None" = None


def first_phase(procedure: AnyProcedure, config: RigConfig, procedures: Procedures) -> Phase:
    """Return the phase with which a run of `procedure` begins; the next phase repeats its movement.

    Raise Refused `no_such_procedure`. The phase's `plan` raises Refused as the procedure's does, and `script_failed`;
    also `rank_deficient` or `ill_conditioned` if the whole plan's attitudes do not determine the requested parameters,
    and `other_turner` if the procedure needs another kind of turner.
    """

    def plan(start_q_rad: Joints | None = None, done: Collection[int] = ()) -> Plan:
        turner = turner_for(procedure, config)
        with script_errors(f"the procedure {procedure.name} cannot be planned"):
            steps = procedure.plan(turner, config.procedure, start_q_rad, done)
            if not isinstance(steps, Plan):
                raise TypeError(f"its planner gives {type(steps).__name__}, no Plan")
        if not done:
            from rig.analysis.design.attitude_information import refuse_undetermined

            refuse_undetermined(config, steps)
        return steps

    following = procedure.following(procedures) if config.procedure.then_verify else None
    follows = None if following is None else Phase(following, plan, agreed=True)
    return Phase(procedure, plan, follows=follows)


def turner_for(procedure: AnyProcedure, config: RigConfig) -> TurnerSection:
    """Return the turner's section, of the type that the procedure needs. Raise Refused `other_turner`."""
    if not isinstance(config.turner, procedure.turner):
        raise Refused(
            "other_turner",
            f"the procedure {procedure.name} plans for {procedure.turner.__name__}, but the configuration states "
            f"{type(config.turner).__name__}",
            "Name a procedure for what turns the sensors, or the turner that the procedure is for",
        )
    return config.turner

"""The dry run: all motions of the plan, with times and limits."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from rig.config.models import RigConfig
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.motion.plan_warnings import doubts
from rig.motion.steps import POSE_TOLERANCE_RAD, Dwell, Plan, Rest, Step, Sweep, Transfer, closes, turn_words
from rig.motion.turner_state import JOINT_NAMES, Joints
from rig.station.plain_text import MINUTES_FROM_S, duration_words, plain

if TYPE_CHECKING:
    from rig.analysis.consistency.detection_limits import DetectionLimit
    from rig.analysis.design.attitude_information import AttitudeAccount
    from rig.analysis.design.planned_limits import DetectionLimits


@dataclass(frozen=True, eq=False)
class DryRun:
    """A plan with its configuration, and with predictions that are computed on demand.

    `model`: the turner's model, None if the turner's section does not state the model. `repeated`: whether a
    verification repeats the movement.
    """

    model: str | None
    plan: Plan
    config: RigConfig
    repeated: bool

    @cached_property
    def account(self) -> "AttitudeAccount | None":
        """The accuracy to expect of accelerometers, None if none is calibrated. Raise as `attitude_account` does."""
        if self.config.procedure.accelerometer_order == 0:
            return None
        from rig.analysis.design.attitude_information import attitude_account

        return attitude_account(self.config, self.plan)

    @cached_property
    def detection_limits(self) -> "DetectionLimits":
        """The smallest faults that the checks detect."""
        from rig.analysis.design.planned_limits import predict_limits
        from rig.turners.turner_registry import kind_of

        turner = self.config.turner
        return predict_limits(self.config, self.plan, kind_of(turner).describe_configured(turner).kinematics)

    @property
    def steps(self) -> Sequence[Step]:
        """The motions, rests and dwells in their order; angles in rad, speeds in rad/s, times in s."""
        return self.plan.steps

    @property
    def duration_s(self) -> float:
        """The duration of the movement, without the settling of sensors or a repetition for the verification."""
        return self.plan.duration_s

    def to_dict(self) -> dict[str, Any]:
        """Return the plan as `rig plan --json` prints it: plain numbers, lists and texts in SI units."""
        return plan_document(self)

    def __repr__(self) -> str:
        return f"<plan: {_counts(self.plan)}{len(self.plan.motions)} motions, {self.duration_s:.1f} s>"


def plan_document(planned: DryRun) -> dict[str, Any]:
    """Return the plan for machines: SI units, every field of every step."""
    from rig.report.terminal.attitude_accuracy import account_document
    from rig.report.words.detection_limit_words import detection_limit_entries

    plan, account, predicted = planned.plan, planned.account, planned.detection_limits
    steps = [{"kind": type(step).__name__.lower(), **asdict(step)} for step in plan.steps]
    document: dict[str, Any] = {
        "schema": "rig.plan/1",
        "model": planned.model,
        "duration_s": plan.duration_s,
        "repeated": planned.repeated,
        "doubts": doubts(plan),
        "steps": steps,
    }
    if plan.stages:
        document["stages"] = [{**asdict(stage), "indices": sorted(stage.indices)} for stage in plan.stages]
    if account is not None:
        document |= {"settling_s": plan.settling_s, "attitudes": account_document(account)}
    for key, by_sensor in (
        ("detection_limits", predicted.rates),
        ("acceleration_detection_limits", predicted.accelerations),
    ):
        if by_sensor:
            entries = {name: detection_limit_entries(limits) for name, limits in by_sensor.items()}
            document[key] = {name: [limit.model_dump() for limit in limits] for name, limits in entries.items()}
    return document


def print_plan(planned: DryRun, *, as_json: bool) -> None:
    """Print the plan on stdout: a table in degrees for people, JSON in SI units for machines."""
    if as_json:
        print(json.dumps(plan_document(planned), indent=2, allow_nan=False))
        return
    console = Console(highlight=False)
    _print_steps(planned, console)
    _print_predictions(planned, console)  # these take longer to compute than the steps


def _print_steps(planned: DryRun, console: Console) -> None:
    """Print every step, the total time, and warnings about the plan."""
    plan = planned.plan
    table = Table(
        title=f"plan{'' if planned.model is None else f' for a {planned.model}'}, from the home pose",
        title_justify="left",
        box=SIMPLE,
    )
    for heading in ("start s", "step", "duration s", "joints °", "°/s", "°/s²"):
        is_text, folds = heading in ("step", "joints °"), heading == "joints °"  # may contain a stage's instruction
        table.add_column(heading, justify="left" if is_text else "right", no_wrap=not folds)
    at_s = 0.0
    stages = {stage.begins: (number, stage) for number, stage in enumerate(plan.stages, start=1)}
    for index, step in enumerate(plan.steps):
        if index in stages:
            number, stage = stages[index]
            table.add_row("", f"stage {number}", "", plain(stage.instruction), "", "")
        name = step.name if isinstance(step, (Sweep, Dwell)) else _name(step)
        table.add_row(f"{at_s:.1f}", name, f"{step.duration_s:.2f}", *_motion(step))
        at_s += step.duration_s
    console.print(table)
    long = f" ({duration_words(plan.duration_s)})" if plan.duration_s >= MINUTES_FROM_S else ""
    console.print(f"{_counts(plan)}{len(plan.motions)} motions, {plan.duration_s:.1f} s{long}; all within limits")
    if isinstance(section := planned.config.procedure, SixObservationSection) and section.has_target:
        console.print(plain(_describe_end(section, plan.duration_s)))
    if arcs := {turn_words(sweep.angle_rad) for sweep in plan.sweeps if not closes(sweep.angle_rad)}:
        console.print(f"Sweeps are averaged over {', '.join(sorted(arcs))}, the angle of the encoders")
    if plan.dwells:
        whole_s = plan.duration_s + plan.settling_s
        console.print(
            f"Before each dwell the sensors may take {plan.dwells[0].settle_s:g} s to settle: {whole_s:.1f} s in all "
            "at most"
        )
    if planned.repeated:
        console.print(f"If the calibration passes, it is repeated to verify it: {2 * plan.duration_s:.1f} s in all")
    for doubt in doubts(plan):
        console.print(f"Note: {doubt}")


def _describe_end(section: SixObservationSection, duration_s: float) -> str:
    """Return the sentence that a run of several repeats may end after any of them."""
    from rig.analysis.design.candidate_search import target_of
    from rig.report.terminal.shortest_words import wish_words

    wanted = target_of(section)
    assert wanted is not None, "it has a target"
    repeats = f"of {section.repeats} repeats, each of about {duration_s / section.repeats:.1f} s"
    return f"It ends after the first {repeats}, with {wish_words(wanted)}"


def _print_predictions(planned: DryRun, console: Console) -> None:
    """Print the accuracy of accelerometers expected from the attitudes, and the detection limits of the checks."""
    from rig.report.terminal.attitude_accuracy import print_account

    account, detection_limits = planned.account, planned.detection_limits
    if account is not None:
        print_account(console, account)
    if detection_limits.rates or detection_limits.accelerations:
        console.print("The smallest fault that the checks detect in 95 of 100 runs, for parts as in their data sheets:")
    for what, by_sensor in (("gyroscopes", detection_limits.rates), ("accelerometers", detection_limits.accelerations)):
        if by_sensor:
            console.print(_limits_table(what, by_sensor))


def _counts(plan: Plan) -> str:
    """Return the numbers of sweeps and dwells in words, for the beginning of a line."""
    sweeps = f"{len(plan.sweeps)} sweeps, " if plan.sweeps or not plan.dwells else ""
    return sweeps + (f"{len(plan.dwells)} dwells, " if plan.dwells else "")


def _limits_table(what: str, by_sensor: "Mapping[str, Sequence[DetectionLimit]]") -> Table:
    """Return a table with a row for each fault and a column for each sensor; the faults' heading is "fault of `what`".

    A dash means that no check of the sensor detects the fault.
    """
    from rig.report.words.detection_limit_words import size_words

    table = Table(box=SIMPLE)
    table.add_column(f"fault of {what}")
    for name in by_sensor:
        table.add_column(plain(name), justify="right")
    sizes = [
        {limit.what: size_words(limit.size if math.isfinite(limit.size) else None, limit.unit) for limit in limits}
        for limits in by_sensor.values()
    ]
    for fault in dict.fromkeys(fault for by_fault in sizes for fault in by_fault):
        table.add_row(fault, *(by_fault.get(fault, "–") for by_fault in sizes))
    return table


def _name(step: Transfer | Rest) -> str:
    if isinstance(step, Rest) and step.for_temperature:
        return "wait"
    return "trial" if isinstance(step, Transfer) and step.tries else type(step).__name__.lower()


def _motion(step: Step) -> tuple[str, str, str]:
    """Return a step's joint angles, speed and acceleration in degrees, as cells, which are blank for a rest."""
    if isinstance(step, (Rest, Dwell)):
        return "", "", ""
    turns = [
        f"{name} {math.degrees(start):+.1f} → {math.degrees(target):+.1f}"
        for name, start, target in zip(_names(step.start_q_rad), step.start_q_rad, step.target_q_rad, strict=True)
        if abs(target - start) > POSE_TOLERANCE_RAD
    ]
    return "\n".join(turns), f"{math.degrees(step.speed_rad_s):g}", f"{math.degrees(step.acceleration_rad_s2):g}"


def _names(q_rad: Joints) -> Sequence[str]:
    """Return the names of the joints: an arm's names, or else numbers."""
    return JOINT_NAMES if len(q_rad) == len(JOINT_NAMES) else [f"joint {i + 1}" for i in range(len(q_rad))]

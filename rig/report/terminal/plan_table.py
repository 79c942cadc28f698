"""The dry run: every motion the plan holds, with its time and its margin to the limits."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from rig.analysis.design.shortest import target_of
from rig.config.models import RigConfig
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.motion.doubts import doubts
from rig.motion.state import JOINT_NAMES, Joints
from rig.motion.steps import SAME_PLACE_RAD, Dwell, Plan, Rest, Step, Sweep, Transfer, closes, turn_words
from rig.report.terminal.shortest_words import wish_words
from rig.station.plain_text import LONG_S, duration_words, plain

if TYPE_CHECKING:
    from rig.analysis.consistency.detection_limits import DetectionLimit
    from rig.analysis.design.attitude_account import AttitudeAccount
    from rig.analysis.design.planned import DetectionLimits


@dataclass(frozen=True, eq=False)
class DryRun:
    """A plan by its configuration, `repeated` if it is done once more, to verify; what it tells is found when asked.

    `model` is what the turner is called that it is for; None where its section does not say.
    """

    model: str | None
    plan: Plan
    config: RigConfig
    repeated: bool

    @cached_property
    def account(self) -> "AttitudeAccount | None":
        """What the attitudes tell, None where nothing is asked of them. Raises Refused as `attitude_account`."""
        from rig.analysis.design.attitude_account import attitude_account

        return attitude_account(self.config, self.plan)

    @cached_property
    def told(self) -> "DetectionLimits":
        """From what sizes on the checks tell that something happened."""
        from rig.analysis.design.planned import predict_limits
        from rig.turners.registry import kind_of

        turner = self.config.turner
        return predict_limits(self.config, self.plan, kind_of(turner).describe_configured(turner).kinematics)

    @property
    def steps(self) -> Sequence[Step]:
        """The motions, rests and dwells in their order; angles in rad, speeds in rad/s, times in s."""
        return self.plan.steps

    @property
    def duration_s(self) -> float:
        """How long the movement takes, without settling and without what repeats it."""
        return self.plan.duration_s

    def to_dict(self) -> dict[str, Any]:
        """The plan as `rig plan --json` says it: plain numbers, lists and texts in SI units."""
        return plan_document(self)

    def __repr__(self) -> str:
        return f"<plan: {_measured(self.plan)}{len(self.plan.motions)} motions, {self.duration_s:.1f} s>"


def plan_document(planned: DryRun) -> dict[str, Any]:
    """The plan for machines: SI units, every field of every step."""
    from rig.report.terminal.attitude_account import account_document
    from rig.report.words.told_words import told_from_entries

    plan, account, told = planned.plan, planned.account, planned.told
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
    for key, by_sensor in (("detection_limits", told.rates), ("acceleration_detection_limits", told.accelerations)):
        if by_sensor:
            found = {name: told_from_entries(each) for name, each in by_sensor.items()}
            document[key] = {name: [each.model_dump() for each in entries] for name, entries in found.items()}
    return document


def print_plan(planned: DryRun, *, as_json: bool) -> None:
    """The plan on stdout: a table in degrees for people, JSON in SI units for machines."""
    if as_json:
        print(json.dumps(plan_document(planned), indent=2, allow_nan=False))
        return
    console = Console(highlight=False)
    _print_steps(planned, console)
    _print_told(planned, console)  # which takes longer to find than the steps


def _print_steps(planned: DryRun, console: Console) -> None:
    """Every step, how long it all takes, and what is doubtful about it."""
    plan = planned.plan
    table = Table(
        title=f"plan{'' if planned.model is None else f' for a {planned.model}'}, from the home pose",
        title_justify="left",
        box=SIMPLE,
    )
    for heading in ("at s", "step", "for s", "joints °", "°/s", "°/s²"):
        left, folds = heading in ("step", "joints °"), heading == "joints °"  # where a stage's instruction stands too
        table.add_column(heading, justify="left" if left else "right", no_wrap=not folds)
    at_s = 0.0
    begins = {stage.begins: (number, stage) for number, stage in enumerate(plan.stages, start=1)}
    for place, step in enumerate(plan.steps):
        if place in begins:
            number, stage = begins[place]
            table.add_row("", f"stage {number}", "", plain(stage.instruction), "", "")
        name = step.name if isinstance(step, (Sweep, Dwell)) else _name(step)
        table.add_row(f"{at_s:.1f}", name, f"{step.duration_s:.2f}", *_motion(step))
        at_s += step.duration_s
    console.print(table)
    long = f" ({duration_words(plan.duration_s)})" if plan.duration_s >= LONG_S else ""
    console.print(f"{_measured(plan)}{len(plan.motions)} motions, {plan.duration_s:.1f} s{long}; all within limits")
    if isinstance(section := planned.config.procedure, SixObservationSection) and (wanted := target_of(section)):
        repeats = f"of {section.repeats} repeats, each of about {plan.duration_s / section.repeats:.1f} s"
        console.print(plain(f"It ends after the first {repeats}, with {wish_words(wanted)}"))
    if arcs := {turn_words(sweep.angle_rad) for sweep in plan.sweeps if not closes(sweep.angle_rad)}:
        console.print(f"Sweeps are averaged over {', '.join(sorted(arcs))}, as far as the encoders show this angle")
    if plan.dwells:
        whole_s = plan.duration_s + plan.settling_s
        console.print(
            f"Before each dwell the sensors may take {plan.dwells[0].settle_s:g} s to settle: {whole_s:.1f} s at most"
        )
    if planned.repeated:
        console.print(f"If the calibration passes, the same once more to verify it: {2 * plan.duration_s:.1f} s in all")
    for doubt in doubts(plan):
        console.print(f"Note: {doubt}")


def _print_told(planned: DryRun, console: Console) -> None:
    """What the attitudes tell of accelerometers, and the checks of damage."""
    from rig.report.terminal.attitude_account import print_account

    account, told = planned.account, planned.told
    if account is not None:
        print_account(console, account)
    if told.rates or told.accelerations:
        console.print(
            "The smallest disturbance that the checks notice in 95 of 100 runs, for parts as in their data sheets:"
        )
    for what, by_sensor in (("to gyroscopes", told.rates), ("to accelerometers", told.accelerations)):
        if by_sensor:
            console.print(_told_table(what, by_sensor))


def _measured(plan: Plan) -> str:
    """How many sweeps and dwells, before what else there is to count."""
    sweeps = f"{len(plan.sweeps)} sweeps, " if plan.sweeps or not plan.dwells else ""
    return sweeps + (f"{len(plan.dwells)} dwells, " if plan.dwells else "")


def _told_table(what: str, by_sensor: "Mapping[str, Sequence[DetectionLimit]]") -> Table:
    """A row for each thing that may happen, a column for each sensor; a dash where nothing checks it of this sensor."""
    from rig.report.words.told_words import size_words, told_from_entries

    table = Table(box=SIMPLE)
    table.add_column(f"what happens {what}")
    for name in by_sensor:
        table.add_column(plain(name), justify="right")
    sizes = [
        {each.fault: size_words(each.size, each.unit) for each in told_from_entries(found)}
        for found in by_sensor.values()
    ]
    for happens in dict.fromkeys(happens for found in sizes for happens in found):
        table.add_row(happens, *(found.get(happens, "–") for found in sizes))
    return table


def _name(step: Transfer | Rest) -> str:
    if isinstance(step, Rest) and step.for_temperature:
        return "wait"
    return "trial" if isinstance(step, Transfer) and step.tries else type(step).__name__.lower()


def _motion(step: Step) -> tuple[str, str, str]:
    if isinstance(step, (Rest, Dwell)):
        return "", "", ""
    turns = [
        f"{name} {math.degrees(start):+.1f} → {math.degrees(target):+.1f}"
        for name, start, target in zip(_names(step.start_q_rad), step.start_q_rad, step.target_q_rad, strict=True)
        if abs(target - start) > SAME_PLACE_RAD
    ]
    return "\n".join(turns), f"{math.degrees(step.speed_rad_s):g}", f"{math.degrees(step.acceleration_rad_s2):g}"


def _names(q_rad: Joints) -> Sequence[str]:
    """The names of joints as far as a plan tells them: an arm's, of others their numbers."""
    return JOINT_NAMES if len(q_rad) == len(JOINT_NAMES) else [f"joint {i + 1}" for i in range(len(q_rad))]

"""A turner unknown to the rig: a turntable of one joint, as a user's package adds it, and a procedure for it.

The table turns in virtual time, without waiting.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from math import pi, radians
from pathlib import Path

import numpy as np
from pydantic import Field

from rig.analysis.check import Check
from rig.analysis.outcome import Origin
from rig.config.section import Direction
from rig.data.meaning import Meaning
from rig.errors import Problem
from rig.motion.carried import FlangeLoad
from rig.motion.chain import DenavitHartenberg
from rig.motion.state_rows import StateField
from rig.motion.steps import Motion, progress, travel
from rig.motion.turner_state import Joints, Row, TurnerIdentity
from rig.observation.observed_run import observe_runs
from rig.procedure import (
    Outcome,
    Plan,
    Procedure,
    ProcedureSection,
    Rest,
    RunData,
    Step,
    Sweep,
    Transfer,
    TurnerSection,
    Verbs,
    trapezoid_duration,
)
from rig.turners.turner_kind import OnState, TurnerKind, Wording

JOINTS = ("table",)
GEOMETRY = DenavitHartenberg(theta_rad=(0.0,), a_m=(0.0,), d_m=(0.2,), alpha_rad=(0.0,))
STEP_S, FASTEST_RAD_S, ACCELERATION_RAD_S2 = 0.008, 6.0, 4.0


class TurntableSection(TurnerSection):
    """A turntable."""

    serial_port: str = Field(description="where it is connected")
    state_step_s: float = Field(default=STEP_S, gt=0, description="time between two states")

    @property
    def address(self) -> str:
        """Its port."""
        return self.serial_port


@dataclass(frozen=True, slots=True)
class TableState:
    """A `State` that also contains the motor's current."""

    time_s: float
    host_time_s: float
    q_rad: Joints
    qd_rad_s: Joints
    current_a: float

    def to_record(self) -> Row:
        """Return the values in their order."""
        return self.time_s, self.host_time_s, self.q_rad, self.qd_rad_s, self.current_a

    @property
    def at_rest(self) -> bool:
        """Whether the table stands."""
        return self.qd_rad_s == (0.0,)


@dataclass(frozen=True, slots=True)
class TableReport:
    """A `Report` of a table."""

    host: str
    state: TableState
    serial_number: str = "T-7"
    software: str = "1.0"
    model: str | None = "T1"
    kinematics: DenavitHartenberg | None = GEOMETRY
    joints: tuple[str, ...] = JOINTS

    @property
    def words(self) -> str:
        """The report in a line of text."""
        return f"Toys T1, serial number {self.serial_number}"


class Turntable:
    """A `Turner`. Its time is counted, not waited for."""

    missed_states = 0

    def __init__(self, section: TurntableSection, on_state: OnState) -> None:
        self._section, self._on_state = section, on_state
        self._time_s, self.latest = 100.0, TableState(100.0, 1e4, (0.0,), (0.0,), 0.0)
        self._held = False

    def report(self) -> TableReport:
        """Return the state of the table."""
        return TableReport(self._section.serial_port, self.latest)

    def check(self) -> None:
        """Check nothing, because the table has no faults."""

    def take_control(self, carried: FlangeLoad) -> None:
        """Return at once, because the table is always ready."""
        self._held = True

    def move(self, motion: Motion, watch: Callable[[], None] = lambda: None) -> None:
        """Turn to the end of the motion."""
        assert self._held
        begin_s, start, (travel_rad,) = (
            self._time_s,
            self.latest.q_rad[0],
            travel(self.latest.q_rad, motion.target_q_rad),
        )
        steps = np.arange(STEP_S, motion.duration_s + STEP_S, STEP_S)
        for since_s, share in zip(steps.tolist(), progress(motion, steps).tolist(), strict=True):
            self._tell(begin_s + since_s, start + share * travel_rad)
            watch()
        self._tell(self._time_s + STEP_S, motion.target_q_rad[0])

    def rest(self, duration_s: float, watch: Callable[[], None] = lambda: None) -> None:
        """Stand still."""
        for _ in range(round(duration_s / STEP_S)):
            self._tell(self._time_s + STEP_S, self.latest.q_rad[0])
            watch()

    def _tell(self, time_s: float, angle_rad: float) -> None:
        speed = (angle_rad - self.latest.q_rad[0]) / STEP_S
        self._time_s = time_s
        self.latest = TableState(time_s, time_s + 1e4, (angle_rad,), (speed,), 0.1 * abs(speed))
        self._on_state(self.latest)


@contextmanager
def connect(section: TurntableSection, on_state: OnState, log: Path) -> Iterator[Turntable]:
    """Yield the table, which stands still at the end."""
    yield Turntable(section, on_state)


def look(section: TurntableSection) -> TableReport:
    """Return the state of the table."""
    return Turntable(section, lambda state: None).report()


def problems(plans: Sequence[Plan], section: TurntableSection, report: TableReport | None) -> list[Problem]:
    """Return the motions that are too fast for the table."""
    fast = {motion.name for plan in plans for motion in plan.motions if motion.speed_rad_s > FASTEST_RAD_S}
    return [Problem("joint_speed", f"{name} is too fast for the table", "Turn more slowly") for name in sorted(fast)]


KIND = TurnerKind(
    name="turntable",
    section=TurntableSection,
    connect=connect,
    look=look,
    stance=lambda report: f"table at {report.state.q_rad[0]:.2f} rad",
    problems=problems,
    describe_configured=lambda section: TurnerIdentity("Toys", None, GEOMETRY),
    describe_connected=lambda section, report: TurnerIdentity("Toys", report.model, GEOMETRY),
    carried=lambda section: FlangeLoad(0.0),
    words=Wording(
        name="turntable",
        short="table",
        turned="it",
        method="A turntable turns the items about its axis",
        briefly="turns on a turntable",
        directions="how the table is made",
    ),
    fields=(StateField("current_a", "f4"),),
)


class OneAxisSection(ProcedureSection):
    """The section of a procedure about the table's axis."""

    speed_deg_s: float = Field(default=60.0, gt=0)


def plan(
    table: TurntableSection, procedure: OneAxisSection, start_q_rad: Joints | None = None, done: Collection[int] = ()
) -> Plan:
    """Plan a turn either way with a rest before each."""
    steps: list[Step] = []
    pose, speed = start_q_rad or (0.0,), radians(procedure.speed_deg_s)
    half_travel, rates = pi + speed**2 / ACCELERATION_RAD_S2, (speed, ACCELERATION_RAD_S2)
    directions: tuple[tuple[Direction, int], ...] = (("ccw", 1), ("cw", -1))
    for index, (direction, sign) in enumerate(directions):
        start, end = (-sign * half_travel,), (sign * half_travel,)
        if pose != start:
            takes_s = trapezoid_duration(abs(start[0] - pose[0]), *rates)
            steps.append(Transfer("way to the start", pose, start, *rates, takes_s))
        steps.append(Rest("rest", 2.0))
        takes_s, axis = trapezoid_duration(2 * half_travel, *rates), (0.0, 0.0, float(sign))
        steps.append(Sweep(index, 0, "table", direction, axis, start, end, *rates, takes_s, (-pi, pi)))
        pose = end
    home = Transfer("way home", pose, (0.0,), *rates, trapezoid_duration(abs(pose[0]), *rates))
    return Plan((*steps, home), start_q_rad or (0.0,), (0.0,))


def carry_out(rig: Verbs) -> None:
    """Carry out the plan, step by step."""
    for step in rig.plan.steps:
        match step:
            case Rest():
                rig.rest(step)
            case Sweep():
                rig.sweep(step)
            case Transfer():
                rig.move(step)


def analyse(runs: Sequence[RunData], before: Outcome | None, estimator: str) -> Outcome:
    """Check whether the gyroscope reads the table's speed along z to a tenth."""
    recordings = observe_runs(runs)
    turns = [turn for recording in recordings for turn in recording.sensors["gyro"].revolutions]
    error = max(abs(turn.axis_flange[2] * turn.average.mean_rad_s[2] / turn.speed_rad_s - 1) for turn in turns)
    check = Check("gyro.speed", float(error), 0.1, "1", Meaning(kind="fitness"))
    origin = Origin(runs[0].provenance, {}, (), (), datetime.now(UTC))
    return Outcome(settings=runs[0].settings, provenance=origin, recordings=recordings, checks=(check,))


PROCEDURE = Procedure(
    name="one_axis", section=OneAxisSection, plan=plan, script=carry_out, analyse=analyse, turner=TurntableSection
)

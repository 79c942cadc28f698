"""The verbs a procedure script is written in.

A script receives an open `Rig` and says what to do, in order. Every verb is supervised: while the arm moves or rests
the board is watched, and whatever ends a verb early (an error, Ctrl-C, a lost link) stops the arm first and is reported
then.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from math import degrees, radians

from firmware_host.client import Board
from rig.arm.driver import Arm
from rig.arm.motion import Plan, Rest, Step, Sweep, Transfer, travel
from rig.arm.preflight import arm_problems, plan_problems, refuse, way_to_home
from rig.arm.state import JOINT_NAMES, ArmReport
from rig.config.models import ArmSection
from rig.data.run_file import RunRecorder
from rig.errors import Fault, Refused
from rig.runner.acquisition import Monitor
from rig.runner.onboard import BoardCalibration
from rig.station.view import Status, View

Confirm = Callable[[Sequence[str]], bool]
FIRST_SAMPLE_TIMEOUT_S = 2.0
SAME_POSE_RAD = radians(1)  # what was announced and agreed to still holds


@dataclass(slots=True)
class Rig:
    """An arm and a board, connected and recorded. Scripts call the verbs; `plan` says what the arm will do.

    `whole_plan` is the plan of the whole procedure: the same as `plan`, or more when an interrupted run goes on.
    `calibrated` are the board's indices of the sensors that stream calibrated readings; `on_board` is there when the
    board calibrates along; `again` says that the whole movement is to follow once more, and `announced` that this is
    that time, to which the operator has agreed already.
    """

    plan: Plan
    whole_plan: Plan
    report: ArmReport
    payload: ArmSection
    arm: Arm
    board: Board
    recorder: RunRecorder
    monitor: Monitor
    view: View
    confirm: Confirm
    calibrated: tuple[int, ...] = ()
    on_board: BoardCalibration | None = None
    again: bool = False
    announced: bool = False
    _done_s: float = 0.0  # planned duration of the steps behind us
    _step_started_s: float = 0.0  # controller time

    def preflight(self) -> None:
        """Check all that must be right before the arm moves, ask the operator, and take control of the arm.

        A movement that was announced before begins without asking, unless the arm no longer stands where it was left.
        Raises `Refused` naming every problem found; nothing has moved then.
        """
        refuse([*plan_problems(self.whole_plan, self.payload.payload_kg), *arm_problems(self.plan, self.report)])
        self.view.line(
            f"pre-flight: arm {self.report.serial_number} at {self.report.host} is ready; "
            f"{len(self.plan.motions)} motions within limits, {self.plan.duration_s:.0f} s"
        )
        away_rad = max(map(abs, way_to_home(self.plan, self.report.state.q_rad)))
        if not (self.announced and away_rad <= SAME_POSE_RAD) and not self.confirm(self._announcement()):
            raise Refused("not_confirmed", "nobody agreed to the movement", "Run again and agree, or give --yes")
        moved_rad = max(map(abs, travel(self.plan.start_q_rad, self.arm.latest.q_rad)))
        if moved_rad > SAME_POSE_RAD:
            raise Refused(
                "arm_moved",
                f"the arm at {self.report.host} has moved by {degrees(moved_rad):.1f}° since its way was announced",
                "Keep others off the arm and run again",
            )
        x, y, z = (millimetres / 1000 for millimetres in self.payload.payload_centre_mm)
        self.arm.take_control(self.payload.payload_kg, (x, y, z))

    def _announcement(self) -> list[str]:
        """What an operator must know before agreeing: the first motion depends on where the arm stands."""
        way = way_to_home(self.plan, self.report.state.q_rad)
        turns = ", ".join(
            f"{name} {degrees(angle):+.0f}°" for name, angle in zip(JOINT_NAMES, way, strict=True) if abs(angle) > 0.01
        )
        lines = [
            f"The arm at {self.report.host} will move for {self.plan.duration_s:.0f} s.",
            f"First it goes home: {turns or 'it is there already'}.",
        ]
        if self.plan.sweeps:
            lines.append(f"Then {len(self.plan.sweeps)} sweeps turn the wrists by more than a whole turn each.")
        if self.again:
            lines.append(
                "If the calibration passes, the board stores it in the place of what it had, and without another "
                f"question {len(self.whole_plan.sweeps)} sweeps follow to verify it, for "
                f"{self.whole_plan.duration_s:.0f} s."
            )
        return [
            *lines,
            "Nobody and nothing may be within its reach; the sensor's cable needs slack for a whole turn either way.",
        ]

    def start_sampling(self) -> None:
        """Let the board stream; from here on every sample is recorded. Raises `Fault` when a sensor stays silent."""
        if self.on_board is not None:
            self.on_board.begin()
        self.board.start(self.calibrated)
        host_s, arm_s = time.monotonic(), self.arm.latest.time_s
        while silent := self.monitor.silent():
            self.board.check()
            self.arm.check()
            # By both clocks: this machine may be busy, and the controller's clock another's to run.
            if min(time.monotonic() - host_s, self.arm.latest.time_s - arm_s) > FIRST_SAMPLE_TIMEOUT_S:
                raise Fault(
                    "no_samples",
                    f"no sample from {', '.join(silent)} within {FIRST_SAMPLE_TIMEOUT_S:g} s of the start",
                    "Check the sensor's wiring and its data-ready line, then run `rig check`",
                )
            time.sleep(0.005)
        self.view.line("sampling: every sensor delivers")

    def move(self, transfer: Transfer) -> None:
        """Bring the arm to where the next sweep starts, or home."""
        with self._step(transfer):
            self.arm.move(transfer, lambda: self._watch(transfer))

    def sweep(self, sweep: Sweep) -> None:
        """Turn one wrist through a whole revolution at constant speed and note when it began and ended.

        Afterwards the board averages the revolution as well, when it calibrates along.
        """
        if self.on_board is not None:
            self.on_board.keep(sweep)
        with self._step(sweep):
            self.recorder.add_event("sweep_started", sweep=asdict(sweep))
            self.arm.move(sweep, lambda: self._watch(sweep))
            self.recorder.add_event("sweep_finished", sweep=asdict(sweep))
            if self.on_board is not None:
                self.on_board.observe(sweep)

    def rest(self, rest: Rest) -> None:
        """Stand still: the readings here show the bias and the noise."""
        with self._step(rest):
            self.recorder.add_event("rest_started")
            self.arm.rest(rest.duration_s, lambda: self._watch(rest))
            self.recorder.add_event("rest_finished")

    def solve_on_board(self) -> None:
        """Let the board compute its own calibration from what it has averaged; it stands beside the host's."""
        if self.on_board is not None:
            self.on_board.solve()

    def summary(self) -> str:
        """What was recorded and what was missed, in one line."""
        samples, lost, _ = self.monitor.totals()
        return f"recorded: {samples} samples, {lost} lost; {self.arm.missed_states} arm states missed"

    @contextmanager
    def _step(self, step: Step) -> Iterator[None]:
        self._step_started_s = self.arm.latest.time_s
        yield
        self._done_s += step.duration_s
        self.view.line(f"done: {step.name}, {self.arm.latest.time_s - self._step_started_s:.2f} s")

    def _watch(self, step: Step) -> None:
        """Called many times a second while the arm is busy: look after board and recording, tell the operator."""
        self.board.check()
        self.recorder.check()
        state = self.arm.latest
        within_s = min(state.time_s - self._step_started_s, step.duration_s)
        samples, lost, rate_rad_s = self.monitor.totals()
        self.view.show(
            Status(
                step=step.name,
                fraction=within_s / step.duration_s,
                elapsed_s=self._done_s + within_s,
                remaining_s=self.plan.duration_s - self._done_s - within_s,
                arm_speed_rad_s=max(map(abs, state.qd_rad_s)),
                samples=samples,
                lost=lost,
                rate_rad_s=rate_rad_s,
            )
        )

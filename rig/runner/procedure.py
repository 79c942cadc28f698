"""Carries out the verbs of a script (`rig.plans.verbs`).

Every verb is supervised: while the arm moves or rests the board and the recording are watched, and whatever ends a verb
early (an error, Ctrl-C, a lost link) stops the arm first and is reported then.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import degrees, radians

import numpy as np

from rig.config.models import TurnerSection
from rig.config.section import Vector3
from rig.data.quantity import RATE
from rig.data.recording.events import (
    DwellFinished,
    DwellStarted,
    Event,
    RestFinished,
    RestStarted,
    SweepFinished,
    SweepStarted,
)
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_file import RunRecorder
from rig.errors import Fault, Refused, refuse
from rig.estimation.arrays import Array
from rig.motion.geometry import DenavitHartenberg, flange_attitude, flange_axes
from rig.motion.preflight import find_travel_to_home
from rig.motion.state import Report
from rig.motion.steps import Dwell, Motion, Plan, Rest, Stage, Step, Sweep, Transfer, travel
from rig.plans.phase import Phase
from rig.runner.acquisition import Acquisition
from rig.runner.announcement import announcement
from rig.runner.board.onboard import BoardCalibration
from rig.runner.by_hand.session import HandSession
from rig.runner.ending_early import EndingEarly
from rig.runner.first_samples import FirstSamples
from rig.runner.mounted import Mounted, ask_of_other_boards
from rig.runner.mounting import (
    REST_S,
    Felt,
    refuse_hanging_otherwise,
    refuse_turning_otherwise,
    refuse_unsteady,
)
from rig.runner.warming import Warming, range_not_reached
from rig.sensors.source import SampleSource
from rig.station.confirm import NOT_AGREED
from rig.station.events import (
    ArmSeen,
    PhaseRecorded,
    PreflightPassed,
    Progress,
    SamplesTaken,
    SamplingStarted,
    StepFinished,
    StepStarted,
)
from rig.station.station import Station
from rig.turners.kind import AnyTurner
from rig.turners.turner import Turner

FIRST_SAMPLES_LOOK_S = 0.005  # between two looks whether every sensor has sent something
LOOK_S = 60.0  # to solve what is recorded so far
SETTLING_LOOK_S = 0.05  # between two questions whether the sensors have settled
AT_REST_TIMEOUT_S = 10.0  # for the readings that tell how they scatter before anything has moved
TRIAL_REST_S = 0.3  # of readings after a trial of the mounting, by which it has ended for the sensors too
SAME_POSE_RAD = radians(1)  # what was announced and agreed to still holds


@dataclass(frozen=True, slots=True)
class Devices:
    """What is connected.

    `turner` turns the sensors; `report` is how it stood, `kind` what it is, `section` how it is configured; `sources`
    are where samples come from, those of the sensors that are `mounted`.
    """

    turner: Turner
    report: Report
    kind: AnyTurner
    section: TurnerSection
    sources: tuple[SampleSource, ...]
    acquisition: Acquisition
    mounted: Mounted


@dataclass(frozen=True, slots=True)
class Recording:
    """Where everything goes, and what of: `sensors` by name, and how what turns them is built.

    What happens is told at the `station` as well.
    """

    recorder: RunRecorder
    sensors: Mapping[str, RecordedSensor]
    station: Station
    geometry: DenavitHartenberg

    def note(self, event: Event) -> None:
        """Record what happens, and tell it."""
        self.recorder.add(event)
        self.station.event(event)

    def check(self) -> None:
        """Raise Fault `recording_failed`, or `run_folder_removed` when the file is no longer in its place."""
        self.recorder.check()
        if self.recorder.removed:
            raise Fault(
                "run_folder_removed",
                f"{self.recorder.path} was removed or moved away while it was recorded",
                "Start a new run, and leave its folder in its place until the run has ended",
            )


@dataclass(slots=True)
class Rig:
    """The verbs of one phase.

    `whole_plan` is the same as `plan`, or more when an interrupted run goes on or the item is mounted in stages: this
    one has the number `stage`, from 0, and is the `last` or not; `along` is there when the board calibrates along,
    `hand` where an operator's turns the item, `warming` where its temperature is to change, and `up` is that direction
    in the frame of the arm's base. Where there is an `early` end, all that follows it is passed over but a way home.
    """

    devices: Devices
    plan: Plan
    whole_plan: Plan
    recording: Recording
    along: BoardCalibration | None
    phase: Phase
    hand: HandSession | None = None
    stage: int = 0
    last: bool = True
    up: Vector3 = (0.0, 0.0, 1.0)
    early: EndingEarly | None = None
    warming: Warming | None = None
    _made: set[int] = field(default_factory=set)  # sweeps and dwells since the latest wait for a temperature
    _resting_rad_s: dict[str, Array] = field(default_factory=dict)  # of each gyroscope, before anything moved
    _motions: Iterator[Motion] | None = None  # the plan's, those to come; None before pre-flight
    _number: int = 0  # of the step that goes on, or the last one
    _done_s: float = 0.0  # planned duration of the steps behind us
    _step_started_s: float = 0.0  # controller time

    def preflight(self) -> None:
        """Check all that must be right before the arm moves, ask the operator, and take control of the arm.

        A movement that was agreed to before begins without asking, unless the arm no longer stands where it was left.
        Raises `Refused` naming every problem found; nothing has moved then.
        """
        report, kind, section = self.devices.report, self.devices.kind, self.devices.section
        refuse(kind.problems([self.whole_plan, self.plan], section, report))
        if self.warming is not None:
            self.warming.prepare()
        self.recording.station.event(PreflightPassed(self.plan, report, kind.words.short))
        if self.hand is not None:
            self._motions = iter(())
            return  # nothing moves by itself, so nothing is asked before
        away_rad = max(map(abs, find_travel_to_home(self.plan, report.state.q_rad)), default=0.0)
        if not (self.phase.agreed and away_rad <= SAME_POSE_RAD):
            self._agree()
        self._refuse_moved()
        self.devices.turner.take_control(kind.carried(section))
        self._motions = iter(self.plan.motions)

    def _agree(self) -> None:
        devices, station = self.devices, self.recording.station
        ask_of_other_boards(devices.mounted, station)
        repeated = self.whole_plan if self.phase.follows else None
        told = self.plan, devices.report, devices.kind.words, repeated, devices.mounted.lines()
        said = announcement(*told, early=self.early is not None)
        if not station.ask(said):
            raise Refused("not_confirmed", "nobody agreed to the movement", NOT_AGREED)

    def _refuse_moved(self) -> None:
        """Refuse an arm that somebody moved while the operator thought: it would take another way than announced."""
        moved_rad = max(map(abs, travel(self.plan.start_q_rad, self.devices.turner.latest.q_rad)), default=0.0)
        if moved_rad > SAME_POSE_RAD:
            raise Refused(
                "arm_moved",
                f"the arm at {self.devices.report.host} has moved by {degrees(moved_rad):.1f}° since the program "
                "announced its way",
                "Make sure that nobody else moves the arm, then run again",
            )

    def start_sampling(self) -> None:
        """Let every source stream; from here on every sample is recorded. Raises `Fault` for a silent sensor."""
        sources, turner = self.devices.sources, self.devices.turner
        if self.along is not None:
            self.along.begin()
        for source in sources:
            source.start()
        first_samples = FirstSamples(FIRST_SAMPLES_LOOK_S)
        while silent := self.devices.acquisition.silent():
            self._check()
            turner.check()
            first_samples.wait_on(silent, turner.latest.time_s)
            time.sleep(FIRST_SAMPLES_LOOK_S)
        if self.whole_plan.dwells:
            self._wait(self.devices.acquisition.settling.learned, AT_REST_TIMEOUT_S, self._check)
        if self.whole_plan.stages:
            self._look_at_the_mounting(self.whole_plan.stages[self.stage])
        self.recording.station.event(SamplingStarted())

    def _look_at_the_mounting(self, stage: Stage) -> None:
        """Refuse an item that is not at rest, or that hangs otherwise than the stage says."""
        self.devices.acquisition.keep()
        state = self.devices.turner.latest
        up = flange_attitude(np.array(state.q_rad), self.recording.geometry) @ np.array(self.up)
        for felt in self._felt(REST_S, self._check):
            refuse_unsteady(felt, self.devices.kind.words.short)
            refuse_hanging_otherwise(felt, stage, up)
            self._resting_rad_s[felt.name] = felt.rates_rad_s.mean(axis=0)

    def _felt(self, lasting_s: float, watch: Callable[[], None]) -> list[Felt]:
        """What all gyroscopes have read since the latest `keep`, once that is so long by the clock of each."""
        acquisition = self.devices.acquisition
        sensors = {name: each for name, each in self.recording.sensors.items() if each.measures(RATE)}

        def long_enough() -> bool:
            return all(_span_s(acquisition.newest(name)) >= lasting_s for name in sensors)

        if not self._wait(long_enough, lasting_s + AT_REST_TIMEOUT_S, watch):
            raise Fault(
                "no_samples", f"in {lasting_s:g} s too few samples arrived", "Check the cables, then run `rig check`"
            )
        return [Felt(name, sensor, acquisition.newest(name)) for name, sensor in sensors.items()]

    def _try_the_mounting(self, trial: Transfer, took_s: float) -> None:
        """End the run where the sensors do not feel a trial's turn as the stage says."""
        turned = np.array(travel(trial.start_q_rad, trial.target_q_rad))
        axes = flange_axes(np.array(trial.start_q_rad), self.recording.geometry)
        for felt in self._felt(took_s + TRIAL_REST_S, lambda: self._watch(trial)):
            stage, resting_rad_s = self.whole_plan.stages[self.stage], self._resting_rad_s[felt.name]
            refuse_turning_otherwise(felt, resting_rad_s, stage, axes @ turned, trial.name)

    def move(self, transfer: Transfer) -> None:
        """Bring the arm to where the next sweep starts, or home. Raises `unplanned_motion`."""
        self._refuse_unplanned(transfer)
        if self._passed_over(transfer):
            return
        if transfer.tries:
            self.devices.acquisition.keep()
        with self._step(transfer):
            began_s = self.devices.turner.latest.time_s
            self.devices.turner.move(transfer, lambda: self._watch(transfer))
            if transfer.tries:
                self._try_the_mounting(transfer, self.devices.turner.latest.time_s - began_s)

    def sweep(self, sweep: Sweep) -> None:
        """Turn one wrist through a whole revolution, or an arc, at constant speed and note when it began and ended.

        Afterwards, while the arm stands still, the board averages it as well when it calibrates along.
        Raises `unplanned_motion`.
        """
        self._refuse_unplanned(sweep)
        if self._passed_over(sweep):
            return
        if self.along is not None:
            self.along.keep(sweep)
        with self._step(sweep, then=lambda: self._observe(sweep)):
            self.recording.note(SweepStarted(sweep))
            self.devices.turner.move(sweep, lambda: self._watch(sweep))
            self.recording.note(SweepFinished(sweep))
        if self.early is not None:
            self.early.swept(sweep)
        self._made.add(sweep.index)

    def _refuse_unplanned(self, motion: Motion) -> None:
        """Pre-flight has judged the plan's motions, one from the end of the other: nobody has looked at other ways."""
        what = f"the script orders {motion.name}"
        remedy = "Let the script make the motions of `plan.steps`, each once, in their order, after `preflight()`"
        if self._motions is None:
            raise Refused("unplanned_motion", f"{what} before pre-flight", remedy)
        due = next(self._motions, None)
        if motion != due:
            planned = "no motion is left" if due is None else f"{due.name} comes next"
            raise Fault("unplanned_motion", f"{what}, but in the plan that passed pre-flight {planned}", remedy)

    def _passed_over(self, motion: Motion) -> bool:
        """Whether a motion is not made, because what is wanted is reached; looks whether it is, after a repeat."""
        if self.early is None:
            return False
        if self.early.due():
            turner = self.devices.turner
            host_s, turner_s = time.monotonic(), turner.latest.time_s
            with self.early.looking() as looked:
                # By both clocks: this computer may be busy, and the controller's clock may be simulated.
                while not looked.done() and min(time.monotonic() - host_s, turner.latest.time_s - turner_s) < LOOK_S:
                    turner.rest(SETTLING_LOOK_S, self._check)
                said = self.early.found(looked)
            if said is not None:
                self.recording.station.event(said)
        return self.early.passes_over(motion)

    def _observe(self, sweep: Sweep) -> None:
        """Let the board average the sweep. What it is told takes seconds to find; a heater is spoken to meanwhile."""
        if self.along is None:
            return
        if self.warming is None:
            found = self.along.revolutions(sweep)
        else:
            with self.along.looking(sweep) as looked:
                while not looked.done():
                    self.devices.turner.rest(SETTLING_LOOK_S, self._check)
            found = looked.result()
        self.along.observe(sweep, found)

    def rest(self, rest: Rest) -> None:
        """Stand still: the readings here show the bias and the noise."""
        if self.early is not None and self.early.ended:
            return
        with self._step(rest):
            self.recording.note(RestStarted())
            self.devices.turner.rest(rest.duration_s, lambda: self._watch(rest))
            self.recording.note(RestFinished())

    def dwell(self, dwell: Dwell) -> None:
        """Stand still in an attitude until the sensors have settled, then measure. Raises Fault `not_settled`."""
        with self._step(dwell):
            settling = self.devices.acquisition.settling
            settling.begin()
            if not self._wait(lambda: not settling.unsettled(), dwell.settle_s, lambda: self._watch(dwell)):
                raise _not_settled(dwell, settling.unsettled())
            self.recording.note(DwellStarted(dwell))
            with self.devices.acquisition.standing():
                self.devices.turner.rest(dwell.duration_s, lambda: self._watch(dwell))
            self.recording.note(DwellFinished(dwell))
        self._made.add(dwell.index)

    def _wait(self, until: Callable[[], bool], at_most_s: float, watch: Callable[[], None]) -> bool:
        """Stand still until something is so; False when it was not within so much of the controller's time."""
        turner = self.devices.turner
        began_s = turner.latest.time_s
        while not until():
            if turner.latest.time_s - began_s > at_most_s:
                return False
            turner.rest(SETTLING_LOOK_S, watch)
        return True

    def wait_for_next_temperature(self, rest: Rest) -> bool:
        """Stand still until the sensors are as warm as the next set wants them; False where the range is covered.

        Raises Refused `other_turner` where the procedure has no temperatures, Fault `range_not_reached`.
        """
        warming = self._temperatures()
        self._end_set()
        missing = warming.wanted()
        if missing is None:
            return False
        with self._step(rest):
            warming.begin_waiting()
            at_most_s = 60 * warming.section.timeout_min
            with self.devices.acquisition.standing():
                due = self._wait(lambda: warming.is_due, at_most_s, lambda: self._watch(rest))
            if not due:
                raise range_not_reached(
                    missing, f"in {warming.section.timeout_min:g} minutes the sensors did not become as warm as wanted"
                )
        warming.begin_set()
        return True

    def end_temperature_range(self) -> None:
        """Switch the heater off. Raises Fault `range_not_reached` where no set has covered a part of the range."""
        warming = self._temperatures()
        self._end_set()
        warming.stop_heating()
        missing = warming.wanted()
        if missing is not None:
            raise range_not_reached(missing, f"{warming.section.repeats} sets are made (procedure.repeats)")

    def _temperatures(self) -> Warming:
        if self.warming is None:
            raise Refused(
                "other_procedure",
                "the script waits for temperatures, and the procedure has none",
                "Use the section of the procedure thermal",
            )
        return self.warming

    def _end_set(self) -> None:
        """Count what was made since the latest wait."""
        if self.warming is not None and self._made:
            self.warming.end_set(min(self._made), max(self._made) + 1)
        self._made.clear()

    def turn_by_hand(self) -> None:
        """Let the operator lay the item down and turn it. Raises Refused `other_turner` where an arm is configured."""
        if self.hand is None:
            raise Refused(
                "other_turner",
                "the script lets a hand turn the item, and the procedure is none by hand",
                "Use the section of the procedure by_hand",
            )
        self.hand.carry_out(self._check_along)

    def _check_along(self) -> None:
        """Raise what has become of the board, and tell how many samples came."""
        self._check()
        self.recording.station.event(SamplesTaken(self.devices.acquisition.samples()))

    def solve_on_board(self) -> None:
        """Let the board compute its own calibration from what it has averaged; it stands beside the host's.

        From the sweeps of all stages, after the last one: it knows speeds alone, whatever the item turns about.
        """
        if self.along is not None and self.last:
            self.along.solve()

    def readings(self) -> dict[str, str]:
        """What every sensor streams, "raw" or "calibrated", by its name."""
        return {name: sensor.mode for name, sensor in self.recording.sensors.items()}

    def recorded(self) -> PhaseRecorded:
        """What was recorded and what was missed."""
        return PhaseRecorded(self.devices.acquisition.samples(), self.devices.turner.missed_states)

    @contextmanager
    def _step(self, step: Step, then: Callable[[], None] = lambda: None) -> Iterator[None]:
        """One step from its first event to its last; what happens `then` belongs to it, but not to its time."""
        self._number += 1
        place = self._number, len(self.plan.steps), step
        turner = self.devices.turner
        self._step_started_s = turner.latest.time_s
        self.recording.station.event(StepStarted(*place))
        yield
        took_s = turner.latest.time_s - self._step_started_s
        then()
        self._done_s += step.duration_s
        self.recording.station.event(StepFinished(*place, took_s))

    def _check(self) -> None:
        """Raise what has become of the sources or the recording."""
        for source in self.devices.sources:
            source.check(self.devices.turner.latest.time_s)
        self.recording.check()
        if self.warming is not None:
            self.warming.check(self.devices.turner.latest.time_s)

    def _watch(self, step: Step) -> None:
        """Look, many times a second while the arm is busy, after board and recording, tell the operator."""
        self._check()
        state = self.devices.turner.latest
        within_s = min(state.time_s - self._step_started_s, step.duration_s)
        # A script may make steps of its own, one that takes no time too.
        fraction = within_s / step.duration_s if step.duration_s > 0 else 1.0
        self.recording.station.event(SamplesTaken(self.devices.acquisition.samples()))
        self.recording.station.event(ArmSeen(state, self.devices.turner.missed_states))
        self.recording.station.event(
            Progress(
                number=self._number,
                count=len(self.plan.steps),
                step=step,
                fraction=fraction,
                elapsed_s=self._done_s + within_s,
                remaining_s=self.plan.duration_s - self._done_s - within_s,
                arm_speed_rad_s=max(map(abs, state.qd_rad_s), default=0.0),
            )
        )


def _span_s(samples: np.ndarray) -> float:
    """How long samples (n,) last by the clock that stamped them."""
    return float(np.ptp(samples["board_time_us"])) * 1e-6 if len(samples) else 0.0


def _not_settled(dwell: Dwell, unsettled: Mapping[str, float | None]) -> Fault:
    scatter = ", ".join(
        f"{name} has sent too little" if ratio is None else f"{name} scatters {ratio:.1f} times as much as at rest"
        for name, ratio in unsettled.items()
    )
    return Fault(
        "not_settled",
        f"{dwell.settle_s:g} s after the arm came to {dwell.name} the sensors have not settled: {scatter}",
        "Fix board and holder more stiffly, fasten the cable so that it does not swing, keep the table "
        "still, then resume",
    )

"""The implementation of the methods that a script calls (`rig.plans.verbs`).

During every call the board and the recording are supervised. An early end (an error, Ctrl-C, a lost link) first stops
the arm and is then reported.
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
from rig.data.recording.recorded_events import (
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
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import flange_attitude, flange_axes
from rig.motion.preflight import find_travel_to_home
from rig.motion.steps import Dwell, Motion, Plan, Rest, Stage, Step, Sweep, Transfer, travel
from rig.motion.turner_state import Report
from rig.plans.phase import Phase
from rig.runner.acquisition import Acquisition
from rig.runner.announcement import announcement
from rig.runner.board.onboard import BoardCalibration
from rig.runner.by_hand.hand_session import HandSession
from rig.runner.ending_early import EndingEarly
from rig.runner.first_samples import FirstSamples
from rig.runner.mounted_sensors import Mounted, ask_of_other_boards
from rig.runner.mounting import (
    REST_S,
    GyroscopeReadings,
    refuse_hanging_otherwise,
    refuse_turning_otherwise,
    refuse_unsteady,
)
from rig.runner.warming import Warming, range_not_reached
from rig.sensors.sample_source import SampleSource
from rig.station.confirm import AGREEMENT_REMEDY
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
from rig.station.operator_station import Station
from rig.turners.turner import Turner
from rig.turners.turner_kind import AnyTurner

FIRST_SAMPLES_POLL_S = 0.005  # checks whether every sensor has sent something
SOLVING_S = 60.0  # longest, for the present recording
SETTLING_POLL_S = 0.05  # checks whether the sensors have settled
AT_REST_TIMEOUT_S = 10.0  # time for the readings whose scatter at rest is measured
TRIAL_REST_S = 0.3  # wait after a trial of the mounting, because the sensors lag
MAX_POSE_DIFFERENCE_RAD = radians(1)  # to the pose for which the operator's agreement is valid


@dataclass(frozen=True, slots=True)
class Devices:
    """The connected devices.

    - `turner`: the device that turns the sensors, with its `kind`, its configuration (`section`) and its `report` at
      the connection.
    - `sources`: deliver the samples.
    - `mounted`: the sensors with their earlier calibrations.
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
    """The recording, with its `sensors` by name and the turner's geometry; its events go to the `station` as well."""

    recorder: RunRecorder
    sensors: Mapping[str, RecordedSensor]
    station: Station
    geometry: DenavitHartenberg

    def note(self, event: Event) -> None:
        """Record an event, and report it to the station."""
        self.recorder.add(event)
        self.station.event(event)

    def check(self) -> None:
        """Raise Fault `recording_failed`, or `run_folder_removed` if the file is no longer at its path."""
        self.recorder.check()
        if self.recorder.removed:
            raise Fault(
                "run_folder_removed",
                f"{self.recorder.path} was removed or moved away while it was recorded",
                "Start a new run, and leave its folder in its place until the run has ended",
            )


@dataclass(slots=True)
class Rig:
    """The methods that a script calls in one phase: moves, rests, sampling.

    - `plan`: the motions of this recording; `whole_plan`: also those done before an interruption or in other stages.
    - `stage`: the number of this stage, from 0; `last`: whether no stage follows.
    - `onboard`: the board's own calibration, if any.
    - `hand`: the session by hand, if any.
    - `up`: the vertical in the frame of the arm's base.
    - `early`: the condition to end early, if any.
    - `warming`: the supervision of the temperature, if any.
    """

    devices: Devices
    plan: Plan
    whole_plan: Plan
    recording: Recording
    onboard: BoardCalibration | None
    phase: Phase
    hand: HandSession | None = None
    stage: int = 0
    last: bool = True
    up: Vector3 = (0.0, 0.0, 1.0)
    early: EndingEarly | None = None
    warming: Warming | None = None
    _done: set[int] = field(default_factory=set)  # indices of sweeps and dwells since the latest wait for a temperature
    _resting_rad_s: dict[str, Array] = field(default_factory=dict)  # mean of each gyroscope before anything moved
    _motions: Iterator[Motion] | None = None  # the remaining motions of the plan; None before pre-flight
    _number: int = 0  # number of the present step, or of the last one
    _done_s: float = 0.0  # planned duration of the finished steps
    _step_started_s: float = 0.0  # by the controller's clock

    def preflight(self) -> None:
        """Check every condition of a movement, ask the operator, and take control of the arm.

        A movement to which the operator agreed in advance begins without a question, unless the arm has moved since.
        Raise Refused with all problems before anything moves.
        """
        report, kind, section = self.devices.report, self.devices.kind, self.devices.section
        refuse(kind.problems([self.whole_plan, self.plan], section, report))
        if self.warming is not None:
            self.warming.prepare()
        self.recording.station.event(PreflightPassed(self.plan, report, kind.words.short))
        self.recording.station.confirm_part()
        if self.hand is not None:
            ask_of_other_boards(self.devices.mounted, self.recording.station)
            self._motions = iter(())
            return  # nothing moves by itself, so the operator is not asked
        away_rad = max(map(abs, find_travel_to_home(self.plan, report.state.q_rad)), default=0.0)
        if not (self.phase.agreed and away_rad <= MAX_POSE_DIFFERENCE_RAD):
            self._agree()
        self._refuse_moved()
        self.devices.turner.take_control(kind.carried(section))
        self._motions = iter(self.plan.motions)

    def _agree(self) -> None:
        devices, station = self.devices, self.recording.station
        ask_of_other_boards(devices.mounted, station)
        repeated = self.whole_plan if self.phase.follows else None
        situation = self.plan, devices.report, devices.kind.words, repeated, devices.mounted.lines()
        question = announcement(*situation, early=self.early is not None)
        if not station.ask(question):
            raise Refused("not_confirmed", "nobody agreed to the movement", AGREEMENT_REMEDY)

    def _refuse_moved(self) -> None:
        """Raise Refused `arm_moved` if the arm was moved since the announcement, because its path would now differ."""
        moved_rad = max(map(abs, travel(self.plan.start_q_rad, self.devices.turner.latest.q_rad)), default=0.0)
        if moved_rad > MAX_POSE_DIFFERENCE_RAD:
            raise Refused(
                "arm_moved",
                f"the arm at {self.devices.report.host} has moved by {degrees(moved_rad):.1f}° since the program "
                "announced its way",
                "Make sure that nobody else moves the arm, then run again",
            )

    def start_sampling(self) -> None:
        """Start every source; from now on every sample is recorded. Raise `Fault` for a silent sensor."""
        sources, turner = self.devices.sources, self.devices.turner
        if self.onboard is not None:
            self.onboard.begin()
        for source in sources:
            source.start()
        first_samples = FirstSamples(FIRST_SAMPLES_POLL_S)
        while silent := self.devices.acquisition.find_silent():
            self._check()
            turner.check()
            first_samples.wait_on(silent, turner.latest.time_s)
            time.sleep(FIRST_SAMPLES_POLL_S)
        if self.whole_plan.dwells:
            self._wait(self.devices.acquisition.settling.learn_rest, AT_REST_TIMEOUT_S, self._check)
        if self.whole_plan.stages:
            self._look_at_the_mounting(self.whole_plan.stages[self.stage])
        self.recording.station.event(SamplingStarted())

    def _look_at_the_mounting(self, stage: Stage) -> None:
        """Raise Refused if the item is not at rest, or if its orientation contradicts the stage."""
        self.devices.acquisition.keep()
        state = self.devices.turner.latest
        up = flange_attitude(np.array(state.q_rad), self.recording.geometry) @ np.array(self.up)
        for readings in self._collect_readings(REST_S, self._check):
            refuse_unsteady(readings, self.devices.kind.words.short)
            refuse_hanging_otherwise(readings, stage, up)
            self._resting_rad_s[readings.name] = readings.rates_rad_s.mean(axis=0)

    def _collect_readings(self, lasting_s: float, watch: Callable[[], None]) -> list[GyroscopeReadings]:
        """Return the gyroscopes' readings since the latest `keep` once they span `lasting_s`. Raise `no_samples`."""
        acquisition = self.devices.acquisition
        sensors = {name: sensor for name, sensor in self.recording.sensors.items() if sensor.measures(RATE)}

        def long_enough() -> bool:
            return all(_span_s(acquisition.collect_newest(name)) >= lasting_s for name in sensors)

        if not self._wait(long_enough, lasting_s + AT_REST_TIMEOUT_S, watch):
            raise Fault(
                "no_samples", f"in {lasting_s:g} s too few samples arrived", "Check the cables, then run `rig check`"
            )
        return [GyroscopeReadings(name, sensor, acquisition.collect_newest(name)) for name, sensor in sensors.items()]

    def _try_the_mounting(self, trial: Transfer, took_s: float) -> None:
        """Raise Fault if the gyroscopes' readings in a trial motion contradict the stage's mounting."""
        turned = np.array(travel(trial.start_q_rad, trial.target_q_rad))
        axes = flange_axes(np.array(trial.start_q_rad), self.recording.geometry)
        for readings in self._collect_readings(took_s + TRIAL_REST_S, lambda: self._watch(trial)):
            stage, resting_rad_s = self.whole_plan.stages[self.stage], self._resting_rad_s[readings.name]
            refuse_turning_otherwise(readings, resting_rad_s, stage, axes @ turned, trial.name)

    def move(self, transfer: Transfer) -> None:
        """Move the arm to the start of the next sweep, or home. Raise `unplanned_motion`."""
        self._refuse_unplanned(transfer)
        if self._skips(transfer):
            return
        if transfer.tries:
            self.devices.acquisition.keep()
        with self._step(transfer):
            began_s = self.devices.turner.latest.time_s
            self.devices.turner.move(transfer, lambda: self._watch(transfer))
            if transfer.tries:
                self._try_the_mounting(transfer, self.devices.turner.latest.time_s - began_s)

    def sweep(self, sweep: Sweep) -> None:
        """Turn one joint through a revolution, or an arc, at constant speed, and record its start and end.

        Afterwards, while the arm is at rest, a board that calibrates itself averages the sweep's readings. Raise
        `unplanned_motion`.
        """
        self._refuse_unplanned(sweep)
        if self._skips(sweep):
            return
        if self.onboard is not None:
            self.onboard.keep(sweep)
        with self._step(sweep, then=lambda: self._observe(sweep)):
            self.recording.note(SweepStarted(sweep))
            self.devices.turner.move(sweep, lambda: self._watch(sweep))
            self.recording.note(SweepFinished(sweep))
        if self.early is not None:
            self.early.note_sweep(sweep)
        self._done.add(sweep.index)

    def _refuse_unplanned(self, motion: Motion) -> None:
        """Raise `unplanned_motion` unless the motion is the plan's next, as judged by pre-flight."""
        what = f"the script orders {motion.name}"
        remedy = "Let the script make the motions of `plan.steps`, each once, in their order, after `preflight()`"
        if self._motions is None:
            raise Refused("unplanned_motion", f"{what} before pre-flight", remedy)
        due = next(self._motions, None)
        if motion != due:
            planned = "no motion is left" if due is None else f"{due.name} comes next"
            raise Fault("unplanned_motion", f"{what}, but in the plan that passed pre-flight {planned}", remedy)

    def _skips(self, motion: Motion) -> bool:
        """Return whether to skip a motion because the target uncertainty, assessed after each repeat, is reached."""
        if self.early is None:
            return False
        if self.early.due():
            turner = self.devices.turner
            host_s, turner_s = time.monotonic(), turner.latest.time_s
            with self.early.look_in_background() as assessment:
                # By both clocks: this computer may be busy, and the controller's clock may be simulated.
                while (
                    not assessment.done()
                    and min(time.monotonic() - host_s, turner.latest.time_s - turner_s) < SOLVING_S
                ):
                    turner.rest(SETTLING_POLL_S, self._check)
                reached = self.early.conclude(assessment)
            if reached is not None:
                self.recording.station.event(reached)
        return self.early.skips(motion)

    def _observe(self, sweep: Sweep) -> None:
        """Let the board average the sweep's revolution.

        To compute when the revolution began and ended takes seconds; meanwhile a heater, if any, is controlled.
        """
        if self.onboard is None:
            return
        if self.warming is None:
            revolutions = self.onboard.revolutions(sweep)
        else:
            with self.onboard.look_in_background(sweep) as windows:
                while not windows.done():
                    self.devices.turner.rest(SETTLING_POLL_S, self._check)
            revolutions = windows.result()
        self.onboard.observe(sweep, revolutions)

    def rest(self, rest: Rest) -> None:
        """Stand still, to measure bias and noise."""
        if self.early is not None and self.early.ended:
            return
        with self._step(rest):
            self.recording.note(RestStarted())
            self.devices.turner.rest(rest.duration_s, lambda: self._watch(rest))
            self.recording.note(RestFinished())

    def dwell(self, dwell: Dwell) -> None:
        """Stand still in an attitude until the sensors have settled, then measure. Raise Fault `not_settled`."""
        with self._step(dwell):
            settling = self.devices.acquisition.settling
            settling.begin()
            if not self._wait(lambda: not settling.find_unsettled(), dwell.settle_s, lambda: self._watch(dwell)):
                raise _not_settled(dwell, settling.find_unsettled())
            self.recording.note(DwellStarted(dwell))
            with self.devices.acquisition.thin_states():
                self.devices.turner.rest(dwell.duration_s, lambda: self._watch(dwell))
            self.recording.note(DwellFinished(dwell))
        self._done.add(dwell.index)

    def _wait(self, until: Callable[[], bool], at_most_s: float, watch: Callable[[], None]) -> bool:
        """Stand still, calling `watch`, until `until()` is true; return False after `at_most_s` of controller time."""
        turner = self.devices.turner
        began_s = turner.latest.time_s
        while not until():
            if turner.latest.time_s - began_s > at_most_s:
                return False
            turner.rest(SETTLING_POLL_S, watch)
        return True

    def wait_for_next_temperature(self, rest: Rest) -> bool:
        """Stand still until the sensors have the next temperature for sweeps; return False if the range is covered.

        Raise Refused `other_procedure` if the procedure has no temperatures, Fault `range_not_reached`.
        """
        warming = self._temperatures()
        self._end_set()
        missing = warming.find_missing()
        if missing is None:
            return False
        with self._step(rest):
            warming.begin_waiting()
            at_most_s = 60 * warming.section.timeout_min
            with self.devices.acquisition.thin_states():
                due = self._wait(lambda: warming.is_due, at_most_s, lambda: self._watch(rest))
            if not due:
                raise range_not_reached(
                    missing,
                    f"in {warming.section.timeout_min:g} minutes the sensors did not reach the wanted temperature",
                )
        warming.begin_set()
        return True

    def end_temperature_range(self) -> None:
        """Switch the heater off. Raise Fault `range_not_reached` if a part of the range is not covered."""
        warming = self._temperatures()
        self._end_set()
        warming.stop_heating()
        missing = warming.find_missing()
        if missing is not None:
            raise range_not_reached(missing, f"{warming.section.repeats} sets are made (procedure.repeats)")

    def _temperatures(self) -> Warming:
        if self.warming is None:
            raise Refused(
                "other_procedure",
                "the script waits for temperatures, but the procedure has none",
                "Use the section of the procedure thermal",
            )
        return self.warming

    def _end_set(self) -> None:
        """End the sweeps and dwells at one temperature, which are those since the latest wait."""
        if self.warming is not None and self._done:
            self.warming.end_set(min(self._done), max(self._done) + 1)
        self._done.clear()

    def turn_by_hand(self) -> None:
        """Let the operator lay the item down and turn it. Raise Refused `other_turner` if an arm is configured."""
        if self.hand is None:
            raise Refused(
                "other_turner",
                "the script lets a hand turn the item, but the procedure is not one by hand",
                "Use the section of the procedure by_hand",
            )
        self.hand.carry_out(self._check_along)

    def _check_along(self) -> None:
        """Check the sources and the recording, and report the number of samples."""
        self._check()
        self.recording.station.event(SamplesTaken(self.devices.acquisition.samples()))

    def solve_on_board(self) -> None:
        """Let the board compute its own calibration from its averages, for comparison with the host's.

        The board does so only after the last stage, from the sweeps of all stages. It knows the speed of each sweep,
        but not the axis about which it turned.
        """
        if self.onboard is not None and self.last:
            self.onboard.solve()

    def readings(self) -> dict[str, str]:
        """Return each sensor's stream, "raw" or "calibrated", by name."""
        return {name: sensor.mode for name, sensor in self.recording.sensors.items()}

    def finish_sampling(self) -> PhaseRecorded:
        """Record the samples that have arrived by now; return the numbers of recorded and missed samples and states.

        On a busy computer, the samples of the last motion may still wait to be read when the arm is at rest.
        """
        for source in self.devices.sources:
            source.catch_up()
        return PhaseRecorded(self.devices.acquisition.samples(), self.devices.turner.missed_states)

    @contextmanager
    def _step(self, step: Step, then: Callable[[], None] = lambda: None) -> Iterator[None]:
        """Report the start and end of a step; call `then` before the end is reported, outside the reported duration."""
        self._number += 1
        position = self._number, len(self.plan.steps), step
        turner = self.devices.turner
        self._step_started_s = turner.latest.time_s
        self.recording.station.event(StepStarted(*position))
        yield
        took_s = turner.latest.time_s - self._step_started_s
        then()
        self._done_s += step.duration_s
        self.recording.station.event(StepFinished(*position, took_s))

    def _check(self) -> None:
        """Raise the error of a source, the recording or the temperature, if any."""
        for source in self.devices.sources:
            source.check(self.devices.turner.latest.time_s)
        self.recording.check()
        if self.warming is not None:
            self.warming.check(self.devices.turner.latest.time_s)

    def _watch(self, step: Step) -> None:
        """Check the sources and the recording, and report progress; it is called many times a second in a step."""
        self._check()
        state = self.devices.turner.latest
        within_s = min(state.time_s - self._step_started_s, step.duration_s)
        # A script may make steps of its own, even of zero duration.
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
    """Return the time between the first and the last of samples (n,), s, on the clock that stamped them."""
    return float(np.ptp(samples["board_time_us"])) * 1e-6 if len(samples) else 0.0


def _not_settled(dwell: Dwell, unsettled: Mapping[str, float | None]) -> Fault:
    scatter = ", ".join(
        f"{name} has sent too few samples" if ratio is None else f"{name} scatters {ratio:.1f} times as much as at rest"
        for name, ratio in unsettled.items()
    )
    return Fault(
        "not_settled",
        f"{dwell.settle_s:g} s after the arm came to {dwell.name} the sensors have not settled: {scatter}",
        "Fix board and holder more stiffly, fasten the cable so that it does not swing, keep the table "
        "still, then resume",
    )

"""One run in its folder: record a phase, judge it; if it passed, store and go on to the phase that follows.

Each phase is recorded into files of its own. Nothing ends a phase without its reason in the run's log and, where data
were kept, the command to go on with.
"""

import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.gyroscope.onboard_check import check_observed
from rig.analysis.outcome import Outcome
from rig.board.store import store_calibrations
from rig.config.load import Loaded
from rig.data.quantity import ACCELERATION, FIELD, Quantity
from rig.data.recording.run_file import RunData, make_plain, read_run
from rig.data.recording.settings import RunSettings, settings_of
from rig.data.run_folder import next_recording, recordings, resuming
from rig.errors import Fault, ProblemError, Refused
from rig.motion.steps import Plan
from rig.observation.reference.acceleration import DwellReading
from rig.observation.statistics.mean import QuantityInDwell, ReadAtRest, StaticReading
from rig.plans.phase import Phase
from rig.plans.script_errors import ENDING
from rig.plans.script_file import ScriptFile, installed_script
from rig.report.writers import write_outcome
from rig.runner.ahead import Connecting
from rig.runner.announcement import mounting
from rig.runner.connect import Connector
from rig.runner.mounted import Memory
from rig.runner.resumption import Resumption, resumption
from rig.station.events import (
    Advice,
    AttitudeRead,
    CalibrationStored,
    Checked,
    Crashed,
    Failed,
    Interrupted,
    ObservationMade,
    PhaseSkipped,
    PhaseStarted,
    RunEvent,
    VerdictReached,
)
from rig.station.station import Station
from rig.turners.registry import kind_of


@dataclass(frozen=True, slots=True)
class Run:
    """A run; the laboratory, if it is a simulated one, is there already. `script` is that of its first phase.

    `memory` is what is known of its sensors from before; the turner is connected by `connecting` where that is given.
    `again` is the command that goes on with it, where that is not `rig resume`.
    """

    folder: Path
    loaded: Loaded
    script: ScriptFile
    station: Station
    memory: Memory = field(default_factory=Memory)
    connecting: Connecting | None = None
    again: str = ""

    def carry_out(self, phase: Phase) -> Outcome:
        """Carry out `phase` and what follows it; writes the outcome into the folder and returns it."""
        outcome = self._judged(phase, self._recorded(phase, self._resumed(phase), moved=False), None)
        while (follows := phase.follows) is not None:
            phase = follows
            runs: tuple[RunData, ...] = ()
            if outcome.passed:
                self._store(outcome)
                runs = self._recorded(phase, Resumption(), moved=True, results=outcome.results)
            else:
                self.station.event(PhaseSkipped(phase.procedure.name))
            outcome = self._judged(phase, runs, outcome)
        return self._written(outcome)

    def refused_sweeps(self, phase: Phase) -> bool:
        """Whether sweeps or dwells of a phase that was carried out do not count: to carry it out again repeats them."""
        if phase.procedure.reads_corrected:
            return False
        plan = phase.plan()
        planned = {sweep.index for sweep in plan.sweeps} | {dwell.index for dwell in plan.dwells}
        return bool(planned - self._resumed(phase).done)

    def _resumed(self, phase: Phase) -> Resumption:
        """What counts of the phase's recordings before. Corrected readings are compared as one movement: none do."""
        if phase.procedure.reads_corrected:
            return Resumption()
        with self.reported(self._mended, moved=False):
            earlier = [read_run(file) for file in recordings(self.folder, phase.procedure.readings)]
            return resumption(earlier, self._settings(phase), self.script)

    def _recorded(
        self, phase: Phase, resumed: Resumption, *, moved: bool, results: Mapping[str, SensorResult] | None = None
    ) -> tuple[RunData, ...]:
        """Carry out the phase's script, with the `results` of the calibration before; all recordings of the phase.

        The item is mounted anew before each stage with nothing connected: what is in the way may be unplugged.
        """
        readings = phase.procedure.readings
        with self.reported(self._mended, moved=moved):
            plan = phase.plan()
        stages = plan.stages
        left = [number for number, each in enumerate(stages) if each.indices - resumed.done]
        for number in left or [max(len(stages) - 1, 0)]:
            if stages:
                with self.reported(self._mended, moved=moved):
                    self._mounted(plan, number)
            path = self._record(phase, number, resumed, moved=moved, results=results)
            if stages:
                with self.reported(self._repeating, moved=True):
                    earlier = [read_run(file) for file in recordings(self.folder, readings)]
                resumed = Resumption(earlier, resumed.done | stages[number].indices)
                phase, moved = replace(phase, agreed=True), True
        with self.reported(self._repeating, moved=True):
            files = recordings(self.folder, readings)
            if path not in files:
                raise Fault(
                    "run_folder_removed",
                    f"{path} does not exist any more",
                    "Start a new run, and leave its folder in its place until the run has ended",
                )
            if phase.procedure.reads_corrected:
                files = files[-1:]  # one whole movement; what was interrupted before it does not count
            for file in files[:-1]:
                make_plain(file)  # if the run was killed, only readers that know about it could open its file
            return tuple(read_run(file) for file in files)

    def _record(
        self,
        phase: Phase,
        stage: int,
        resumed: Resumption,
        *,
        moved: bool,
        results: Mapping[str, SensorResult] | None,
    ) -> Path:
        """Carry out the phase's script for one stage, which is the whole of it where there are none; the recording."""
        path = next_recording(self.folder, phase.procedure.readings)
        own = phase.procedure is self.script.procedure
        script = self.script if own else installed_script(phase.procedure.name)
        settings = replace(self._settings(phase), stage=stage)
        told = self.station, resumed, results or {}, self.memory, self.connecting
        connector = Connector(phase, self.loaded, settings, script, path, *told)
        with self.reported(self._mended, moved=moved), connector.open() as rig:
            self.station.event(PhaseStarted(phase.procedure.name, rig.plan, rig.readings()))
            phase.procedure.script(rig)
            self.station.event(rig.recorded())
        return path

    def _mounted(self, plan: Plan, number: int) -> None:
        """Let the operator mount the item for a stage. Raises Refused `not_mounted`."""
        if not self.station.ask(mounting(plan, number, kind_of(self.loaded.config.turner).words)):
            raise Refused(
                "not_mounted",
                f"nobody has confirmed that the item is mounted for stage {number + 1}",
                "Go on when somebody stands there to mount it; --yes cannot confirm it, because somebody's "
                "hands are at the item then",
            )

    def _settings(self, phase: Phase) -> RunSettings:
        """What the phase is judged by, recorded beside it."""
        then = phase.follows is not None
        settings = settings_of(self.loaded.config, phase.plan())
        return replace(settings, procedure=phase.procedure.name, then_verify=then)

    def _judged(self, phase: Phase, runs: tuple[RunData, ...], before: Outcome | None) -> Outcome:
        with self.reported(self._repeating, moved=True):
            outcome = phase.procedure.analyse(runs, before, phase.procedure.estimator)
            if runs and phase.procedure.calibrates_along:
                check_observed(runs[-1], self.loaded.config.to_calibrate)
        if before is None:
            for event in observations_of(outcome):
                self.station.event(event)
        return outcome

    def _store(self, outcome: Outcome) -> None:
        with self.reported(self._mended, moved=True):
            for name, stored in store_calibrations(self.loaded.config, outcome.results):
                sensor = self.loaded.config.sensors[name]
                self.station.event(CalibrationStored(name, sensor.part, sensor.serial_number, stored.sequence))

    def _written(self, outcome: Outcome) -> Outcome:
        with self.reported(self._repeating, moved=True):
            for event in write_outcome(self.folder, outcome):
                self.station.event(event)
        for check in outcome.checks:
            self.station.event(Checked(check))
        self.station.event(VerdictReached(outcome.passed))
        return outcome

    @property
    def _mended(self) -> Advice:
        return Advice(self.folder, self._going_on, repeats=False)

    @property
    def _repeating(self) -> Advice:
        return Advice(self.folder, self._going_on, repeats=True)

    @property
    def _going_on(self) -> str:
        return self.again or resuming(self.folder)

    @contextmanager
    def reported(self, advice: Advice | None = None, *, moved: bool = False) -> Iterator[None]:
        """What ends a run early goes into its log too; a fault is followed by `advice`, an interruption by its own.

        A refusal says that nothing has moved: after a phase of the run (`moved`) it is a fault.
        """
        try:
            yield
        except ProblemError as error:
            if isinstance(error, Refused) and not moved:
                self.station.event(Failed(error))
                raise
            fault = Fault(error.name, _with_notes(error.what, error), error.remedy)
            fault.__cause__ = error
            self._ended(Failed(fault), advice)
            raise fault from error
        except OSError as error:
            remedy = f"Correct that, then go on with: {self._going_on}"
            fault = Fault("system", f"{self.folder} cannot be used ({error})", remedy)
            self._ended(Failed(fault))
            raise fault from error
        except SystemExit as ended:
            what = _with_notes(f"the script {self.script.name} ended the program (SystemExit: {ended})", ended)
            fault = Fault("script_failed", what, ENDING)
            fault.__cause__ = ended
            self._ended(Failed(fault), advice)
            raise fault from ended
        except KeyboardInterrupt as interrupt:
            stopped = _with_notes(str(interrupt) or "interrupted", interrupt)
            text = f"{stopped}; the data are kept in {self.folder}. Go on with: {self._going_on}"
            self._ended(Interrupted(text))
            raise KeyboardInterrupt(text) from None
        except Exception:
            self._ended(Crashed(traceback.format_exc()))
            raise

    def _ended(self, event: RunEvent, advice: Advice | None = None) -> None:
        self.station.event(event)
        if advice is not None and self.folder.exists():
            self.station.event(advice)


def _with_notes(what: str, error: BaseException) -> str:
    """What happened, and what the arm added on its way out about its stop."""
    return "; ".join([what, *dict.fromkeys(_notes(error))])


def _notes(error: BaseException | None) -> Iterator[str]:
    """The notes of what ended the run, and of what it interrupted: a second Ctrl-C comes while the first is handled."""
    while error is not None:
        yield from getattr(error, "__notes__", ())
        error = None if error.__suppress_context__ else error.__context__


def observations_of(outcome: Outcome) -> Iterator[ObservationMade | AttitudeRead]:
    """What a calibration rests on, and the attitudes that were held out of it, for whoever looks on."""
    for name, result in outcome.results.items():
        for observation in result.observations:
            yield ObservationMade(name, observation)
    for name, found in outcome.accelerometers.items():
        for dwell in (*found.dwells, *(found.held_out.dwells if found.held_out else ())):
            yield _read(name, ACCELERATION, dwell, found.gravity_m_s2)
    for name, solved in outcome.magnetometers.results.items():
        for each in solved.dwells:
            yield _read(name, FIELD, each, solved.field_t)


def _read(name: str, quantity: Quantity, dwell: DwellReading | StaticReading, expected: float) -> AttitudeRead:
    return AttitudeRead(ReadAtRest(QuantityInDwell(name, quantity, dwell.index, dwell.name), dwell.reading, expected))

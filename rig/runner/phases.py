"""One run in its folder: records and judges a phase; if it passed, stores the results and continues with the next.

Each phase has its own recordings. The run's log states why a run ended early and, if data were kept, how to continue.
"""

import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.gyroscope.onboard_check import check_observed
from rig.analysis.outcome import Outcome
from rig.board.flash_store import store_calibrations
from rig.config.load import Loaded
from rig.data.quantity import ACCELERATION, FIELD, Quantity
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import make_plain, read_run
from rig.data.recording.settings import RunSettings, settings_of
from rig.data.run_folder import next_recording, recordings, resuming
from rig.errors import Fault, ProblemError, Refused
from rig.motion.steps import Plan
from rig.observation.reference.dwell_acceleration import DwellReading
from rig.observation.statistics.mean import QuantityInDwell, ReadAtRest, StaticReading
from rig.plans.phase import Phase
from rig.plans.script_errors import ENDING_REMEDY
from rig.plans.script_file import ScriptFile, find_installed_script
from rig.report.writers import write_outcome
from rig.runner.announcement import mounting
from rig.runner.connect import Connector
from rig.runner.early_connection import Connecting
from rig.runner.mounted_sensors import Memory
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
    VerdictReached,
)
from rig.station.operator_station import Station
from rig.station.words import line
from rig.turners.turner_registry import kind_of


@dataclass(frozen=True, slots=True)
class Run:
    """One run in its `folder`, with all its phases; a simulated laboratory must already be running.

    - `script`: the script of the first phase.
    - `memory`: the sensors' earlier calibrations.
    - `connecting`: the function that connects the turner; None for the function of the turner's kind.
    - `again`: the command that continues the run, if it is not `rig resume`.
    """

    folder: Path
    loaded: Loaded
    script: ScriptFile
    station: Station
    memory: Memory = field(default_factory=Memory)
    connecting: Connecting | None = None
    again: str = ""

    def carry_out(self, phase: Phase) -> Outcome:
        """Carry out `phase` and the phases that follow it; write the outcome into the folder and return it."""
        outcome = self._judge(phase, self._record_phase(phase, self._resume(phase), moved=False), None)
        while (follows := phase.follows) is not None:
            phase = follows
            runs: tuple[RunData, ...] = ()
            if outcome.passed:
                self._store(outcome)
                runs = self._record_phase(phase, Resumption(), moved=True, results=outcome.results)
            else:
                self.station.event(PhaseSkipped(phase.procedure.name))
            outcome = self._judge(phase, runs, outcome)
        return self._write(outcome)

    def has_refused_sweeps(self, phase: Phase) -> bool:
        """Return whether a phase has refused sweeps or dwells, which another run repeats."""
        if phase.procedure.reads_corrected:
            return False
        plan = phase.plan()
        planned = {sweep.index for sweep in plan.sweeps} | {dwell.index for dwell in plan.dwells}
        return bool(planned - self._resume(phase).done)

    def _resume(self, phase: Phase) -> Resumption:
        """Return the valid steps of earlier recordings; empty for corrected readings, which are never resumed."""
        if phase.procedure.reads_corrected:
            return Resumption()
        with self.report_end(self._advice, moved=False):
            earlier = [read_run(file) for file in recordings(self.folder, phase.procedure.readings)]
            return resumption(earlier, self._settings(phase), self.script)

    def _record_phase(
        self, phase: Phase, resumed: Resumption, *, moved: bool, results: Mapping[str, SensorResult] | None = None
    ) -> tuple[RunData, ...]:
        """Carry out the phase's script, with `results` of the previous calibration; return all recordings of the phase.

        Raise Fault `run_folder_removed`.
        """
        with self.report_end(self._advice, moved=moved):
            plan = phase.plan()
        record = self._record_stages if plan.stages else self._record_stage
        path = record(phase, plan, resumed, moved=moved, results=results)
        with self.report_end(self._advice_to_repeat, moved=True):
            return self._read_recordings(phase, path)

    def _record_stages(
        self, phase: Phase, plan: Plan, resumed: Resumption, *, moved: bool, results: Mapping[str, SensorResult] | None
    ) -> Path:
        """Carry out the script for each stage that is not done, else for the last one; return the last path.

        During the mounting for a stage nothing is connected, because cables may have to be unplugged.
        """
        open_stages = [number for number, stage in enumerate(plan.stages) if stage.indices - resumed.done]
        paths: list[Path] = []
        for number in open_stages or [len(plan.stages) - 1]:
            with self.report_end(self._advice, moved=moved):
                self._confirm_mounting(plan, number)
            paths.append(self._record_stage(phase, plan, resumed, moved=moved, results=results, stage=number))
            # For the next stage this one is an earlier recording, and the operator has agreed to the motion.
            with self.report_end(self._advice_to_repeat, moved=True):
                earlier = [read_run(file) for file in recordings(self.folder, phase.procedure.readings)]
            resumed = Resumption(earlier, resumed.done | plan.stages[number].indices)
            phase, moved = replace(phase, agreed=True), True
        return paths[-1]

    def _read_recordings(self, phase: Phase, newest: Path) -> tuple[RunData, ...]:
        """Return all recordings of a phase. Raise Fault `run_folder_removed` if the `newest` is not among them."""
        files = recordings(self.folder, phase.procedure.readings)
        if newest not in files:
            raise Fault(
                "run_folder_removed",
                f"{newest} does not exist any more",
                "Start a new run, and leave its folder in its place until the run has ended",
            )
        if phase.procedure.reads_corrected:
            files = files[-1:]  # a complete movement; interrupted ones before it do not count
        for file in files[:-1]:
            make_plain(file)  # otherwise only a reader of interrupted files could open it
        return tuple(read_run(file) for file in files)

    def _record_stage(
        self,
        phase: Phase,
        plan: Plan,
        resumed: Resumption,
        *,
        moved: bool,
        results: Mapping[str, SensorResult] | None,
        stage: int = 0,
    ) -> Path:
        """Carry out the phase's script for a stage, or for a whole plan without stages; return the recording's path."""
        path = next_recording(self.folder, phase.procedure.readings)
        is_own = phase.procedure is self.script.procedure
        script = self.script if is_own else find_installed_script(phase.procedure.name)
        settings = replace(self._settings(phase), stage=stage)
        context = self.station, resumed, results or {}, self.memory, self.connecting
        connector = Connector(phase, self.loaded, settings, script, path, *context)
        with self.report_end(self._advice, moved=moved), connector.open() as rig:
            self.station.event(PhaseStarted(phase.procedure.name, rig.plan, rig.readings()))
            phase.procedure.script(rig)
            self.station.event(rig.finish_sampling())
        return path

    def _confirm_mounting(self, plan: Plan, number: int) -> None:
        """Ask the operator to mount the item for a stage. Raise Refused `not_mounted`."""
        if not self.station.ask(mounting(plan, number, kind_of(self.loaded.config.turner).words)):
            raise Refused(
                "not_mounted",
                f"nobody has confirmed that the item is mounted for stage {number + 1}",
                "Continue when somebody is there to mount it; --yes cannot confirm this, because somebody's "
                "hands are at the item then",
            )

    def _settings(self, phase: Phase) -> RunSettings:
        """Return the recorded settings, which also determine the phase's verdict."""
        then = phase.follows is not None
        settings = settings_of(self.loaded.config, phase.plan())
        return replace(settings, procedure=phase.procedure.name, then_verify=then)

    def _judge(self, phase: Phase, runs: tuple[RunData, ...], before: Outcome | None) -> Outcome:
        """Return the outcome of a phase, and send its observations to the station."""
        with self.report_end(self._advice_to_repeat, moved=True):
            outcome = phase.procedure.analyse(runs, before, phase.procedure.estimator)
            if runs and phase.procedure.calibrates_along:
                check_observed(runs[-1], self.loaded.config.to_calibrate)
        if before is None:
            for event in list_observations(outcome):
                self.station.event(event)
        return outcome

    def _store(self, outcome: Outcome) -> None:
        with self.report_end(self._advice, moved=True):
            for name, stored in store_calibrations(self.loaded.config, outcome.results):
                sensor = self.loaded.config.sensors[name]
                self.station.event(CalibrationStored(name, sensor.part, sensor.serial_number, stored.sequence))

    def _write(self, outcome: Outcome) -> Outcome:
        with self.report_end(self._advice_to_repeat, moved=True):
            for event in write_outcome(self.folder, outcome):
                self.station.event(event)
        for check in outcome.checks:
            self.station.event(Checked(check))
        self.station.event(VerdictReached(outcome.passed))
        return outcome

    @property
    def _advice(self) -> Advice:
        return Advice(self.folder, self._next_command, repeats=False)

    @property
    def _advice_to_repeat(self) -> Advice:
        return Advice(self.folder, self._next_command, repeats=True)

    @property
    def _next_command(self) -> str:
        return self.again or resuming(self.folder)

    @contextmanager
    def report_end(self, advice: Advice | None = None, *, moved: bool = False) -> Iterator[None]:
        """Report the early end of a run, also in its log; after a fault, `advice` follows.

        A refusal means that nothing has moved; if the run has `moved`, the refusal becomes a fault.
        """
        try:
            yield
        except ProblemError as error:
            if isinstance(error, Refused) and not moved:
                self.station.event(Failed(error))
                raise
            fault = Fault(error.name, _add_notes(error.what, error), error.remedy)
            fault.__cause__ = error
            self._report_failure(fault, advice)
            raise fault from error
        except OSError as error:
            remedy = f"Correct that, then go on with: {self._next_command}"
            fault = Fault("system", f"{self.folder} cannot be used ({error})", remedy)
            self._report_failure(fault)
            raise fault from error
        except SystemExit as ended:
            what = _add_notes(f"the script {self.script.name} ended the program (SystemExit: {ended})", ended)
            fault = Fault("script_failed", what, ENDING_REMEDY)
            fault.__cause__ = ended
            self._report_failure(fault, advice)
            raise fault from ended
        except KeyboardInterrupt as interrupt:
            stopped = _add_notes(str(interrupt) or "interrupted", interrupt)
            text = f"{stopped}; the data are kept in {self.folder}. Go on with: {self._next_command}"
            self.station.event(Interrupted(text))
            raise KeyboardInterrupt(text) from None
        except Exception:
            self.station.event(Crashed(traceback.format_exc()))
            raise

    def _report_failure(self, fault: Fault, advice: Advice | None = None) -> None:
        """Report a fault, then `advice`, which becomes a note that the command prints after the error."""
        self.station.event(Failed(fault))
        if advice is not None and self.folder.exists():
            self.station.event(advice)
            fault.add_note(line(advice) or "")


def _add_notes(what: str, error: BaseException) -> str:
    """Return the message `what` followed by the notes of the error, such as the note on how the arm stopped."""
    return "; ".join([what, *dict.fromkeys(_notes(error))])


def _notes(error: BaseException | None) -> Iterator[str]:
    """Yield the notes of an error and of the errors before it, such as the first Ctrl-C before a second."""
    while error is not None:
        yield from getattr(error, "__notes__", ())
        error = None if error.__suppress_context__ else error.__context__


def list_observations(outcome: Outcome) -> Iterator[ObservationMade | AttitudeRead]:
    """Yield a calibration's observations and attitudes, including held-out ones, as events for the page."""
    for name, result in outcome.results.items():
        for observation in result.observations:
            yield ObservationMade(name, observation)
    for name, accelerometer in outcome.accelerometers.items():
        for dwell in (*accelerometer.dwells, *(accelerometer.validation.dwells if accelerometer.validation else ())):
            yield _read(name, ACCELERATION, dwell, accelerometer.gravity_m_s2)
    for name, solved in outcome.magnetometers.results.items():
        for reading in solved.dwells:
            yield _read(name, FIELD, reading, solved.field_t)


def _read(name: str, quantity: Quantity, dwell: DwellReading | StaticReading, expected: float) -> AttitudeRead:
    return AttitudeRead(ReadAtRest(QuantityInDwell(name, quantity, dwell.index, dwell.name), dwell.reading, expected))

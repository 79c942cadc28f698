"""Connects the sources of samples and the turner, starts the recording, and combines all of it in a `Rig`."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from firmware_host.client import Calibration
from rig.analysis.design.candidate_search import target_of
from rig.board.crystal import follows_crystal
from rig.board.flash_store import SensorSolution, calibration_of
from rig.board.identify import refusing, require_board_section
from rig.config.load import Loaded
from rig.config.procedures.procedure_sections import SixObservationSection, ThermalSection
from rig.data.recording.provenance import Provenance, calls_itself_simulated, provenance_of
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.recorded_turner import RecordedTurner
from rig.data.recording.run_file import RunRecorder
from rig.data.recording.settings import RunSettings
from rig.data.recording.thermal_events import SetMeasured
from rig.data.run_folder import ARM_LOG, refuse_links
from rig.errors import Refused
from rig.motion.steps import Plan
from rig.motion.turner_state import Report, TurnerIdentity
from rig.observation.by_hand.rests_and_moves import collect_inputs
from rig.plans.motions.temperature_course import TemperatureCourse
from rig.plans.phase import Phase
from rig.plans.script_file import ScriptFile
from rig.runner.acquisition import Acquisition
from rig.runner.board.host_correction import HostCorrected, correct_rates
from rig.runner.board.onboard import BoardCalibration
from rig.runner.board.sensors import BoardSource, open_board_source
from rig.runner.by_hand.hand_session import HandSession
from rig.runner.early_connection import Connecting
from rig.runner.ending_early import EndingEarly
from rig.runner.mounted_sensors import Memory, find_mounted
from rig.runner.procedure_runner import Devices, Recording, Rig
from rig.runner.resumption import Resumption
from rig.runner.warming import Warming
from rig.sensors.sample_source import OnSamples, SampleSource
from rig.sensors.sensor_registry import group_by_port
from rig.station.events import ArmConnected, ArmSeen, BoardConnected, RunResumed, SensorConnected
from rig.station.operator_station import Station
from rig.turners.turner import Turner
from rig.turners.turner_kind import AnyTurner
from rig.turners.turner_registry import kind_of


@dataclass(frozen=True, slots=True)
class Connector:
    """The connections of one phase of a run.

    - `results`: the calibrations of the previous phase, by sensor name.
    - `memory`: the sensors' earlier calibrations.
    - `connecting`: the function that connects the turner; None for the function of the turner's kind.
    """

    phase: Phase
    loaded: Loaded
    settings: RunSettings
    script: ScriptFile
    path: Path
    station: Station
    resumed: Resumption
    results: Mapping[str, SensorSolution] = field(default_factory=dict)
    memory: Memory = field(default_factory=Memory)
    connecting: Connecting | None = None

    def _find_omitted(self, whole_plan: Plan) -> frozenset[int]:
        """Return the indices of sweeps and dwells to omit now: finished ones, and those of other stages."""
        others = (stage.indices for index, stage in enumerate(whole_plan.stages) if index != self.settings.stage)
        return self.resumed.done.union(*others)

    @contextmanager
    def open(self) -> Iterator[Rig]:
        """Connect everything and start recording; yield the rig; at the end stop the turner and close the recording.

        Nothing moves. Raise Refused if the turner, the board or a sensor differs from the configuration or from the
        recording so far, or if a sensor lacks the calibration for its corrected readings.
        """
        whole_plan = self.phase.plan()
        if self.resumed.earlier and not self.phase.agreed:  # a later stage resumes nothing
            self.station.event(RunResumed(len(self.resumed.done), len(whole_plan.sweeps) + len(whole_plan.dwells)))
        acquisition = Acquisition()
        with ExitStack() as stack:
            board = self._connect_board(stack, acquisition) if self.loaded.config.parts_on_board else None
            sources = (*([board] if board else []), *self._connect_others(stack, acquisition))
            described = {name: sensor for source in sources for name, sensor in source.sensors.items()}
            for name, sensor in described.items():
                acquisition.expect(name, sensor)
            kind = kind_of(self.loaded.config.turner)
            turner, report, identity = self._connect_turner(kind, stack, acquisition)
            recorded = RecordedTurner.build(kind.name, identity, report.joints, kind.fields)
            made_with = self._build_provenance(kind, board, report, identity)
            recording = self._record(stack, made_with, recorded, described)
            acquisition.recorder = recording.recorder
            simulated = self.loaded.simulated or calls_itself_simulated(report.software)
            on_board = None if board is None else board.board.identity.unique_id
            carried = find_mounted(described, on_board, self.memory, simulated=simulated)
            plan = self.phase.plan(report.state.q_rad, self._find_omitted(whole_plan))
            yield Rig(
                devices=Devices(turner, report, kind, self.loaded.config.turner, sources, acquisition, carried),
                plan=plan,
                whole_plan=whole_plan,
                recording=recording,
                onboard=None
                if board is None
                else self._build_board_calibration(board, acquisition, recording, recorded),
                phase=self.phase,
                hand=self._build_hand_session(acquisition, recording, made_with, described),
                stage=self.settings.stage,
                last=not any(
                    stage.indices - self.resumed.done for stage in whole_plan.stages[self.settings.stage + 1 :]
                ),
                up=self.loaded.config.site.up,
                early=self._build_early_end(plan, len(whole_plan.sweeps)),
                warming=self._build_warming(board, acquisition, recording, whole_plan),
            )

    def _build_early_end(self, plan: Plan, sweeps: int) -> EndingEarly | None:
        """Return the condition for ending before the last repeat; None if there is no target, or for a verification."""
        section, procedure = self.loaded.config.procedure, self.phase.procedure
        if procedure.reads_corrected or not isinstance(section, SixObservationSection):
            return None
        if (wanted := target_of(section)) is None:
            return None
        return EndingEarly(wanted, plan, sweeps, section.repeats, self.path, self.resumed.earlier, procedure.estimator)

    def _connect_board(self, stack: ExitStack, acquisition: Acquisition) -> BoardSource:
        config, calibrated = self.loaded.config, self.phase.procedure.reads_corrected
        with refusing():
            source = stack.enter_context(open_board_source(config, acquisition.on_samples, calibrated=calibrated))
        self.station.event(BoardConnected(require_board_section(config).port, source.board.identity))
        return source

    def _connect_others(self, stack: ExitStack, acquisition: Acquisition) -> Iterator[SampleSource]:
        """Yield sources of the sensors with their own ports; for a verification, the host corrects their readings."""
        config, calibrated = self.loaded.config, self.phase.procedure.reads_corrected
        for port, kind, sections in group_by_port(config.sensors):
            on_samples: OnSamples = acquisition.on_samples
            calibrations = {
                name: self._find_calibration(name) for name in sections if calibrated and name in config.to_calibrate
            }
            for name, calibration in calibrations.items():
                on_samples = correct_rates(name, kind.describe(name, sections[name]), calibration, on_samples)
            with refusing():
                source = stack.enter_context(kind.connect(sections, on_samples))
            for name, section in sections.items():
                self.station.event(SensorConnected(name, section.part, section.serial_number, port, source.corrected))
            yield HostCorrected(source, calibrations) if calibrations else source

    def _find_calibration(self, name: str) -> Calibration:
        """Return the sensor's calibration from the previous phase. Raise Refused `nothing_to_correct_by`."""
        if name not in self.results:
            raise Refused(
                "nothing_to_correct_by",
                f"sensors.{name}: no board stores its calibration, and this run has found none",
                "Verify it in the run that calibrates it: procedure.name six_observation with verify: true",
            )
        return calibration_of(self.results[name])

    def _connect_turner(
        self, kind: AnyTurner, stack: ExitStack, acquisition: Acquisition
    ) -> tuple[Turner, Report, TurnerIdentity]:
        """Connect the turner for the run; return it with its report and its identity. Nothing moves."""
        section = self.loaded.config.turner
        log = self.path.with_name(ARM_LOG)
        refuse_links(log)
        let_go = stack.enter_context(ExitStack())  # closed after the turner
        connecting = self.connecting or partial(kind.connect, section)
        turner = stack.enter_context(connecting(acquisition.on_state, log))
        let_go.callback(self._report_last_state, turner)
        report = turner.report()
        self.station.event(ArmConnected(report, kind.words.short))
        return turner, report, kind.describe_connected(section, report)

    def _report_last_state(self, turner: Turner) -> None:
        """Report the turner's last state again; otherwise the page shows a moving turner."""
        self.station.event(ArmSeen(turner.latest, turner.missed_states))

    def _build_provenance(
        self, kind: AnyTurner, board: BoardSource | None, report: Report, identity: TurnerIdentity
    ) -> Provenance:
        with refusing():
            crystal = None if board is None else follows_crystal(board.board)
        return provenance_of(
            self.loaded,
            None if board is None else board.board.identity,
            report,
            identity,
            stored={} if board is None else board.stored,
            script=self.script.identity,
            script_installed=self.script.is_installed,
            follows_crystal=crystal,
            kind=kind.name,
        )

    def _record(
        self, stack: ExitStack, made_with: Provenance, turner: RecordedTurner, described: Mapping[str, RecordedSensor]
    ) -> Recording:
        """Start and return the recording. Raise Refused if a device differs from those of earlier recordings."""
        self.resumed.refuse_other_instruments(made_with, described)
        with refusing():
            recorder = RunRecorder(
                self.path,
                config=self.loaded.rig_text,
                settings=self.settings,
                provenance=made_with,
                turner=turner,
                sensors=described,
            )
        return Recording(stack.enter_context(recorder), described, self.station, turner.geometry)

    def _build_hand_session(
        self,
        acquisition: Acquisition,
        recording: Recording,
        made_with: Provenance,
        described: Mapping[str, RecordedSensor],
    ) -> HandSession | None:
        """Return the session in which an operator turns the item, if any. Raise Refused `clock_unknown`."""
        if self.settings.by_hand is None:
            return None
        name = self.settings.to_calibrate[0]
        return HandSession(
            acquisition=acquisition,
            note=recording.note,
            tell=self.station.event,
            settings=self.settings.by_hand,
            name=name,
            sensor=described[name],
            conditions=collect_inputs(self.settings, made_with, described[name]),
            earlier=self.resumed.earlier,
        )

    def _build_warming(
        self, board: BoardSource | None, acquisition: Acquisition, recording: Recording, whole_plan: Plan
    ) -> Warming | None:
        """Return the supervision of the temperature; None if the procedure does not change it."""
        section = self.loaded.config.procedure
        if not isinstance(section, ThermalSection):
            return None
        events = [event.event for run in self.resumed.earlier for event in run.events]
        measured = [event for event in events if isinstance(event, SetMeasured)]
        return Warming(
            section=section,
            acquisition=acquisition,
            note=recording.note,
            names=tuple(self.loaded.config.to_calibrate),
            heater=board.board if board is not None and section.heater_power > 0 else None,
            set_s=(whole_plan.duration_s - sum(wait.duration_s for wait in whole_plan.waits)) / section.repeats,
            course=TemperatureCourse(
                section.from_c,
                section.to_c,
                section.max_step_k,
                section.both_directions,
                sets=[done for done in measured if self.resumed.done.issuperset(range(done.first, done.end))],
            ),
        )

    def _build_board_calibration(
        self, source: BoardSource, acquisition: Acquisition, recording: Recording, turner: RecordedTurner
    ) -> BoardCalibration | None:
        """Return the board's own calibration from raw readings, with its observations from before an interruption.

        Return None if the readings are not raw, or no sensor on the board is to be calibrated.
        """
        to_calibrate = {
            name: (sensor.index, sensor.described)
            for name, sensor in source.set_up.items()
            if name in self.settings.to_calibrate
        }
        if self.settings.by_hand is not None or not (self.phase.procedure.calibrates_along and to_calibrate):
            return None
        onboard = BoardCalibration(
            source.board, acquisition, recording.note, self.settings.observation, to_calibrate, turner
        )
        with refusing():
            onboard.recall(self.resumed.earlier, self.resumed.done)
        return onboard

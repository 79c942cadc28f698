"""Connects the sources of samples and the turner, starts the recording, hands all of it to a script as one `Rig`."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from firmware_host.client import Calibration
from rig.analysis.design.shortest import target_of
from rig.board.crystal import follows_crystal
from rig.board.identify import refusing, require_board_section
from rig.board.store import SensorSolution, calibration_of
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
from rig.motion.state import Report, TurnerIdentity
from rig.motion.steps import Plan
from rig.observation.by_hand.runs import collect_inputs
from rig.plans.motions.temperature_course import TemperatureCourse
from rig.plans.phase import Phase
from rig.plans.script_file import ScriptFile
from rig.runner.acquisition import Acquisition
from rig.runner.ahead import Connecting
from rig.runner.board.host_correction import HostCorrected, correcting
from rig.runner.board.onboard import BoardCalibration
from rig.runner.board.sensors import BoardSource, board_source
from rig.runner.by_hand.session import HandSession
from rig.runner.ending_early import EndingEarly
from rig.runner.mounted import Memory, mounted
from rig.runner.procedure import Devices, Recording, Rig
from rig.runner.resumption import Resumption
from rig.runner.warming import Warming
from rig.sensors.registry import group_by_port
from rig.sensors.source import OnSamples, SampleSource
from rig.station.events import ArmConnected, ArmSeen, BoardConnected, RunResumed, SensorConnected
from rig.station.station import Station
from rig.turners.kind import AnyTurner
from rig.turners.registry import kind_of
from rig.turners.turner import Turner


@dataclass(frozen=True, slots=True)
class Connector:
    """Opens one phase of a run: what is to be done, by which configuration and script, recorded where, told to whom.

    `found` are the calibrations of the phase before, by sensor name; `memory` is what is known of earlier runs. The
    turner is connected by `connecting` where that is given.
    """

    phase: Phase
    loaded: Loaded
    settings: RunSettings
    script: ScriptFile
    path: Path
    station: Station
    resumed: Resumption
    found: Mapping[str, SensorSolution] = field(default_factory=dict)
    memory: Memory = field(default_factory=Memory)
    connecting: Connecting | None = None

    def _left_out(self, whole_plan: Plan) -> frozenset[int]:
        """The sweeps of the plan that are not made now: those that are done, and those of other stages."""
        others = (each.indices for place, each in enumerate(whole_plan.stages) if place != self.settings.stage)
        return self.resumed.done.union(*others)

    @contextmanager
    def open(self) -> Iterator[Rig]:
        """Everything connected and recording, nothing moved yet; on the way out the turner stops, the file is closed.

        Raises `Refused` by name when the turner, the board or a sensor is not what the configuration says, or not what
        was recorded earlier, or has no calibration to correct by.
        """
        whole_plan = self.phase.plan()
        if self.resumed.earlier and not self.phase.agreed:  # a stage that follows resumes nothing
            self.station.event(RunResumed(len(self.resumed.done), len(whole_plan.sweeps) + len(whole_plan.dwells)))
        acquisition = Acquisition()
        with ExitStack() as stack:
            board = self._connect_board(stack, acquisition) if self.loaded.config.parts_on_board else None
            sources = (*([board] if board else []), *self._connect_others(stack, acquisition))
            described = {name: sensor for source in sources for name, sensor in source.sensors.items()}
            for name, sensor in described.items():
                acquisition.expect(name, sensor)
            kind = kind_of(self.loaded.config.turner)
            turner, report, made = self._connect_turner(kind, stack, acquisition)
            recorded = RecordedTurner.build(kind.name, made, report.joints, kind.fields)
            made_with = self._provenance(kind, board, report, made)
            recording = self._record(stack, made_with, recorded, described)
            acquisition.recorder = recording.recorder
            simulated = self.loaded.simulated or calls_itself_simulated(report.software)
            on_board = None if board is None else board.board.identity.unique_id
            carried = mounted(described, on_board, self.memory, simulated=simulated)
            plan = self.phase.plan(report.state.q_rad, self._left_out(whole_plan))
            yield Rig(
                devices=Devices(turner, report, kind, self.loaded.config.turner, sources, acquisition, carried),
                plan=plan,
                whole_plan=whole_plan,
                recording=recording,
                along=None if board is None else self._calibrating_along(board, acquisition, recording, recorded),
                phase=self.phase,
                hand=self._by_hand(acquisition, recording, made_with, described),
                stage=self.settings.stage,
                last=not any(each.indices - self.resumed.done for each in whole_plan.stages[self.settings.stage + 1 :]),
                up=self.loaded.config.site.up,
                early=self._ending_early(plan, len(whole_plan.sweeps)),
                warming=self._warming(board, acquisition, recording, whole_plan),
            )

    def _ending_early(self, plan: Plan, sweeps: int) -> EndingEarly | None:
        """What ends the run before its last repeat; None where nothing is wanted, or readings are compared."""
        section, procedure = self.loaded.config.procedure, self.phase.procedure
        if procedure.reads_corrected or not isinstance(section, SixObservationSection):
            return None
        if (wanted := target_of(section)) is None:
            return None
        return EndingEarly(wanted, plan, sweeps, section.repeats, self.path, self.resumed.earlier, procedure.estimator)

    def _connect_board(self, stack: ExitStack, acquisition: Acquisition) -> BoardSource:
        config, calibrated = self.loaded.config, self.phase.procedure.reads_corrected
        with refusing():
            source = stack.enter_context(board_source(config, acquisition.on_samples, calibrated=calibrated))
        self.station.event(BoardConnected(require_board_section(config).port, source.board.identity))
        return source

    def _connect_others(self, stack: ExitStack, acquisition: Acquisition) -> Iterator[SampleSource]:
        """The sensors with a port of their own; to verify them, their calibrations correct their readings here."""
        config, calibrated = self.loaded.config, self.phase.procedure.reads_corrected
        for port, kind, sections in group_by_port(config.sensors):
            on_samples: OnSamples = acquisition.on_samples
            calibrations = {
                name: self._calibration(name) for name in sections if calibrated and name in config.to_calibrate
            }
            for name, calibration in calibrations.items():
                on_samples = correcting(name, kind.describe(name, sections[name]), calibration, on_samples)
            with refusing():
                source = stack.enter_context(kind.connect(sections, on_samples))
            for name, section in sections.items():
                self.station.event(SensorConnected(name, section.part, section.serial_number, port, source.corrected))
            yield HostCorrected(source, calibrations) if calibrations else source

    def _calibration(self, name: str) -> Calibration:
        """Raises Refused `nothing_to_correct_by`."""
        if name not in self.found:
            raise Refused(
                "nothing_to_correct_by",
                f"sensors.{name}: no board stores its calibration, and this run has found none",
                "Verify it in the run that calibrates it: procedure.name six_observation with verify: true",
            )
        return calibration_of(self.found[name])

    def _connect_turner(
        self, kind: AnyTurner, stack: ExitStack, acquisition: Acquisition
    ) -> tuple[Turner, Report, TurnerIdentity]:
        section = self.loaded.config.turner
        log = self.path.with_name(ARM_LOG)
        refuse_links(log)
        let_go = stack.enter_context(ExitStack())  # closed after the turner
        connecting = self.connecting or partial(kind.connect, section)
        turner = stack.enter_context(connecting(acquisition.on_state, log))
        let_go.callback(self._last_seen, turner)
        report = turner.report()
        self.station.event(ArmConnected(report, kind.words.short))
        return turner, report, kind.describe_connected(section, report)

    def _last_seen(self, turner: Turner) -> None:
        """Tell how the turner was left: whoever looks on has last seen it move."""
        self.station.event(ArmSeen(turner.latest, turner.missed_states))

    def _provenance(
        self, kind: AnyTurner, board: BoardSource | None, report: Report, made: TurnerIdentity
    ) -> Provenance:
        with refusing():
            crystal = None if board is None else follows_crystal(board.board)
        return provenance_of(
            self.loaded,
            None if board is None else board.board.identity,
            report,
            made,
            stored={} if board is None else board.stored,
            script=self.script.identity,
            script_installed=self.script.is_installed,
            follows_crystal=crystal,
            kind=kind.name,
        )

    def _record(
        self,
        stack: ExitStack,
        made_with: Provenance,
        turner: RecordedTurner,
        described: Mapping[str, RecordedSensor],
    ) -> Recording:
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

    def _by_hand(
        self,
        acquisition: Acquisition,
        recording: Recording,
        made_with: Provenance,
        described: Mapping[str, RecordedSensor],
    ) -> HandSession | None:
        """The session in which a hand turns the item; None where none does. Raises Refused `clock_unknown`."""
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
            told=collect_inputs(self.settings, made_with, described[name]),
            earlier=self.resumed.earlier,
        )

    def _warming(
        self, board: BoardSource | None, acquisition: Acquisition, recording: Recording, whole_plan: Plan
    ) -> Warming | None:
        """What watches the temperature; None where the procedure does not change it."""
        section = self.loaded.config.procedure
        if not isinstance(section, ThermalSection):
            return None
        events = [each.event for run in self.resumed.earlier for each in run.events]
        measured = [each for each in events if isinstance(each, SetMeasured)]
        return Warming(
            section=section,
            acquisition=acquisition,
            note=recording.note,
            names=tuple(self.loaded.config.to_calibrate),
            heater=board.board if board is not None and section.heater_power > 0 else None,
            set_s=(whole_plan.duration_s - sum(each.duration_s for each in whole_plan.waits)) / section.repeats,
            course=TemperatureCourse(
                section.from_c,
                section.to_c,
                section.max_step_k,
                section.both_directions,
                sets=[each for each in measured if self.resumed.done.issuperset(range(each.first, each.end))],
            ),
        )

    def _calibrating_along(
        self, source: BoardSource, acquisition: Acquisition, recording: Recording, turner: RecordedTurner
    ) -> BoardCalibration | None:
        """The board's own calibration from raw readings; it is given back what it observed before an interruption.

        None where the readings are no raw ones, or no sensor on it is to be calibrated.
        """
        to_calibrate = {
            name: (sensor.index, sensor.described)
            for name, sensor in source.set_up.items()
            if name in self.settings.to_calibrate
        }
        if self.settings.by_hand is not None or not (self.phase.procedure.calibrates_along and to_calibrate):
            return None
        along = BoardCalibration(
            source.board,
            acquisition,
            recording.note,
            self.settings.observation,
            to_calibrate,
            turner,
        )
        with refusing():
            along.recall(self.resumed.earlier, self.resumed.done)
        return along

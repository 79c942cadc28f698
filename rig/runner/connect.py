"""Connects the board and the arm, starts the recording, and hands all of it to a script as one `Rig`."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from firmware_host.client import Board
from rig.arm.driver import Arm
from rig.arm.state import ArmReport
from rig.board.identify import refuse_other_firmware, refusing
from rig.config.load import Loaded
from rig.data.provenance import provenance_of
from rig.data.run_file import RecordedMagnetometer, RecordedSensor, RunRecorder
from rig.data.settings import RunSettings
from rig.plans.phase import Phase
from rig.plans.script_file import ScriptFile
from rig.runner.acquisition import Acquisition
from rig.runner.onboard import BoardCalibration
from rig.runner.procedure import Devices, Recording, Rig
from rig.runner.resumption import Resumption
from rig.runner.sensors import BoardMagnetometer, BoardSensor, set_up_magnetometers, set_up_sensors
from rig.station.events import ArmConnected, BoardConnected, RunResumed
from rig.station.station import Station


@dataclass(frozen=True, slots=True)
class Connector:
    """Opens one phase of a run: what is to be done, by which configuration and script, recorded where, told to whom."""

    phase: Phase
    loaded: Loaded
    settings: RunSettings
    script: ScriptFile
    path: Path
    station: Station
    resumed: Resumption

    @contextmanager
    def open(self) -> Iterator[Rig]:
        """Everything connected and recording, nothing moved yet; on the way out the arm stops and the file is closed.

        Raises `Refused` by name when the arm, the board or a sensor is not what the configuration says, or not what
        was recorded earlier, or has no calibration to correct by.
        """
        whole_plan = self.phase.plan()
        # The board's own calibration needs it of the host after each sweep: to import it takes longer than to use it.
        import scipy.interpolate  # noqa: F401

        if self.resumed.earlier:
            self.station.event(RunResumed(len(self.resumed.done), len(whole_plan.sweeps)))
        acquisition = Acquisition()
        with ExitStack() as stack:
            board, sensors, magnetometers = self._connect_board(stack, acquisition)
            arm, report = self._connect_arm(stack, acquisition)
            recording = self._record(stack, board, sensors, magnetometers, report)
            acquisition.recorder = recording.recorder
            yield Rig(
                devices=Devices(arm, report, self.loaded.config.arm, board, _streaming_corrected(sensors), acquisition),
                plan=self.phase.plan(report.state.q_rad, self.resumed.done),
                whole_plan=whole_plan,
                recording=recording,
                along=self._calibrating_along(board, acquisition, recording, sensors),
                phase=self.phase,
            )

    def _connect_board(
        self, stack: ExitStack, acquisition: Acquisition
    ) -> tuple[Board, Mapping[str, BoardSensor], Mapping[str, BoardMagnetometer]]:
        section = self.loaded.config.board
        with refusing():
            board = stack.enter_context(Board(section.port, section.baud, acquisition.on_samples))
            refuse_other_firmware(board.identity)
            sensors = set_up_sensors(board, self.loaded.config, calibrated=self.phase.procedure.reads_corrected)
            magnetometers = set_up_magnetometers(board, self.loaded.config)
        for name, sensor in sensors.items():
            acquisition.expect(sensor.index, name, sensor.described)
        for name, magnetometer in magnetometers.items():
            acquisition.expect_field(magnetometer.index, name, magnetometer.described)
        self.station.event(BoardConnected(section.port, board.identity))
        return board, sensors, magnetometers

    def _connect_arm(self, stack: ExitStack, acquisition: Acquisition) -> tuple[Arm, ArmReport]:
        section = self.loaded.config.arm
        log = self.path.with_name("arm_client.log")
        arm = stack.enter_context(Arm(section.host, acquisition.on_state, section.state_rate_hz, log))
        report = arm.report()
        self.station.event(ArmConnected(report))
        return arm, report

    def _record(
        self,
        stack: ExitStack,
        board: Board,
        sensors: Mapping[str, BoardSensor],
        magnetometers: Mapping[str, BoardMagnetometer],
        report: ArmReport,
    ) -> Recording:
        described: dict[str, RecordedSensor | RecordedMagnetometer] = {
            **{name: sensor.described for name, sensor in sensors.items()},
            **{name: magnetometer.described for name, magnetometer in magnetometers.items()},
        }
        stored = {name: sensor.stored for name, sensor in sensors.items() if sensor.stored is not None}
        made_with = provenance_of(
            self.loaded,
            board.identity,
            report,
            stored,
            self.script.identity,
            script_installed=self.script.is_installed,
        )
        self.resumed.refuse_other_instruments(made_with, described)
        with refusing():
            recorder = RunRecorder(
                self.path,
                config=self.loaded.rig_text,
                settings=self.settings,
                provenance=made_with,
                sensors=described,
            )
        return Recording(stack.enter_context(recorder), described, self.station, made_with.kinematics)

    def _calibrating_along(
        self, board: Board, acquisition: Acquisition, recording: Recording, sensors: Mapping[str, BoardSensor]
    ) -> BoardCalibration | None:
        """The board's own calibration from raw readings; it is given back what it observed before an interruption."""
        if not self.phase.procedure.calibrates_along:
            return None
        to_calibrate = {name: (sensors[name].index, sensors[name].described) for name in self.settings.to_calibrate}
        along = BoardCalibration(
            board,
            acquisition,
            recording.note,
            self.settings.observation,
            to_calibrate,
            recording.kinematics,
        )
        with refusing():
            along.recall(self.resumed.earlier, self.resumed.done)
        return along


def _streaming_corrected(sensors: Mapping[str, BoardSensor]) -> tuple[int, ...]:
    return tuple(sensor.index for sensor in sensors.values() if sensor.stored is not None)

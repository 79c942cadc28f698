"""Connects the board and the arm, starts the recording, and hands all of it to a procedure as one `Rig`."""

import hashlib
import platform
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from math import radians
from pathlib import Path
from typing import Any

from firmware_host.client import Board, BoardIdentity, Calibration
from firmware_host.protocol import CALIBRATED_RAD_S, FULL_SCALE_COUNTS
from rig import __version__
from rig.arm.driver import Arm
from rig.arm.state import ArmReport
from rig.board.identify import find_sensor, refuse_other_firmware, refusing, stored_calibration
from rig.config.load import Loaded
from rig.config.models import SensorSection, mounting_matrix
from rig.data.run_file import RecordedSensor, RunData, RunRecorder
from rig.data.settings import RunSettings, settings_of
from rig.errors import Refused
from rig.observation.observe import sound_sweeps
from rig.observation.onboard_window import observed_sweeps
from rig.plans.six_sweeps import plan_six_observation
from rig.runner.acquisition import Monitor, SensorCount
from rig.runner.onboard import BoardCalibration
from rig.runner.procedure import Confirm, Rig
from rig.station.view import View


@contextmanager
def open_rig(
    loaded: Loaded,
    recording: Path,
    view: View,
    confirm: Confirm,
    *,
    earlier: Sequence[RunData] = (),
    calibrated: bool = False,
    announced: bool = False,
) -> Iterator[Rig]:
    """Everything connected and recording, nothing moved yet; on the way out the arm stops and the file is closed.

    `earlier` holds the recordings of an interrupted run: the sound sweeps they hold are left out. With `calibrated`
    the sensors to calibrate stream readings that the board has corrected by what it has stored; without, raw ones, and
    the board calibrates along. `announced` as in `Rig`. Raises `Refused` by name when the arm, the board or a sensor
    is not what the configuration says, or not what was recorded earlier, or has no calibration to correct by.
    """
    config = loaded.config
    whole_plan = plan_six_observation(config.arm, config.procedure)
    settings = settings_of(config, whole_plan)
    _refuse_another_procedure(settings, earlier)
    done = frozenset[int]().union(
        *(sound_sweeps(run, settings.observation) & observed_sweeps(run, settings.to_calibrate) for run in earlier)
    )
    if earlier:
        view.line(
            f"resuming: {len(done)} of {len(whole_plan.sweeps)} sweeps are recorded, sound and known to the board"
        )
    with ExitStack() as stack:
        monitor = Monitor()
        with refusing():
            board = stack.enter_context(Board(config.board.port, config.board.baud, monitor.on_samples))
            refuse_other_firmware(board.identity)
            set_up = {name: _set_up(board, name, section) for name, section in config.sensors.items()}
            to_calibrate = {name: set_up[name] for name in config.to_calibrate}
            stored = {}
            if calibrated:
                stored = {name: stored_calibration(board, name, config.sensors[name]) for name in to_calibrate}
                set_up |= {
                    name: (index, _corrected(sensor, stored[name].calibration))
                    for name, (index, sensor) in to_calibrate.items()
                }
            sensors = {name: sensor for name, (_, sensor) in set_up.items()}
            monitor.counts |= {i: SensorCount(name, s.sensitivity_rad_s_per_count) for name, (i, s) in set_up.items()}
        view.line(f"board: {board.identity.unique_id}, firmware {board.identity.firmware} at {config.board.port}")

        client_log = recording.with_name("arm_client.log")
        arm = stack.enter_context(Arm(config.arm.host, monitor.on_state, config.arm.state_rate_hz, client_log))
        report = arm.report()
        view.line(f"arm: serial number {report.serial_number}, PolyScope {report.polyscope} at {report.host}")

        provenance = _provenance(loaded, board.identity, report)
        provenance["stored_calibrations"] = {name: calibration.document() for name, calibration in stored.items()}
        _refuse_other_instruments(provenance, sensors, earlier)
        with refusing():
            recorder = RunRecorder(
                recording, config=loaded.rig_text, settings=settings, provenance=provenance, sensors=sensors
            )
        monitor.recorder = stack.enter_context(recorder)
        on_board = None
        if not calibrated:
            on_board = BoardCalibration(board, monitor, recorder, settings.observation, to_calibrate)
            with refusing():
                on_board.recall(earlier, done)
        yield Rig(
            plan=plan_six_observation(config.arm, config.procedure, report.state.q_rad, done),
            whole_plan=whole_plan,
            report=report,
            payload=config.arm,
            arm=arm,
            board=board,
            recorder=recorder,
            monitor=monitor,
            view=view,
            confirm=confirm,
            calibrated=tuple(index for index, _ in to_calibrate.values()) if calibrated else (),
            on_board=on_board,
            again=config.procedure.then_verify and not calibrated,
            announced=announced,
        )


def _refuse_another_procedure(settings: RunSettings, earlier: Sequence[RunData]) -> None:
    """Sweeps are counted by their place in the procedure, so the rest of a run must be the rest of the same one."""
    for run in earlier:
        if run.settings.movement != settings.movement:
            raise Refused(
                "another_procedure",
                "config.yaml in the run folder describes another procedure or home pose than the recording there",
                "Undo the change in config.yaml, or start a new run with `rig run`",
            )


def _refuse_other_instruments(
    provenance: Mapping[str, Any], sensors: Mapping[str, RecordedSensor], earlier: Sequence[RunData]
) -> None:
    """Readings of two boards, or at two settings, are not one calibration."""
    for run in earlier:
        for key, what in (("board_unique_id", "board"), ("arm_serial_number", "arm")):
            if run.provenance[key] != provenance[key]:
                raise Refused(
                    "another_board" if what == "board" else "another_arm",
                    f"the run was begun with the {what} {run.provenance[key]}, this is {provenance[key]}",
                    f"Connect the {what} the run was begun with, or start a new run with `rig run`",
                )
        if run.sensors != sensors:
            raise Refused(
                "another_sensor",
                "the sensors are not those of the recording, or set up differently",
                "Undo the change in config.yaml, or start a new run with `rig run`",
            )


def _corrected(sensor: RecordedSensor, calibration: Calibration) -> RecordedSensor:
    """The same sensor when the board corrects its readings: a count is then a microradian per second."""
    limit_rad_s = sensor.full_scale_counts * sensor.sensitivity_rad_s_per_count
    both = zip(calibration.scale, calibration.bias_rad_s, strict=True)
    lowest_rad_s = min(k * (limit_rad_s - abs(b)) for k, b in both)  # what a saturated reading becomes, at least
    return replace(
        sensor,
        sensitivity_rad_s_per_count=CALIBRATED_RAD_S,
        full_scale_counts=int(lowest_rad_s / CALIBRATED_RAD_S),
        mode="calibrated",
    )


def _set_up(board: Board, name: str, section: SensorSection) -> tuple[int, RecordedSensor]:
    """Find the sensor on the board and set it up: its index there and its description for the recording."""
    info = find_sensor(board.identity, name, section)
    setup = board.configure(info.index, section.rate_hz, section.range_deg_s)
    return info.index, RecordedSensor(
        part=section.part,
        serial_number=section.serial_number,
        rate_hz=setup.rate_hz,
        range_rad_s=radians(setup.range_deg_s),
        sensitivity_rad_s_per_count=setup.sensitivity_rad_s,
        full_scale_counts=FULL_SCALE_COUNTS,
        temperature_c_per_count=setup.temperature_scale_c,
        temperature_offset_c=setup.temperature_offset_c,
        mounting=tuple(tuple(row) for row in mounting_matrix(section.mounting).tolist()),
    )


def _provenance(loaded: Loaded, board: BoardIdentity, arm: ArmReport) -> dict[str, Any]:
    """What was measured with what: versions, serial numbers, the configuration's hash, the time."""
    return {
        "started_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "rig_version": __version__,
        "python_version": platform.python_version(),
        "package_versions": {name: version(name) for name in ("ur-rtde", "numpy", "h5py", "pyserial")},
        "configuration_sha256": hashlib.sha256(loaded.rig_text.encode()).hexdigest(),
        "arm_serial_number": arm.serial_number,
        "arm_software": arm.polyscope,
        "board_unique_id": board.unique_id,
        "firmware_version": board.firmware,
        "sensor_serial_numbers": {name: section.serial_number for name, section in loaded.config.sensors.items()},
    }

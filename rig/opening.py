"""Connects the board and the arm, starts the recording, and hands all of it to a procedure as one `Rig`."""

import hashlib
import platform
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from math import radians
from pathlib import Path
from typing import Any

from firmware_host.client import Board, BoardIdentity, SensorInfo
from firmware_host.errors import BoardError
from rig import __version__
from rig.arm.driver import Arm
from rig.arm.plan import plan_six_observation
from rig.arm.state import ArmReport
from rig.config.load import Loaded, parse
from rig.config.models import RigConfig, SensorSection, mounting_matrix
from rig.errors import Fault, Refused
from rig.monitor import Monitor, SensorCount
from rig.observation import sound_sweeps
from rig.procedure import Confirm, Rig
from rig.progress import View
from rig.recording import RecordedSensor, RunData, RunRecorder

FULL_SCALE_COUNTS = 32767  # every part the firmware drives reports 16 bits, two's complement


@contextmanager
def open_rig(
    loaded: Loaded, recording: Path, view: View, confirm: Confirm, earlier: Sequence[RunData] = ()
) -> Iterator[Rig]:
    """Everything connected and recording, nothing moved yet; on the way out the arm stops and the file is closed.

    `earlier` holds the recordings of an interrupted run: the sound sweeps they hold are left out. Raises `Refused` by
    name when the arm, the board or a sensor is not what the configuration says, or not what was recorded earlier.
    """
    config = loaded.config
    _refuse_another_procedure(config, earlier)
    done = frozenset[int]().union(*(sound_sweeps(run, config.observation) for run in earlier))
    if earlier:
        view.line(f"resuming: {len(done)} sweeps are recorded and sound, the others follow")
    with ExitStack() as stack:
        monitor = Monitor()
        with refusing():
            board = stack.enter_context(Board(config.board.port, config.board.baud, monitor.on_samples))
            sensors = {name: _set_up(board, name, section, monitor) for name, section in config.sensors.items()}
        view.line(f"board: {board.identity.unique_id}, firmware {board.identity.firmware} at {config.board.port}")

        client_log = recording.with_name("arm_client.log")
        arm = stack.enter_context(Arm(config.arm.host, monitor.on_state, config.arm.state_rate_hz, client_log))
        report = arm.report()
        view.line(f"arm: serial number {report.serial_number}, PolyScope {report.polyscope} at {report.host}")

        provenance = _provenance(loaded, board.identity, report)
        _refuse_other_instruments(provenance, sensors, earlier)
        with refusing():
            recorder = RunRecorder(recording, config=loaded.rig_text, provenance=provenance, sensors=sensors)
        monitor.recorder = stack.enter_context(recorder)
        yield Rig(
            plan=plan_six_observation(config.arm, config.procedure, report.state.q_rad, done),
            whole_plan=plan_six_observation(config.arm, config.procedure),
            report=report,
            payload=config.arm,
            arm=arm,
            board=board,
            recorder=recorder,
            monitor=monitor,
            view=view,
            confirm=confirm,
        )


def _refuse_another_procedure(config: RigConfig, earlier: Sequence[RunData]) -> None:
    """Sweeps are counted by their place in the procedure, so the rest of a run must be the rest of the same one."""
    for run in earlier:
        recorded = parse(run.config, "the recorded configuration").config
        if (recorded.procedure, recorded.arm.home_deg) != (config.procedure, config.arm.home_deg):
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
                    f"another_{what}",
                    f"the run was begun with the {what} {run.provenance[key]}, this is {provenance[key]}",
                    f"Connect the {what} the run was begun with, or start a new run with `rig run`",
                )
        if run.sensors != sensors:
            raise Refused(
                "another_sensor",
                "the sensors are not those of the recording, or set up differently",
                "Undo the change in config.yaml, or start a new run with `rig run`",
            )


@contextmanager
def refusing() -> Iterator[None]:
    """Before anything has moved, what is wrong with the board or the recording is a refusal."""
    try:
        yield
    except (BoardError, Fault) as error:
        raise Refused(error.name, error.what, error.remedy) from error


def find_sensor(identity: BoardIdentity, name: str, section: SensorSection) -> SensorInfo:
    """The board's entry for a configured sensor. Raises Refused `sensor_missing`."""
    # The board names parts as their makers do, the configuration in lower case.
    info = next((sensor for sensor in identity.sensors if sensor.part.lower() == section.part), None)
    if info is not None and info.present:
        return info
    seen = "no driver for it" if info is None else f"identity register reads 0x{info.who_am_i:02x}"
    raise Refused(
        "sensor_missing",
        f"sensors.{name}: the board finds no {section.part} ({seen})",
        "Check the sensor's supply and SPI wires, and sensors.*.part in the configuration",
    )


def _set_up(board: Board, name: str, section: SensorSection, monitor: Monitor) -> RecordedSensor:
    """Find the sensor on the board, set it up, and describe it for the recording."""
    info = find_sensor(board.identity, name, section)
    setup = board.configure(info.index, section.rate_hz, section.range_deg_s)
    monitor.counts[info.index] = SensorCount(name, setup.sensitivity_rad_s)
    return RecordedSensor(
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

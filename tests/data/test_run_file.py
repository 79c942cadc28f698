"""The run file: what goes in comes out, whatever happens to the process that writes it."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from firmware_host.answers import BoardObservation, BoardSolution
from firmware_host.samples import FIELD_SAMPLE_DTYPE, SAMPLE_DTYPE
from rig.config.judging.verdict_limits import Limits
from rig.config.load import load
from rig.data.quantity import FIELD, RATE
from rig.data.recording.channel import thermometer_channel, triad_channel
from rig.data.recording.recorded_events import (
    BoardNotObserved,
    BoardObserved,
    BoardRecalled,
    BoardSolved,
    Event,
    RestFinished,
    RestStarted,
    SweepFinished,
    SweepStarted,
)
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_file import RunRecorder, make_plain, read_run
from rig.data.recording.settings import ObservationThresholds, PlannedSweep, RunSettings, Site, uncertainty_of
from rig.errors import Fault, Refused
from rig.motion.state_rows import ARM_STATE_DTYPE
from rig.motion.steps import Sweep
from rig.motion.turner_state import ArmState
from support.documents.results import VERIFIED
from support.paths import CONFIGS, ROOT
from support.processes.forked import find_fork_server
from support.processes.waiting import PATIENCE_S, wait_for
from support.recordings.synthetic_run import PROVENANCE as SYNTHETIC
from support.recordings.synthetic_run import UR

SENSOR = RecordedSensor(
    part="lsm9ds1",
    serial_number="LSM9DS1-001",
    rate_hz=238.0,
    channels=(triad_channel(RATE, 1.527e-4, 32767, 4.276), thermometer_channel(0.0625, 25.0)),
    mounting=((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
)
SETTINGS = RunSettings(
    procedure="six_observation",
    then_verify=False,
    observation=ObservationThresholds(max_lost_fraction=0.001, max_speed_deviation=0.25, max_axis_deviation_deg=20.0),
    limits=Limits(scale_deviation=0.3, scale_std=0.002, bias_rad_s=0.1, bias_std_rad_s=0.002, condition=100.0),
    to_calibrate=("gyro",),
    reference=None,
    home_q_rad=(0.0, -1.5, 1.5, -1.5, -1.5, 0.0),
    planned_sweeps=(PlannedSweep(0, "wrist_3", "cw", 1.0, 2 * np.pi),),
    site=Site(up=(0.0, 0.0, 1.0), gravity_m_s2=9.81, earth_rate_rad_s=None),
    uncertainty=uncertainty_of(load(CONFIGS / "lsm9ds1_adis16465.yaml").config),
)
SWEEP = Sweep(
    index=0,
    joint=5,
    joint_name="wrist_3",
    direction="cw",
    axis_flange=(0.0, 0.0, -1.0),
    start_q_rad=(0.0, -1.5, 1.5, -1.5, -1.5, 3.6),
    end_q_rad=(0.0, -1.5, 1.5, -1.5, -1.5, -3.6),
    speed_rad_s=1.0,
    acceleration_rad_s2=4.0,
    duration_s=7.6,
    revolution_rad=(-np.pi, np.pi),
)
EVENTS: tuple[Event, ...] = (
    SweepStarted(SWEEP),
    SweepFinished(SWEEP),
    BoardObserved("gyro", 0, 1.001, BoardObservation(0, 1_000_000, 7_000_000, 1400, (0.1, -0.2, -1.0))),
    BoardNotObserved("gyro", 1, "µ " * 400),
    BoardRecalled("gyro", 2),
    BoardSolved("gyro", BoardSolution("closed_form", "solved", 6, 1, (1.1, 1.2, 0.9), (0.01, 0.0, -0.02))),
)
STORED = VERIFIED.provenance.stored_calibrations["gyro"]
CONFIG = "arm: {host: 192.0.2.1}\n# °\n"
PROVENANCE = replace(
    SYNTHETIC,
    script="mine.py",
    script_sha256="0" * 64,
    script_installed=False,
    stored_calibrations={"gyro": STORED},
)
TICK_S = 0.01


def recorder(path: Path, *sensors: str) -> RunRecorder:
    described = dict.fromkeys(sensors or ("gyro",), SENSOR)
    return RunRecorder(path, config=CONFIG, settings=SETTINGS, provenance=PROVENANCE, turner=UR, sensors=described)


def some_samples(first: int, count: int) -> np.ndarray[Any, Any]:
    samples = np.zeros(count, SAMPLE_DTYPE)
    samples["sequence"] = np.arange(first, first + count)
    samples["board_time_us"] = 2**40 + samples["sequence"].astype("u8") * 4202
    samples["host_time_s"] = time.monotonic()
    samples["counts"] = samples["sequence"][:, None] * [1, -2, 3]
    samples["temperature_counts"] = -48
    return samples


def test_a_magnetometer_comes_back_beside_the_gyroscopes(tmp_path: Path) -> None:
    """Equal in all that is known of it: a run that is gone on with asks whether it is the same."""
    path = tmp_path / "run.h5"
    field = triad_channel(FIELD, 1.4e-8, 32767, 4e-4)
    compass = RecordedSensor("lsm9ds1_magnetometer", "M1", 80.0, (field,), SENSOR.mounting)
    samples = np.zeros(300, FIELD_SAMPLE_DTYPE)
    samples["sequence"] = np.arange(300)
    samples["host_time_s"] = time.monotonic()
    samples["field_counts"] = samples["sequence"][:, None] * [1, -2, 3]
    sensors = {"gyro": SENSOR, "compass": compass}
    with RunRecorder(
        path, config=CONFIG, settings=SETTINGS, provenance=PROVENANCE, turner=UR, sensors=sensors
    ) as recording:
        recording.add_samples("compass", samples)
        recording.add_samples("gyro", some_samples(0, 10))
    run = read_run(path)
    assert run.sensors == {"gyro": SENSOR, "compass": compass} and run.measuring(FIELD) == {"compass": compass}
    np.testing.assert_array_equal(run.samples["compass"], samples)


def some_state(number: int) -> ArmState:
    q = tuple(0.001 * number + joint for joint in range(6))
    return ArmState(100 + number * 0.002, time.monotonic(), q, (0.1,) * 6, 1.0, 0.99, 7, 1, 2, 3, 1)


def test_everything_comes_back_as_it_was_added(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with recorder(path, "gyro", "reference") as recording:
        recording.add(RestStarted())
        recording.add_samples("gyro", some_samples(0, 3000))
        recording.add_samples("reference", some_samples(7, 5))
        states = [some_state(number) for number in range(1200)]
        for state in states:
            recording.add_state(state)
        for event in EVENTS:
            recording.add(event)
        recording.add(RestFinished(), controller_time_s=123.5)
        recording.check()
    run = read_run(path)
    assert (run.config, run.settings, run.provenance) == (CONFIG, SETTINGS, PROVENANCE)
    assert run.sensors == {"gyro": SENSOR, "reference": SENSOR}
    np.testing.assert_array_equal(run.samples["gyro"]["counts"], some_samples(0, 3000)["counts"])
    assert run.samples["reference"]["board_time_us"][0] == 2**40 + 7 * 4202
    np.testing.assert_array_equal(run.states, np.array([state.to_record() for state in states], ARM_STATE_DTYPE))
    assert [recorded.event for recorded in run.events] == [RestStarted(), *EVENTS, RestFinished()]
    started, *others, finished = run.events
    assert started.controller_time_s is None
    assert {other.controller_time_s for other in others} == {states[-1].time_s}  # the arm's time when it happened
    assert finished.controller_time_s == 123.5
    with h5py.File(path, "r") as file:  # any HDF5 tool opens it
        assert file.attrs["schema"] == "rig.run/1"


@pytest.mark.slow
def test_a_run_can_be_read_while_it_is_written(tmp_path: Path) -> None:
    with recorder(tmp_path / "run.h5") as recording:
        recording.add_samples("gyro", some_samples(0, 10))
        wait_for(lambda: len(read_run(tmp_path / "run.h5").samples["gyro"]) == 10, "the samples")


def test_an_old_recording_is_never_overwritten(tmp_path: Path) -> None:
    recorder(tmp_path / "run.h5").close()
    with pytest.raises(Fault, match=r"recording_failed.*there already"):
        recorder(tmp_path / "run.h5")
    with pytest.raises(Fault, match="recording_failed"):
        recorder(tmp_path / "no such folder" / "run.h5")


@pytest.mark.parametrize("content", [b"", b"\x89HDF\r\n\x1a\nrubbish", b"a,b,c\n1,2,3\n"])
def test_what_is_not_a_run_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "run.h5"
    with pytest.raises(Refused, match="no_run_file"):
        read_run(path)
    path.write_bytes(content)
    with pytest.raises(Refused, match="not_a_run_file"):
        read_run(path)


def test_a_pipe_is_no_run_file_and_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "run.h5")
    with pytest.raises(Refused, match=r"no_run_file.*is not a regular file"):
        read_run(tmp_path / "run.h5")


def test_another_schema_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    recorder(path).close()
    with h5py.File(path, "r+") as file:
        file.attrs["schema"] = "rig.run/9"
    with pytest.raises(Refused, match=r"not_a_run_file.*rig\.run/9"):
        read_run(path)


def record_until_killed(path: Path, report: Connection) -> None:
    """What a run writes, at a run's pace: 500 states and 1000 samples a second; tells the pipe how far it is."""
    recording = recorder(path)
    tick = 0
    while True:
        recording.add_samples("gyro", some_samples(10 * tick, 10))
        for number in range(5 * tick, 5 * tick + 5):
            recording.add_state(some_state(number))
        recording.add(BoardRecalled("gyro", tick))
        tick += 1
        report.send((time.monotonic(), tick))
        time.sleep(TICK_S)  # no catching up: on a busy machine its own second is longer than the clock's


def reports(pipe: Connection) -> list[tuple[float, int]]:
    """All that was said before the end."""
    said = []
    try:
        while True:
            said.append(pipe.recv())
    except EOFError:
        return said


@pytest.mark.slow
@pytest.mark.proof
def test_a_killed_run_opens_and_holds_all_but_the_last_second(tmp_path: Path, thorough: bool) -> None:
    processes = find_fork_server()
    lives = np.random.default_rng(50).uniform(0.0, 2.5, 48 if thorough else 3)
    for batch, batch_lives in enumerate(np.array_split(lives, max(1, len(lives) // 6))):
        writers = []
        for number in range(len(batch_lives)):
            ours, theirs = processes.Pipe(duplex=False)
            path = tmp_path / f"{batch}-{number}.h5"
            process = processes.Process(target=record_until_killed, args=(path, theirs))
            process.start()
            theirs.close()
            writers.append((process, ours, path))
        for _, pipe, _ in writers:
            assert pipe.poll(PATIENCE_S)  # it writes
        begun = time.monotonic()
        killed = {}
        for life, (process, _, path) in sorted(zip(batch_lives, writers, strict=True), key=lambda pair: pair[0]):
            time.sleep(max(0.0, begun + life - time.monotonic()))
            process.kill()
            killed[path] = time.monotonic()
        for process, pipe, path in writers:
            process.join()
            assert process.exitcode == -signal.SIGKILL
            said = reports(pipe)
            by_the_clock = max((tick for said_s, tick in said if said_s < killed[path] - 1), default=0)
            handed_over = max(0, min(by_the_clock, max(tick for _, tick in said) - round(1 / TICK_S)))
            check_killed(path, handed_over)
            process.close()
            pipe.close()
    make_plain(path)  # pyrefly: ignore[unbound-name]  # of the last writer
    with h5py.File(path, "r") as file:
        assert len(file["states"]) >= 5 * handed_over  # pyrefly: ignore[unbound-name]  # of the last writer


def check_killed(path: Path, ticks: int) -> None:
    """The file opens, begins at the beginning, has no hole, and reaches as far as it must."""
    run = read_run(path)
    samples, arm = run.samples["gyro"], run.states
    assert len(samples) >= 10 * ticks
    assert len(arm) >= 5 * ticks
    assert len(run.events) >= ticks
    np.testing.assert_array_equal(samples["sequence"], np.arange(len(samples)))
    np.testing.assert_array_equal(samples["counts"], np.arange(len(samples))[:, None] * [1, -2, 3])
    np.testing.assert_allclose(arm["time_s"], 100 + 0.002 * np.arange(len(arm)))
    expected = [BoardRecalled("gyro", tick) for tick in range(len(run.events))]
    assert [recorded.event for recorded in run.events] == expected


FULL_DISK = """
import json, resource, signal, sys, time
from pathlib import Path
sys.path.insert(0, {tests!r})
from data.test_run_file import recorder, some_samples
from rig.errors import Fault
recording, added = recorder(Path({path!r})), 0
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, resource.RLIM_INFINITY))  # as a full disk: no byte beyond
while True:
    recording.add_samples("gyro", some_samples(added, 100))
    added += 100
    try:
        recording.check()
    except Fault as fault:
        print(json.dumps([fault.name, fault.what, added]))
        break
    time.sleep(0.005)
try:
    recording.close()
except Fault as fault:
    sys.exit(fault.exit_status)
"""


@pytest.mark.slow
def test_a_full_disk_is_a_named_fault_and_keeps_what_was_written(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    script = FULL_DISK.format(tests=str(ROOT / "tests"), path=str(path))
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert (done.returncode, done.stderr) == (3, "")  # no crash, no noise from the library
    name, what, added = json.loads(done.stdout)
    assert name == "recording_failed"
    assert "File too large" in what
    kept = read_run(path).samples["gyro"]
    assert 0 < len(kept) <= added
    np.testing.assert_array_equal(kept["sequence"], np.arange(len(kept)))


def test_a_torn_end_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with recorder(path) as recording:
        recording.add_samples("gyro", some_samples(0, 50))
        recording.add(RestStarted())
    with h5py.File(path, "r+") as file:
        samples, events = file["samples/gyro"], file["events"]
        samples.resize((60,))  # rows that were announced and never written
        events.resize((len(events) + 20,))
        events[-20:-10] = np.frombuffer(b'{"name": "', "u1")
    run = read_run(path)
    assert len(run.samples["gyro"]) == 49  # the last row before the hole may be half a row
    assert [recorded.event for recorded in run.events] == [RestStarted()]

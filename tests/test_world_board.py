"""The emulated board in the simulated laboratory: it feels the arm, deterministically, over a port like a real one."""

import hashlib
import math
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DEMO, World

from firmware_host import protocol
from firmware_host.client import Board, SampleBatch
from firmware_host.errors import BoardError
from rig.arm.kinematics import flange_rate
from rig.config.load import Loaded, load
from rig.config.models import mounting_matrix
from rig.world.clock import TICKS_PER_SECOND
from rig.world.laboratory import Laboratory
from rig.world.serial_line import SerialLine, misread

COUNT_RAD_S = math.radians(8.75e-3)


@dataclass
class Host:
    """A host written out in ticks: it asks the board in process, so every byte has its moment."""

    laboratory: Laboratory
    line: SerialLine
    received: bytearray

    def ask(self, name: str, sequence: int, values: dict[str, Any] | None = None) -> None:
        self.line.to_board(protocol.encode(name, sequence, values), None)

    def ticks(self, count: int) -> None:
        for _ in range(count):
            self.laboratory.step()
            self.line.tick()
            self.received += self.line.to_host(None)

    def samples(self) -> np.ndarray:
        """(n, 3) counts of every sample received so far."""
        frames = protocol.FrameReader().feed(bytes(self.received))
        batches = [frame.items["counts"] for frame in frames if frame.name == "samples"]
        return np.concatenate(batches)


def host(loaded: Loaded) -> Host:
    """A laboratory whose board streams."""
    assert loaded.world is not None
    laboratory = Laboratory(loaded.config, loaded.world)
    new = Host(laboratory, SerialLine(laboratory), bytearray())
    new.ticks(200)
    new.ask("configure", 1, {"sensor": 0, "rate_hz": 238.0, "range_deg_s": 245.0})
    new.ticks(20)
    new.ask("start", 2, {"sensors": 0})
    new.ticks(20)
    return new


def demo(*overrides: str) -> Loaded:
    return load(DEMO, overrides)


def digest_of_a_run(loaded: Loaded) -> tuple[str, tuple[float, ...]]:
    one = host(loaded)
    one.laboratory.robot.motion.move((0.1, -1.4, 1.5, -1.5, -1.2, 2.0), 1.0, 1.4)
    one.ticks(700)
    one.laboratory.robot.protective_stop()
    one.ticks(300)
    assert len(one.samples()) > 400
    return hashlib.sha256(one.received).hexdigest(), one.laboratory.robot.motion.q_rad


def test_the_same_seed_and_inputs_give_the_same_bytes_and_states() -> None:
    first, again, other = (digest_of_a_run(demo(f"world.seed={seed}")) for seed in (5, 5, 6))
    assert first == again
    assert first[0] != other[0]


def test_the_sensor_reads_the_flanges_rate_through_its_mounting_and_its_errors() -> None:
    """A wrist 2 turn: counts must be (axis rate / k − b) in the sensor's axes, g = K (m + b)."""
    loaded = demo(
        "world.arm.vibration_fraction=0",
        "world.sensors.gyro.mounting_error_deg=[0, 0, 90]",
        "world.sensors.gyro.noise_rad_s=0",
        "sensors.gyro.mounting={x: +z, y: -y, z: +x}",
    )
    one = host(loaded)
    motion = one.laboratory.robot.motion
    motion.speed((0.0, 0.0, 0.0, 0.0, 0.7, 0.0), 100.0)
    one.ticks(TICKS_PER_SECOND)
    nominal = mounting_matrix(loaded.config.sensors["gyro"].mounting) @ flange_rate(motion.q_rad, motion.qd_rad_s)
    seen = np.array([nominal[1], -nominal[0], nominal[2]])  # a quarter turn about the sensor's own z
    assert loaded.world is not None
    truth = loaded.world.sensors["gyro"]
    expected = seen / np.array(truth.scale) - np.array(truth.bias_rad_s)
    assert one.samples()[-1] * COUNT_RAD_S == pytest.approx(expected, abs=COUNT_RAD_S)
    assert abs(expected).max() > 0.5


def test_vibration_is_felt_and_averages_out_over_a_turn() -> None:
    one = host(demo("world.sensors.gyro.noise_rad_s=0", "world.sensors.gyro.mounting_error_deg=[0, 0, 0]"))
    one.laboratory.robot.motion.speed((0.0, 0.0, 0.0, 0.0, 0.0, 1.0), 100.0)
    one.ticks(TICKS_PER_SECOND // 10)
    before = len(one.samples())
    one.ticks(round(2 * math.pi * TICKS_PER_SECOND))
    z = one.samples()[before : before + round(2 * math.pi * 238.0), 2] * COUNT_RAD_S
    assert z.std() == pytest.approx(0.05 / 1.1440, rel=0.02)
    assert z.mean() == pytest.approx(1.0 / 1.1440 + 0.0051, abs=2e-4)


@pytest.mark.parametrize("ratio", [0.98, 1.0, 1.02])
def test_a_small_baud_difference_is_harmless(ratio: float) -> None:
    assert misread(bytes(range(256)), 115200 * ratio, 115200) == bytes(range(256))


@pytest.mark.parametrize(("sent", "read"), [(921600, 115200), (115200, 921600), (921600, 460800)])
def test_a_wrong_baud_rate_spoils_every_frame(sent: float, read: float) -> None:
    frames = b"".join(protocol.encode("hello", i) for i in range(1, 50))
    seen = misread(frames, sent, read)
    assert seen and seen != frames
    assert not protocol.FrameReader().feed(seen)


def connect(port: str, baud: int = 921600, timeout_s: float = 1.0) -> tuple[Board, list[SampleBatch]]:
    batches: list[SampleBatch] = []
    return Board(port, baud, batches.append, timeout_s), batches


def stream(board: Board, batches: Sequence[SampleBatch], samples: int) -> None:
    """Configure, start, and wait for so many samples."""
    board.configure(0, 238.0, 245.0)
    board.start()
    end = time.monotonic() + 10.0
    while sum(len(batch.samples) for batch in batches) < samples:
        board.check()
        assert time.monotonic() < end, "no samples"
        time.sleep(0.005)


def test_the_board_streams_over_tcp_and_takes_the_next_client(world: World) -> None:
    running = world()
    board, batches = connect(running.board_port)
    with board:
        assert board.identity.unique_id == "0123456789abcdef01234567"
        stream(board, batches, 200)
        with pytest.raises(BoardError):  # one client at a time
            connect(running.board_port, timeout_s=0.3)
        board.check()
    board, batches = connect(running.board_port)
    with board:
        stream(board, batches, 200)


def test_unplugging_loses_the_link_and_plugging_in_boots_afresh(world: World) -> None:
    running = world()
    board, batches = connect(running.board_port)
    with board:
        stream(board, batches, 100)
        running.control({"do": "unplug_board"})
        with pytest.raises(BoardError, match="board_link_lost"):
            watch(board)
    with pytest.raises(BoardError, match="no_port"):
        connect(running.board_port)
    running.control({"do": "plug_in_board"})
    board, batches = connect(running.board_port)
    with board:
        assert board.identity.reset_cause == "power"
        stream(board, batches, 100)


def watch(board: Board, limit_s: float = 5.0) -> None:
    """Check until the board's fault shows."""
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        board.check()
        time.sleep(0.005)


def test_a_silent_line_is_noticed(world: World) -> None:
    running = world()
    board, batches = connect(running.board_port, timeout_s=0.5)
    with board:
        stream(board, batches, 100)
        running.control({"do": "silence_board", "on": True})
        with pytest.raises(BoardError, match="board_link_lost"):
            watch(board)
        running.control({"do": "silence_board", "on": False})


def test_a_wrong_baud_rate_is_named(world: World) -> None:
    running = world()
    running.control({"do": "host_baud", "baud": 115200})
    with pytest.raises(BoardError, match="wrong_baud_rate"):
        connect(running.board_port)
    running.control({"do": "host_baud", "baud": None})
    board, _ = connect(running.board_port)
    board.close()


def test_the_reset_button(world: World) -> None:
    running = world()
    board, batches = connect(running.board_port)
    with board:
        stream(board, batches, 100)
    running.control({"do": "reset_board"})
    board, _ = connect(running.board_port)
    with board:
        assert board.identity.reset_cause == "pin"


def test_the_pseudo_terminal_is_a_port_like_any_other(world: World) -> None:
    running = world({"world": {"board": {"pty": True}}})
    assert running.pty is not None and Path(running.pty).exists()
    board, batches = connect(running.pty)
    with board:
        stream(board, batches, 200)
    with pytest.raises(BoardError, match="wrong_baud_rate"):
        connect(running.pty, baud=115200)
    board, batches = connect(running.pty)
    with board:
        stream(board, batches, 50)


def test_arm_and_board_run_on_one_clock(world: World) -> None:
    """So many virtual seconds by the controller's time stamp are so many by the board's counter, 541 ppm apart."""
    running = world()
    board, batches = connect(running.board_port)
    with board:
        stream(board, batches, 10)
        running.control({"do": "hold"})
        start, uptime = running.state()["time_s"], board_time(batches)
        running.control({"do": "advance", "duration_s": 2.0})
        passed = running.state()["time_s"] - start
        elapsed = board_time(batches) - uptime
        running.control({"do": "run"})
    assert passed == pytest.approx(2.0)
    assert elapsed == pytest.approx(2.0 * (1 - 541e-6), abs=1.5 / 238 * 8)  # samples come in batches


def board_time(batches: Sequence[SampleBatch]) -> float:
    """The board's time of the newest sample."""
    count = -1
    while count != len(batches):  # the clock is held: once no batch comes, none is under way
        count = len(batches)
        time.sleep(0.05)
    return float(batches[-1].samples["board_time_us"][-1]) * 1e-6


def test_a_host_that_does_not_read_does_not_stop_the_world(world: World) -> None:
    running = world()
    host_name, port = running.board_port.removeprefix("socket://").split(":")
    with socket.create_connection((host_name, int(port)), 5.0) as idle:
        idle.sendall(protocol.encode("configure", 1, {"sensor": 0, "rate_hz": 952.0, "range_deg_s": 245.0}))
        idle.sendall(protocol.encode("start", 2, {"sensors": 0}))
        before = running.state()["time_s"]
        time.sleep(0.5)  # at 952 Hz and ten times real time this fills every buffer on the way
        assert running.state()["time_s"] > before + 1.0

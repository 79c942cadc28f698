"""The emulated board in the simulated laboratory: it feels the arm, deterministically, over a port like a real one."""

import hashlib
import math
import socket
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from firmware_host.client import Board, SampleBatch
from firmware_host.emulator.chip.flash_memory import DOUBLEWORD_BYTES, PAGE_BYTES, STORE_OFFSET
from firmware_host.errors import BoardError
from firmware_host.frames import FrameReader, encode
from rig.config.load import Loaded
from rig.config.sensors.sensor_sections import mounting_matrix
from rig.errors import Refused
from rig.motion.geometry import flange_rate
from rig.world.board.flash_file import open_flash
from rig.world.board.mounted_board import read_firmware
from rig.world.board.serial_line import misread
from rig.world.clock import TICKS_PER_SECOND
from rig.world.world_section import read_world_section
from support.laboratories.ideal import ideal
from support.laboratories.laboratory_host import Host, boot, host
from support.laboratories.worlds import World, WorldHandle
from support.paths import DEMO
from support.processes.waiting import wait_for, wait_for_error

pytestmark = pytest.mark.slow

COUNT_RAD_S = math.radians(8.75e-3)
PAIR = DEMO.with_name("mpu9250_adis16465.yaml")
STILL = "world.arm.joints=ideal"


def demo(*overrides: str) -> Loaded:
    return ideal(DEMO, overrides)


def pair(*overrides: str) -> Loaded:
    """A gyroscope to calibrate and a reference, on one bus."""
    return ideal(PAIR, overrides)


def digest_of_a_run(loaded: Loaded) -> tuple[str, tuple[float, ...]]:
    one = host(loaded)
    one.laboratory.robot.motion.move((0.1, -1.4, 1.5, -1.5, -1.2, 2.0), 1.0, 1.4)
    one.ticks(700)
    one.laboratory.robot.protective_stop()
    one.ticks(300)
    assert len(one.received) > 5_000
    return hashlib.sha256(one.received).hexdigest(), one.laboratory.robot.motion.q_rad


def test_the_same_seed_and_inputs_give_the_same_bytes_and_states() -> None:
    first, again, other = (digest_of_a_run(demo(f"world.seed={seed}")) for seed in (5, 5, 6))
    assert first == again
    assert first[0] != other[0]


def test_the_sensor_reads_the_flanges_rate_through_its_mounting_and_its_errors() -> None:
    """A wrist 2 turn: counts must be (axis rate / k − b) in the sensor's axes, g = K (m + b)."""
    loaded = demo(
        "world.arm.joints=ideal",
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
    truth = read_world_section(loaded).sensors["gyro"]
    expected = seen / np.array(truth.scale) - np.array(truth.bias_rad_s)
    assert one.samples()[-1] * COUNT_RAD_S == pytest.approx(expected, abs=COUNT_RAD_S)
    assert abs(expected).max() > 0.5


@pytest.mark.thorough
def test_every_sensor_has_its_own_mounting_errors_and_noise() -> None:
    def turned(*overrides: str) -> Host:
        one = host(pair(STILL, "world.sensors.gyro.mounting_error_deg=[0, 0, 90]", *overrides))
        one.laboratory.robot.motion.speed((0.0, 0.0, 0.0, 0.0, 0.7, 0.0), 100.0)
        one.ticks(TICKS_PER_SECOND)
        return one

    quiet = turned("world.sensors.gyro.noise_rad_s=0", "world.sensors.reference.noise_rad_s=0")
    loaded = pair("world.sensors.gyro.mounting_error_deg=[0, 0, 90]")
    motion = quiet.laboratory.robot.motion
    flange = np.array(flange_rate(motion.q_rad, motion.qd_rad_s))
    for name, index, count_rad_s in (("gyro", 1, 1 / 131), ("reference", 2, 1 / 40)):
        truth = read_world_section(loaded).sensors[name]
        error = Rotation.from_rotvec(truth.mounting_error_deg, degrees=True).as_matrix()
        seen = error.T @ mounting_matrix(loaded.config.sensors[name].mounting) @ flange
        x, y, z = np.radians(truth.non_orthogonality_deg)
        axes = np.array([[1, 0, 0], [x, 1, 0], [y, z, 1]])  # to first order
        expected = axes @ seen / np.array(truth.scale) - np.array(truth.bias_rad_s)
        assert np.radians(quiet.samples(index)[-1] * count_rad_s) == pytest.approx(expected, abs=6e-4)
    noisy = turned("world.sensors.gyro.noise_rad_s=0.05", "world.sensors.reference.noise_rad_s=0.05")
    last = [np.radians(noisy.samples(index)[-50:] * c) for index, c in ((1, 1 / 131), (2, 1 / 40))]
    assert np.all(np.abs(np.corrcoef(np.column_stack(last).T) - np.eye(6)) < 0.6)


@pytest.mark.thorough
def test_two_sensors_too_give_the_same_bytes_from_the_same_seed() -> None:
    first, again, other = (digest_of_a_run(pair(f"world.seed={seed}")) for seed in (5, 5, 6))
    assert first == again
    assert first[0] != other[0]


CALIBRATION = {
    "sensor": 1,
    "model": 1,
    "serial_number": "MPU-1",
    "written_unix_s": 1_790_000_000,
    "temperature_c": 22.0,
    "matrix": ((1.25, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.75)),
    "bias_rad_s": (0.5, 0.25, 0.125),
    "lowest_c": 22.0,
    "highest_c": 22.0,
    "scale_change": ((0.0, 0.0, 0.0),) * 3,
    "bias_change_rad_s": ((0.0, 0.0, 0.0),) * 3,
}


def give_calibration(one: Host) -> None:
    assert (
        one.answer(
            "configure", {"sensor": 1, "rate_hz": 200.0, "range_deg_s": 250.0, "range_g": 0, "range_gauss": 0}
        ).name
        == "setup"
    )
    assert one.answer("write_calibration", CALIBRATION).name == "ack"


def stored_scale(one: Host) -> tuple[float, ...] | None:
    answer = one.answer("read_calibration", {"sensor": 1})
    if answer.name != "calibration":
        return None
    return tuple(row[axis] for axis, row in enumerate(answer.values["matrix"]))


def test_without_power_the_board_keeps_its_calibration_but_without_a_file_not_for_the_next_world() -> None:
    one = boot(pair())
    assert stored_scale(one) is None
    give_calibration(one)
    one.laboratory.unplug()
    one.ticks(10)
    one.laboratory.plug_in()
    one.ticks(200)
    assert stored_scale(one) == (1.25, 1.0, 0.75)
    assert stored_scale(boot(pair())) is None


def test_a_flash_file_keeps_the_calibration_for_the_next_world_but_never_the_program(tmp_path: Path) -> None:
    file = tmp_path / "board.bin"
    kept = pair(f"world.board.flash_file={file}")
    give_calibration(boot(kept))
    assert stored_scale(boot(kept)) == (1.25, 1.0, 0.75)
    data = file.read_bytes()
    assert data.startswith(read_firmware("bin"))
    file.write_bytes(data[:8] + bytes(STORE_OFFSET - 8) + data[STORE_OFFSET:])  # another program, long ago
    assert stored_scale(boot(kept)) == (1.25, 1.0, 0.75)


def test_a_flash_file_keeps_what_a_power_cut_tore(tmp_path: Path) -> None:
    kept = pair(f"world.board.flash_file={tmp_path / 'board.bin'}")
    one = boot(kept)
    one.answer("configure", {"sensor": 1, "rate_hz": 200.0, "range_deg_s": 250.0, "range_g": 0, "range_gauss": 0})
    one.ask("write_calibration", 9, CALIBRATION)
    one.ticks(5)  # the erasing takes eleven
    again = open_flash(tmp_path / "board.bin")
    assert len(again.torn) == PAGE_BYTES // DOUBLEWORD_BYTES
    assert stored_scale(boot(kept)) is None


@pytest.mark.parametrize("name", ["short.bin", "nowhere/board.bin"])
def test_a_flash_file_that_cannot_be_is_refused(name: str, tmp_path: Path) -> None:
    (tmp_path / "short.bin").write_bytes(b"short")
    with pytest.raises(Refused, match="flash_file"):
        boot(pair(f"world.board.flash_file={tmp_path / name}"))


@pytest.mark.thorough
def test_vibration_is_felt_and_averages_out_over_a_turn() -> None:
    exact = ("world.sensors.gyro.noise_rad_s=0", "world.sensors.gyro.mounting_error_deg=[0, 0, 0]")
    one = host(demo("world.arm.vibration_fraction=0.05", *exact))
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
    frames = b"".join(encode("hello", i) for i in range(1, 50))
    seen = misread(frames, sent, read)
    assert seen and seen != frames
    assert not FrameReader().feed(seen)


READS = 10  # of a port, that bring nothing


def connect(port: str, baud: int = 921600, timeout_s: float = 1.0) -> tuple[Board, list[SampleBatch]]:
    batches: list[SampleBatch] = []
    return Board(port, baud, batches.append, timeout_s), batches


def stream(board: Board, batches: Sequence[SampleBatch], samples: int) -> None:
    """Configure, start, and wait for so many samples."""
    board.configure(0, 238.0, 245.0)
    board.start()
    wait_for(lambda: sum(len(batch.samples) for batch in batches) >= samples, "samples", meanwhile=board.check)


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
        assert wait_for_error(BoardError, board.check).name == "board_link_lost"
    with pytest.raises(BoardError, match="no_port"):
        connect(running.board_port)
    running.control({"do": "plug_in_board"})
    board, batches = connect(running.board_port)
    with board:
        assert board.identity.reset_cause == "power"
        stream(board, batches, 100)


def test_a_silent_line_is_noticed(world: World) -> None:
    running = world()
    board, batches = connect(running.board_port)
    with board:
        board.configure(0, 238.0, 245.0)
        board.start()
        wait_for(lambda: batches, "samples")  # a busy computer may be silent for as long: nobody looks yet
        running.control({"do": "silence_board", "on": True})
        assert wait_for_error(BoardError, board.check).name == "board_link_lost"
        running.control({"do": "silence_board", "on": False})


def test_a_wrong_baud_rate_is_named(world: World) -> None:
    running = world()
    running.control({"do": "host_baud", "baud": 115200})
    with pytest.raises(BoardError, match="wrong_baud_rate"):
        connect(running.board_port)
    running.control({"do": "host_baud", "baud": None})
    board, _ = connect(running.board_port)
    board.close()


def test_a_sensor_can_be_broken_and_mended(world: World) -> None:
    running = world()
    running.control({"do": "sensor_fault", "sensor": "gyro", "fault": "absent"})
    board, batches = connect(running.board_port)
    with board:
        with pytest.raises(BoardError, match="sensor_absent"):
            board.configure(0, 238.0, 245.0)
        running.control({"do": "unplug_board"})  # it stays broken without power
    running.control({"do": "plug_in_board"})
    board, batches = connect(running.board_port)
    with board:
        with pytest.raises(BoardError, match="sensor_absent"):
            board.configure(0, 238.0, 245.0)
        running.control({"do": "sensor_fault", "sensor": "gyro", "fault": "other_part"})
        with pytest.raises(BoardError, match="sensor_mismatch"):
            board.configure(0, 238.0, 245.0)
        running.control({"do": "sensor_fault", "sensor": "gyro", "fault": None})
        stream(board, batches, 100)
    for wrong in ({"sensor": "giro", "fault": None}, {"sensor": "gyro", "fault": "tired"}):
        with pytest.raises(AssertionError, match="sensor_fault"):
            running.control({"do": "sensor_fault", **wrong})


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
        start, uptime = running.state()["time_s"], newest_s(running, board, batches)
        running.control({"do": "advance", "duration_s": 2.0})
        passed = running.state()["time_s"] - start
        elapsed = newest_s(running, board, batches) - uptime
        running.control({"do": "run"})
    assert passed == pytest.approx(2.0)
    assert elapsed == pytest.approx(2.0 * (1 - 541e-6), abs=1.5 / 238 * 8)  # samples come in batches


def newest_s(running: WorldHandle, board: Board, batches: Sequence[SampleBatch]) -> float:
    """The board's time of the newest sample, while the clock is held."""
    for _ in range(2):  # the world has come round, and sent what was due
        running.state()
    reads = board._link._reads_without_frame
    wait_for(lambda: board._link._reads_without_frame >= reads + READS, "that nothing is under way")
    return float(batches[-1].samples["board_time_us"][-1]) * 1e-6


def test_a_host_that_does_not_read_does_not_stop_the_world(world: World) -> None:
    running = world()
    host_name, port = running.board_port.removeprefix("socket://").split(":")
    with socket.create_connection((host_name, int(port)), 5.0) as idle:
        idle.sendall(
            encode(
                "configure", 1, {"sensor": 0, "rate_hz": 952.0, "range_deg_s": 245.0, "range_g": 0, "range_gauss": 0}
            )
        )
        idle.sendall(encode("start", 2, {"sensors": 0}))
        before = running.state()["time_s"]
        wait_for(lambda: running.state()["time_s"] > before + 10.0, "what fills every buffer on the way, and more")


def test_a_sensor_that_is_saturated_stuck_or_silent(world: World) -> None:
    running = world()
    board, batches = connect(running.board_port)

    def counts() -> np.ndarray:
        batches.clear()
        wait_for(lambda: len(batches) > 30, "readings")
        return np.concatenate([batch.samples["counts"] for batch in batches[5:]])

    with board:
        stream(board, batches, 100)
        running.control({"do": "sensor_fault", "sensor": "gyro", "fault": "saturated"})
        assert np.abs(counts()).min() >= 32_000
        running.control({"do": "sensor_fault", "sensor": "gyro", "fault": "stuck"})
        assert np.abs(counts().mean(axis=0)).max() < 500
        running.control({"do": "sensor_fault", "sensor": "gyro", "fault": "silent"})
        with pytest.raises(BoardError, match="sensor_silent"):
            wait_for(lambda: board.check(running.state()["time_s"]), "its silence")

"""The host's client over real sockets and a real pseudo-terminal; at the far end answers the firmware's core."""

import os
import re
import select
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime
from zlib import crc32

import numpy as np
import pytest
from cobs import cobs

from firmware_host import protocol
from firmware_host.client import Board, Calibration, SampleBatch, StoredPolynomials
from firmware_host.errors import BoardError
from firmware_host.frames import FrameReader, decode, encode
from firmware_host.parts import BOARD_PARTS, MAGNETOMETERS
from firmware_host.samples import IMU_SAMPLE_DTYPE, SAMPLE_DTYPE
from firmware_host.serial_port import SerialPort
from rig.config.procedures.procedure_sections import ThermalSection
from rig.config.sensors.link_budget import LinkLoad
from rig.errors import Refused
from rig.plans.motions.temperature_course import TemperatureCourse
from rig.runner.acquisition import Acquisition
from rig.runner.warming import Warming
from support.board.host_board import HostBoard, configure, convert, settle
from support.laboratories.worlds import fresh_host
from support.processes.waiting import PATIENCE_S, wait_for, wait_for_error

PERIOD_US = 4202  # 238 Hz
HOST = fresh_host()


class BoardOnAWire(threading.Thread):
    """The core in real time behind a file descriptor: what a UART, or an emulator, would be."""

    def __init__(self, connect: Callable[[], int]) -> None:
        super().__init__(daemon=True)
        self.board = HostBoard()
        self.board.gyro.values[0x10] = 0
        self.on_send: Callable[[bytes], bytes] = bytes  # what the wire does to the bytes
        self.hold = threading.Event()  # set: the board stands still
        self.reset = threading.Event()
        self._connect = connect
        self._over = threading.Event()

    def run(self) -> None:
        fd = self._connect()
        start_s = time.monotonic()
        converted = 0
        while not self._over.is_set():
            readable = select.select([fd], [], [], 0.002)[0]
            if self.hold.is_set():
                continue
            if self.reset.is_set():
                self.reset.clear()
                self.board.core.board_reset()
            # Its time passes no conversion that is due, however late this thread is: a part is not silent for that.
            now_us = min(int((time.monotonic() - start_s) * 1e6), (converted + 1) * PERIOD_US)
            try:
                self.board.set_time(now_us)
                self.board.receive(os.read(fd, 4096) if readable else b"")
                while (converted + 1) * PERIOD_US <= now_us:
                    converted += 1
                    if self.board.gyro.values[0x10]:
                        self.board.gyro.convert((converted % 1000, -converted % 1000, 7), -48, (converted % 500, -5, 6))
                        self.board.data_ready(converted * PERIOD_US)
                        self.board.run()
                os.write(fd, self.on_send(bytes(self.board.wire)))
                self.board.wire.clear()
            except OSError:  # the client has gone
                return

    def finish(self) -> None:
        self._over.set()
        self.join()


@pytest.fixture(params=["socket", "pty"])
def wire(request: pytest.FixtureRequest) -> Iterator[tuple[BoardOnAWire, str]]:
    """A board at the far end, and the name of the port that leads to it."""
    if request.param == "pty":
        master, slave = os.openpty()
        board = BoardOnAWire(lambda: master)
        board.start()
        yield board, os.ttyname(slave)
        board.finish()
        os.close(master)
        os.close(slave)
        return
    with socket.create_server((HOST, 0)) as server:
        server.settimeout(PATIENCE_S)
        connections: list[socket.socket] = []

        def accept() -> int:
            connections.append(server.accept()[0])
            return connections[0].fileno()

        board = BoardOnAWire(accept)
        board.start()
        yield board, f"socket://{HOST}:{server.getsockname()[1]}"
        board.finish()
        for connection in connections:
            connection.close()


ON_ONE_WIRE = pytest.mark.parametrize(
    "wire", ["pty"], indirect=True
)  # where it does not matter what the wire is made of


def ignore(batch: SampleBatch) -> None:
    """A consumer for tests that look at something else."""


@pytest.mark.slow
def test_a_board_is_greeted_set_up_streams_and_stops(wire: tuple[BoardOnAWire, str]) -> None:
    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append) as board:
        assert board.identity.unique_id == "0123456789abcdef01234567"
        assert [(s.part, s.who_am_i, s.present, s.quantity) for s in board.identity.sensors] == [
            (part.name, part.who_am_i, True, "field" if name in MAGNETOMETERS else "rate")
            for name, part in BOARD_PARTS.items()
        ]
        setup = board.configure(0, rate_hz=200, range_deg_s=245)
        assert (setup.rate_hz, setup.range_deg_s) == (238.0, 245.0)
        board.start()
        wait_for(lambda: sum(len(batch.samples) for batch in batches) >= 100, "samples")
        board.check()
        assert board.status().streaming
        board.stop()
        status = board.status()
        samples = np.concatenate([batch.samples for batch in batches])
        time.sleep(0.05)
        assert len(samples) == sum(len(batch.samples) for batch in batches), "samples after stop had returned"

    assert samples["sequence"].tolist() == list(range(len(samples)))
    assert set(np.diff(samples["board_time_us"]).tolist()) == {PERIOD_US}
    assert (samples["counts"][:, 2] == 7).all() and (samples["temperature_counts"] == -48).all()
    assert (np.diff(samples["counts"][:, 0]) % 1000 == 1).all()
    assert (np.diff(samples["host_time_s"]) >= 0).all()
    assert {(batch.sensor, batch.mode, batch.dropped) for batch in batches} == {(0, "raw", 0)}
    assert status.sensors[0].samples == status.sensors[0].conversions == len(samples)
    assert not status.streaming and status.rx_errors == 0


@pytest.mark.slow
def test_a_stream_left_running_is_stopped_by_the_next_program_and_restarts_at_zero(
    wire: tuple[BoardOnAWire, str],
) -> None:
    board = wire[0].board
    board.receive(
        encode("configure", 1, {"sensor": 0, "rate_hz": 238, "range_deg_s": 245, "range_g": 0, "range_gauss": 0})
    )
    board.receive(encode("start", 2, {"sensors": 0}))
    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append) as client:
        assert batches == [] and not client.status().streaming
        client.start()
        wait_for(lambda: len(batches) > 0, "samples")
    assert batches[0].samples["sequence"][0] == 0


@pytest.mark.slow
@ON_ONE_WIRE
def test_a_lossy_wire_costs_frames_but_no_request(wire: tuple[BoardOnAWire, str]) -> None:
    garbled = [0]

    def garble_the_first(data: bytes) -> bytes:
        if data and garbled[0] < 3:
            garbled[0] += 1
            return b"\x01" + data[1:]
        return data

    wire[0].on_send = garble_the_first
    with Board(wire[1], protocol.BAUD_RATE, ignore, timeout_s=2.0) as board:
        assert garbled[0] == 3
        assert board.configure(0, 238, 245).rate_hz == 238.0


def test_the_boards_refusals_come_through_by_name(wire: tuple[BoardOnAWire, str]) -> None:
    with Board(wire[1], protocol.BAUD_RATE, ignore) as board:
        with pytest.raises(BoardError, match="bad_range") as refusal:
            board.configure(0, 238, 5000)
        assert refusal.value.name == "bad_range" and "of its LSM9DS1" in refusal.value.what
        assert "range_deg_s" in refusal.value.remedy
        with pytest.raises(BoardError, match="not_configured"):
            board.start()
        board.check()


CALIBRATION = Calibration(
    model="k_times_m_plus_b",
    serial_number="LSM9DS1-001",
    written_utc=datetime(2026, 11, 21, 12, 0, 0, 987654, UTC),
    temperature_c=22.7,
    matrix=((1.1771, 0.0, 0.0), (0.0, 1.1554, 0.0), (0.0, 0.0, 1.1440)),
    bias_rad_s=(0.0077, -0.0100, -0.0051),
)


OVER_TEMPERATURE = replace(
    CALIBRATION,
    polynomials=StoredPolynomials(
        (15.0, 62.5),
        ((3e-4, -2e-4, 2e-4), (2e-6, 1e-6, -1e-6), (0.0, 0.0, 0.0)),
        ((5e-4, -4e-4, 3e-4), (5e-6, 3e-6, -4e-6), (1e-8, 0.0, 0.0)),
    ),
)


@ON_ONE_WIRE
def test_polynomials_over_temperature_are_stored_with_a_calibration(wire: tuple[BoardOnAWire, str]) -> None:
    with Board(wire[1], protocol.BAUD_RATE, ignore) as board:
        board.configure(0, 238, 245)
        board.write_calibration(0, OVER_TEMPERATURE)
        stored = board.read_calibration(0)
        assert stored is not None and stored.calibration == OVER_TEMPERATURE.quantize()
        told = stored.document()["over_temperature"]
        assert told["range_c"] == (15.0, 62.5) and told["scale_change"][0] == pytest.approx((3e-4, -2e-4, 2e-4))
        board.write_calibration(0, CALIBRATION)
        stored = board.read_calibration(0)
        assert stored is not None and stored.calibration == CALIBRATION.quantize()
        assert stored.calibration.polynomials is None and stored.document()["over_temperature"] is None


@ON_ONE_WIRE
def test_a_stored_calibration_is_there_after_a_reset_until_it_is_erased(wire: tuple[BoardOnAWire, str]) -> None:
    with Board(wire[1], protocol.BAUD_RATE, ignore) as board:
        assert board.read_calibration(0) is None
        with pytest.raises(BoardError) as refusal:
            board.write_calibration(0, CALIBRATION)
        assert refusal.value.name == "not_configured"
        board.configure(0, 238, 245)
        with pytest.raises(BoardError) as refusal:
            board.start(calibrated=[0])
        assert refusal.value.name == "no_calibration" and "of its LSM9DS1" in refusal.value.what

        board.write_calibration(0, CALIBRATION)
        board.reboot()
        stored = board.read_calibration(0)
        assert stored is not None and stored.calibration == CALIBRATION.quantize()
        assert (stored.sequence, stored.part, stored.who_am_i, stored.range_deg_s) == (1, "LSM9DS1", 0x68, 245)
        assert stored.calibration.written_utc.microsecond == 0
        assert stored.calibration.scale == pytest.approx(CALIBRATION.scale, rel=1e-7)

        board.erase_calibration(0)
        assert board.read_calibration(0) is None
        board.erase_calibration(0)


@pytest.mark.slow
@ON_ONE_WIRE
def test_accelerations_come_along_where_a_range_is_asked_for_and_not_in_a_calibrated_stream(
    wire: tuple[BoardOnAWire, str],
) -> None:
    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append) as board:
        setup = board.configure(0, 238, 245, range_g=3)
        assert setup.range_m_s2 == pytest.approx(4 * 9.80665)
        assert setup.sensitivity_m_s2 == pytest.approx(0.122e-3 * 9.80665)
        board.start()
        wait_for(lambda: sum(len(batch.samples) for batch in batches) >= 30, "samples")
        board.stop()
        samples = np.concatenate([batch.samples for batch in batches])
        assert samples.dtype == IMU_SAMPLE_DTYPE
        assert samples["sequence"].tolist() == list(range(len(samples)))
        assert {batch.mode for batch in batches} == {"raw"}
        x, y, z = samples["acceleration_counts"].T
        assert (x == samples["counts"][:, 0] % 500).all(), "of the same conversion"
        assert set(y.tolist()) == {-5} and set(z.tolist()) == {6}

        board.write_calibration(0, CALIBRATION)
        batches.clear()
        board.start(calibrated=[0])
        wait_for(lambda: len(batches) > 0, "samples")
        board.stop()
        assert batches[0].samples.dtype == SAMPLE_DTYPE and batches[0].mode == "calibrated"

        setup = board.configure(0, 238, 245)
        assert (setup.range_m_s2, setup.sensitivity_m_s2) == (0.0, 0.0)
        batches.clear()
        board.start()
        wait_for(lambda: len(batches) > 0, "samples")
        board.stop()
        assert batches[0].samples.dtype == SAMPLE_DTYPE and batches[0].mode == "raw"


@pytest.mark.slow
@ON_ONE_WIRE
def test_calibrated_readings_come_in_microradians_per_second(wire: tuple[BoardOnAWire, str]) -> None:
    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append) as board:
        sensitivity = board.configure(0, 238, 245).sensitivity_rad_s
        board.write_calibration(0, CALIBRATION)
        board.start(calibrated=[0])
        wait_for(lambda: len(batches) > 0, "samples")
        board.stop()
    assert {batch.mode for batch in batches} == {"calibrated"}
    z_rad_s = CALIBRATION.scale[2] * (7 * sensitivity + CALIBRATION.bias_rad_s[2])
    assert batches[0].samples["counts"][:, 2] == pytest.approx(z_rad_s * 1e6, abs=1.0)


@pytest.mark.slow
@ON_ONE_WIRE
def test_what_was_kept_is_averaged_between_two_board_times(wire: tuple[BoardOnAWire, str]) -> None:
    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append) as board:
        sensitivity = board.configure(0, 238, 245).sensitivity_rad_s
        board.start()
        wait_for(lambda: len(batches) > 0, "samples")
        with pytest.raises(BoardError) as refusal:
            board.observe(0, 0, 0, 1_000_000, speed_rad_s=1.0)
        assert refusal.value.name == "not_kept"
        board.keep([0], duration_s=2)
        first = len(batches)
        wait_for(lambda: len(batches) > first + 8, "samples")
        samples = np.concatenate([batch.samples for batch in batches[first + 1 : first + 6]])
        start_us, end_us = (int(samples["board_time_us"][i]) for i in (0, -1))
        observed = board.observe(0, 0, start_us, end_us, speed_rad_s=1.0)
        assert board.observe(0, 0, start_us, end_us, speed_rad_s=1.0) == observed
        with pytest.raises(BoardError) as refusal:
            board.observe(0, 2, start_us, end_us, speed_rad_s=1.0)
        assert refusal.value.name == "bad_observation"
        assert board.solve(0).status == "too_few_observations"

    used = (samples["board_time_us"] >= observed.start_us) & (samples["board_time_us"] < observed.end_us)
    assert start_us <= observed.start_us < observed.end_us <= end_us and observed.samples == used.sum() > 10
    mean_rad_s = samples["counts"][used].mean(axis=0) * sensitivity
    assert np.array(observed.mean_rad_s) == pytest.approx(mean_rad_s, rel=1e-6)


@ON_ONE_WIRE
@pytest.mark.parametrize("method", protocol.METHODS)
def test_the_board_solves_what_it_is_reminded_of(wire: tuple[BoardOnAWire, str], method: str) -> None:
    scale, bias, speed = np.array(CALIBRATION.scale), np.array(CALIBRATION.bias_rad_s), 1.0472
    with Board(wire[1], protocol.BAUD_RATE, ignore) as board:
        board.configure(0, 238, 245)
        for index, direction in enumerate([*np.eye(3), *-np.eye(3)]):
            mean_rad_s = speed * direction / scale - bias
            assert board.recall(0, index, mean_rad_s.tolist(), speed).index == index
        solution = board.solve(0, method)
    assert (solution.status, solution.method, solution.observations) == ("solved", method, 6)
    assert np.array(solution.scale) == pytest.approx(scale, rel=1e-5)
    assert np.array(solution.bias_rad_s) == pytest.approx(bias, abs=1e-5)


def test_reboot_returns_when_the_board_answers_again(wire: tuple[BoardOnAWire, str]) -> None:
    with Board(wire[1], protocol.BAUD_RATE, ignore) as board:
        board.configure(0, 238, 245)
        board.start()
        board.reboot()
        assert wire[0].board.restarts == 1
        board.check()
        assert not board.status().streaming


@pytest.mark.parametrize("calibrated", [False, True])
@pytest.mark.parametrize("rate_hz", [59.5, 238, 952])
def test_a_stream_takes_as_much_of_the_link_as_the_configuration_reckons_with(rate_hz: float, calibrated: bool) -> None:
    board, conversions = HostBoard(), 400
    configure(board, 0, rate_hz, 245)
    board.ask("write_calibration", sensor=0, **CALIBRATION.values())
    board.ask("start", sensors=int(calibrated))
    settle(board)
    for number in range(conversions):
        convert(board, round((number + 1) * 1e6 / rate_hz), (-number, 2 * number, 12345))
    bytes_per_sample = len(board.wire) / conversions
    reckoned = LinkLoad(rate_hz, calibrated).bytes_per_sample
    assert 0.9 * reckoned < bytes_per_sample <= reckoned


def test_a_port_that_is_not_there() -> None:
    for port in (f"socket://{HOST}:1", "/dev/no-such-port", "nonsense://x"):
        with pytest.raises(BoardError) as failure:
            Board(port, protocol.BAUD_RATE, ignore)
        assert failure.value.name == "no_port" and failure.value.what.count(port) == 1
        assert ("this computer has" in failure.value.what) == port.startswith("/dev/")
        assert "Errno" not in failure.value.what


@pytest.mark.slow
@pytest.mark.usefixtures("no_crowd")
def test_a_port_without_a_board(wire: tuple[BoardOnAWire, str]) -> None:
    wire[0].hold.set()
    with pytest.raises(BoardError) as failure:
        Board(wire[1], protocol.BAUD_RATE, ignore, timeout_s=0.3)
    assert failure.value.name == "no_board" and "rig board flash" in failure.value.remedy


@pytest.mark.slow
@ON_ONE_WIRE
@pytest.mark.usefixtures("no_crowd")
def test_another_baud_rate_makes_noise_of_an_idle_board(wire: tuple[BoardOnAWire, str]) -> None:
    wire[0].on_send = lambda data: bytes(byte >> 1 | 0x80 for byte in data)
    with pytest.raises(BoardError) as failure:
        Board(wire[1], 115200, ignore, timeout_s=0.7)
    assert failure.value.name == "wrong_baud_rate" and "921600" in failure.value.remedy


@pytest.mark.slow
@ON_ONE_WIRE
@pytest.mark.usefixtures("no_crowd")
def test_a_board_that_sends_but_does_not_hear(wire: tuple[BoardOnAWire, str]) -> None:
    wire[0].board.receive = lambda data: wire[0].board.run()  # pyrefly: ignore[method-assign]  # a stand-in
    with pytest.raises(BoardError, match="does not answer") as failure:
        Board(wire[1], protocol.BAUD_RATE, ignore, timeout_s=0.7)
    assert failure.value.name == "no_board"


@pytest.mark.slow
@ON_ONE_WIRE
@pytest.mark.parametrize("crowded", [1.0, 1e9])
def test_a_board_that_answers_late_is_lost_unless_the_computer_is_crowded(
    monkeypatch: pytest.MonkeyPatch, wire: tuple[BoardOnAWire, str], crowded: float
) -> None:
    monkeypatch.setattr("firmware_host.computer_load.load_factor", lambda: crowded)
    board = wire[0].board
    receive, heard = board.receive, bytearray()

    def overhear(data: bytes) -> None:
        heard.extend(data)
        receive(data if heard.count(0) >= 2 * 5 else b"")  # a frame begins and ends with a zero; four are usual

    board.receive = overhear  # pyrefly: ignore[method-assign]  # a stand-in
    if crowded > 1.0:
        Board(wire[1], protocol.BAUD_RATE, ignore, timeout_s=0.1).close()
        return
    with pytest.raises(BoardError, match="no_board"):
        Board(wire[1], protocol.BAUD_RATE, ignore, timeout_s=0.1)


@pytest.mark.slow
def test_frames_lost_on_the_way_are_counted_and_a_reboot_loses_none(wire: tuple[BoardOnAWire, str]) -> None:
    lost: list[bytes] = []

    def losing(data: bytes) -> bytes:
        if len(lost) < 3 and data:
            lost.extend(data.split(b"\0")[:-1])
            return b""
        return data

    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append) as board:
        board.configure(0, rate_hz=238, range_deg_s=245)
        board.start()
        wait_for(lambda: len(batches) >= 2, "samples")
        wire[0].on_send = losing
        wait_for(lambda: len(lost) >= 3, "losses")
        received = len(batches)
        wait_for(lambda: len(batches) >= received + 2, "samples")
        board.stop()
        assert board.status().frames_lost == len(lost)
        sequences = np.concatenate([batch.samples["sequence"] for batch in batches])
        frames = [decode(block) for block in lost]
        assert sequences[-1] + 1 - len(sequences) == sum(len(frame.items) for frame in frames if frame is not None)
        board.reboot()
        assert board.status().frames_lost == len(lost)


def doubling(share: float, seed: int) -> tuple[Callable[[bytes], bytes], list[int]]:
    """A wire that delivers this share of its frames twice, alone or with those before; and how many those were."""
    random, doubled = np.random.default_rng(seed), [0]

    def twice(data: bytes) -> bytes:
        frames = [block + b"\0" for block in data.split(b"\0")[:-1]]
        arriving = b""
        for number, frame in enumerate(frames):
            arriving += frame
            if random.random() < share:
                again = frames[max(0, number - 2) : number + 1]
                doubled[0] += len(again)
                arriving += b"".join(again)
        return arriving

    return twice, doubled


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize("share", [0.05, 1.0])
def test_frames_that_come_twice_are_taken_once_and_counted(wire: tuple[BoardOnAWire, str], share: float) -> None:
    wire[0].on_send, doubled = doubling(share, seed=1)
    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append) as board:
        board.configure(0, rate_hz=238, range_deg_s=245)
        board.start()
        wait_for(lambda: sum(len(batch.samples) for batch in batches) >= 200 and doubled[0] > 0, "samples")
        board.check()
        board.stop()
        wire[0].on_send = bytes
        status = board.status()
    samples = np.concatenate([batch.samples for batch in batches])
    assert samples["sequence"].tolist() == list(range(len(samples)))
    assert (np.diff(samples["board_time_us"].astype(np.int64)) == PERIOD_US).all(), "no clock went back"
    assert status.sensors[0].samples == len(samples)
    assert (status.frames_lost, status.frames_repeated) == (0, doubled[0])


@pytest.mark.slow
@ON_ONE_WIRE
def test_bytes_that_come_twice_cost_the_frames_they_damage_and_no_others(wire: tuple[BoardOnAWire, str]) -> None:
    random = np.random.default_rng(2)
    sent, arrived = bytearray(), bytearray()

    def twice(data: bytes) -> bytes:
        sent.extend(data)
        if data and random.random() < 0.5:
            begin, end = sorted(random.integers(0, len(data) + 1, 2).tolist())
            data = data[:end] + data[begin:]
        elif data and random.random() < 0.2:
            data += data
        arrived.extend(data)
        return data

    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append, timeout_s=4.0) as board:
        board.configure(0, rate_hz=238, range_deg_s=245)
        board.start()
        wire[0].on_send = twice
        wait_for(lambda: sent.count(0) >= 40, "what was sent")
        wire[0].on_send = bytes
        board.check()
        board.stop()
        status = board.status()
    blocks, seen = bytes(sent).split(b"\0")[:-1], bytes(arrived).split(b"\0")
    lost = [decode(block) for block in blocks if block not in seen]
    assert status.frames_lost == len(lost) > 0
    assert status.frames_repeated == sum(seen.count(block) - 1 for block in blocks if block in seen) > 0
    sequences = np.concatenate([batch.samples["sequence"] for batch in batches]).tolist()
    assert sequences == sorted(set(sequences))
    assert sequences[-1] + 1 - len(sequences) == sum(len(frame.items) for frame in lost if frame is not None)


@pytest.mark.slow
def test_a_board_that_restarts_is_reported_where_every_frame_comes_twice(wire: tuple[BoardOnAWire, str]) -> None:
    wire[0].on_send, _ = doubling(1.0, seed=3)
    with closing(streaming(wire)) as board:
        board.check()
        wire[0].reset.set()
        error = wait_for_error(BoardError, board.check)
    assert error.name == "board_error" and "restarted" in error.what


@ON_ONE_WIRE
def test_an_image_of_another_protocol_version(wire: tuple[BoardOnAWire, str]) -> None:
    def another_version(data: bytes) -> bytes:
        out = b""
        for block in data.split(b"\0")[:-1]:
            body = bytearray(cobs.decode(block)[:-4])
            if body[0] == 2:
                body[3] += 1
            out += cobs.encode(bytes(body) + crc32(body).to_bytes(4, "little")) + b"\0"
        return out

    wire[0].on_send = another_version
    with pytest.raises(BoardError) as failure:
        Board(wire[1], protocol.BAUD_RATE, ignore)
    assert failure.value.name == "version_mismatch" and "rig board flash" in failure.value.remedy


def streaming(wire: tuple[BoardOnAWire, str]) -> Board:
    board = Board(wire[1], protocol.BAUD_RATE, ignore)
    board.configure(0, 238, 245)
    board.start()
    return board


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.usefixtures("no_crowd")
def test_a_board_that_falls_silent_while_streaming_is_noticed_after_two_seconds(wire: tuple[BoardOnAWire, str]) -> None:
    with closing(streaming(wire)) as board:
        board.check()
        wire[0].hold.set()
        error = wait_for_error(BoardError, board.check)
    assert error.name == "board_link_lost" and re.search(r" for [2-9]\.\d s", error.what), error


@pytest.mark.slow
@ON_ONE_WIRE
def test_a_board_that_falls_silent_while_streaming_is_not_lost_on_a_computer_that_is_crowded_enough(
    monkeypatch: pytest.MonkeyPatch, wire: tuple[BoardOnAWire, str]
) -> None:
    monkeypatch.setattr("firmware_host.computer_load.load_factor", lambda: 1e9)
    with Board(wire[1], protocol.BAUD_RATE, ignore, timeout_s=0.1) as board:
        board.configure(0, 238, 245)
        board.start()
        wire[0].hold.set()
        end_s = time.monotonic() + 0.5
        while time.monotonic() < end_s:
            board.check()
        wire[0].hold.clear()


@pytest.mark.slow
@ON_ONE_WIRE
@pytest.mark.usefixtures("no_crowd")
def test_noise_instead_of_frames_while_streaming_is_a_lost_link(wire: tuple[BoardOnAWire, str]) -> None:
    with closing(streaming(wire)) as board:
        wire[0].on_send = lambda data: bytes(byte >> 1 | 0x80 for byte in data)
        error = wait_for_error(BoardError, board.check)
    assert error.name == "board_link_lost" and "no readable frame" in error.what


def test_a_closed_socket_is_noticed_as_such() -> None:
    with socket.create_server((HOST, 0)) as server:
        server.settimeout(PATIENCE_S)
        accepted: list[socket.socket] = []

        def accept() -> int:
            accepted.append(server.accept()[0])
            return accepted[0].fileno()

        far_end = BoardOnAWire(accept)
        far_end.start()
        with closing(streaming((far_end, f"socket://{HOST}:{server.getsockname()[1]}"))) as board:
            far_end.finish()
            accepted[0].close()
            error = wait_for_error(BoardError, board.check)
            assert error.name == "board_link_lost" and "no readable frame" not in error.what, "it waited for a silence"
            with pytest.raises(BoardError, match="board_link_lost"):
                board.status()


@pytest.mark.slow
def test_a_board_that_restarts_while_streaming_is_reported(wire: tuple[BoardOnAWire, str]) -> None:
    with closing(streaming(wire)) as board:
        wire[0].reset.set()
        error = wait_for_error(BoardError, board.check)
    assert error.name == "board_error" and "restarted" in error.what


def test_a_board_that_restarts_and_is_asked_before_it_says_so_is_reported(wire: tuple[BoardOnAWire, str]) -> None:
    with closing(streaming(wire)) as board:
        board.keep([0], duration_s=1)
        wire[0].reset.set()
        wait_for(lambda: not wire[0].reset.is_set(), "the reset")
        with pytest.raises(BoardError, match="restarted while streaming"):
            board.observe(0, 0, 0, 1_000_000, speed_rad_s=1.0)
        with pytest.raises(BoardError, match="restarted while streaming"):  # known from then on, whatever it is asked
            board.check()


def test_a_sensor_that_was_never_configured_is_no_restart(wire: tuple[BoardOnAWire, str]) -> None:
    with closing(streaming(wire)) as board:
        with pytest.raises(BoardError) as refusal:
            board.keep([1], duration_s=1)
        assert refusal.value.name == "not_configured"
        board.check()


def test_what_came_before_the_port_closed_is_read() -> None:
    with socket.create_server((HOST, 0)) as server:
        port = SerialPort(f"socket://{HOST}:{server.getsockname()[1]}", protocol.BAUD_RATE)
        far_end, _ = server.accept()
        far_end.sendall(bytes(range(100)))
        far_end.close()
        assert port.read() == bytes(range(100))
        with pytest.raises(OSError):
            port.read()
        port.close()


@pytest.mark.slow
def test_a_sensor_that_falls_silent_is_reported(wire: tuple[BoardOnAWire, str]) -> None:
    with closing(streaming(wire)) as board:
        wire[0].board.gyro.values[0x10] = 0  # powered down behind the board's back: no more data-ready
        error = wait_for_error(BoardError, board.check)
    assert error.name == "sensor_silent" and "LSM9DS1" in error.what


@pytest.mark.slow
@ON_ONE_WIRE
def test_an_error_in_the_consumer_reaches_the_caller(wire: tuple[BoardOnAWire, str]) -> None:
    def broken(batch: SampleBatch) -> None:
        raise OSError("the disk is full")

    with Board(wire[1], protocol.BAUD_RATE, broken) as board:
        board.configure(0, 238, 245)
        board.start()

        def failed() -> bool:
            try:
                board.check()
            except OSError:
                return True
            return False

        wait_for(failed, "the failure")


@pytest.mark.slow
def test_an_answer_to_somebody_before_is_none_to_the_first_request() -> None:
    """Every program's first request has the same number, and a cable's buffer keeps what nobody has read."""
    identity = {"firmware": "1", "unique_id": bytes(12), "reset_cause": 1, "protocol": protocol.PROTOCOL_VERSION}
    left_over = encode(
        "setup",
        7,
        {
            "reply_to": 1,
            "sensor": 0,
            **dict.fromkeys((field.name for field in protocol.MESSAGE_BY_NAME["setup"].fields[2:]), 0.0),
        },
    )
    with socket.create_server((HOST, 0)) as server:

        def answer() -> None:
            client, _ = server.accept()
            with client:
                client.recv(4096)
                client.sendall(left_over)
                client.recv(4096)  # it asks again
                client.sendall(encode("identity", 8, {"reply_to": 1, **identity}))
                client.recv(4096)
                client.sendall(encode("ack", 9, {"reply_to": 2}))
                client.recv(4096)

        answering = threading.Thread(target=answer)
        answering.start()
        with Board(f"socket://{HOST}:{server.getsockname()[1]}", protocol.BAUD_RATE, lambda batch: None) as client:
            assert client.identity.firmware == "1"
        answering.join()


# The heater


@ON_ONE_WIRE
def test_the_heater_is_read_and_set(wire: tuple[BoardOnAWire, str]) -> None:
    with Board(wire[1], protocol.BAUD_RATE, ignore) as board:
        assert board.heat(0.5).cause == "no_thermometer", "nothing streams yet"
        board.configure(0, 238, 245)
        board.start()
        wait_for(lambda: board.heat(0.5).cause == "on", "a heater that is on")
        assert board.heat(0.5).power == pytest.approx(0.5, abs=0.01)
        assert board.heat(0.5).temperature_c == pytest.approx(22.0)
        board.keep_heating(0.25)
        told = pytest.approx(0.25, abs=0.01)
        wait_for(lambda: board.heating is not None and board.heating.power == told, "another power")
        assert board.heat(0.0).cause == "not_wanted"


@ON_ONE_WIRE
def test_a_board_that_knows_no_heater_is_refused_by_name(wire: tuple[BoardOnAWire, str]) -> None:
    def older(data: bytes) -> bytes:
        frames = FrameReader().feed(data)
        if not [frame for frame in frames if frame.name == "heating"]:
            return data
        (heating,) = [frame for frame in frames if frame.name == "heating"]
        return encode("error", 0, {"reply_to": heating.values["reply_to"], "code": 1, "sensor": 0})

    wire[0].on_send = older
    section = ThermalSection(from_c=20, to_c=40, heater_power=1)
    with Board(wire[1], protocol.BAUD_RATE, ignore) as board:
        warming = Warming(section, Acquisition(), print, (), board, 40.0, TemperatureCourse(20, 40, 5, True))
        with pytest.raises(Refused, match="of the board does not support a heater") as refused:
            warming.prepare()
    assert refused.value.name == "no_heater"

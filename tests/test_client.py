"""The host's client over real sockets and a real pseudo-terminal; at the far end answers the firmware's core."""

import os
import select
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from zlib import crc32

import numpy as np
import pytest
from cobs import cobs
from conftest import fresh_host
from host_board import HostBoard

from firmware_host import protocol
from firmware_host.client import Board, SampleBatch
from firmware_host.errors import BoardError

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
            now_us = int((time.monotonic() - start_s) * 1e6)
            try:
                self.board.set_time(now_us)
                self.board.receive(os.read(fd, 4096) if readable else b"")
                while (converted + 1) * PERIOD_US <= now_us:
                    converted += 1
                    if self.board.gyro.values[0x10]:
                        self.board.gyro.convert((converted % 1000, -converted % 1000, 7), -48)
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
        server.settimeout(10)
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


def ignore(batch: SampleBatch) -> None:
    """A consumer for tests that look at something else."""


def wait_for(condition: Callable[[], bool], deadline_s: float = 10.0) -> None:
    end_s = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < end_s, "waited in vain"
        time.sleep(0.002)


def fault_of(board: Board, deadline_s: float = 10.0) -> tuple[BoardError, float]:
    """The error that check() raises, and how long it took, s."""
    start_s = time.monotonic()
    while time.monotonic() < start_s + deadline_s:
        try:
            board.check()
        except BoardError as error:
            return error, time.monotonic() - start_s
        time.sleep(0.005)
    raise AssertionError("no fault was noticed")


def test_a_board_is_greeted_set_up_streams_and_stops(wire: tuple[BoardOnAWire, str]) -> None:
    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append) as board:
        assert board.identity.unique_id == "0123456789abcdef01234567"
        assert [(s.part, s.who_am_i, s.present) for s in board.identity.sensors] == [
            ("LSM9DS1", 0x68, True),
            ("MPU-9250", 0x71, True),
            ("ADIS16465", 0x4051, True),
        ]
        setup = board.configure(0, rate_hz=200, range_deg_s=245)
        assert (setup.rate_hz, setup.range_deg_s) == (238.0, 245.0)
        board.start()
        wait_for(lambda: sum(len(batch.samples) for batch in batches) >= 100)
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


def test_a_stream_left_running_is_stopped_by_the_next_program_and_restarts_at_zero(
    wire: tuple[BoardOnAWire, str],
) -> None:
    board = wire[0].board
    board.receive(protocol.encode("configure", 1, {"sensor": 0, "rate_hz": 238, "range_deg_s": 245}))
    board.receive(protocol.encode("start", 2, {"sensors": 0}))
    batches: list[SampleBatch] = []
    with Board(wire[1], protocol.BAUD_RATE, batches.append) as client:
        assert batches == [] and not client.status().streaming
        client.start()
        wait_for(lambda: len(batches) > 0)
    assert batches[0].samples["sequence"][0] == 0


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


def test_reboot_returns_when_the_board_answers_again(wire: tuple[BoardOnAWire, str]) -> None:
    with Board(wire[1], protocol.BAUD_RATE, ignore) as board:
        board.configure(0, 238, 245)
        board.start()
        board.reboot()
        assert wire[0].board.restarts == 1
        board.check()
        assert not board.status().streaming


def test_a_port_that_is_not_there() -> None:
    for port in (f"socket://{HOST}:1", "/dev/no-such-port", "nonsense://x"):
        with pytest.raises(BoardError) as failure:
            Board(port, protocol.BAUD_RATE, ignore)
        assert failure.value.name == "no_port" and port in failure.value.what


def test_a_port_without_a_board(wire: tuple[BoardOnAWire, str]) -> None:
    wire[0].hold.set()
    with pytest.raises(BoardError) as failure:
        Board(wire[1], protocol.BAUD_RATE, ignore)
    assert failure.value.name == "no_board"


def test_another_baud_rate_makes_noise_of_an_idle_board(wire: tuple[BoardOnAWire, str]) -> None:
    wire[0].on_send = lambda data: bytes(byte >> 1 | 0x80 for byte in data)
    with pytest.raises(BoardError) as failure:
        Board(wire[1], 115200, ignore)
    assert failure.value.name == "wrong_baud_rate" and "921600" in failure.value.remedy


def test_a_board_that_sends_but_does_not_hear(wire: tuple[BoardOnAWire, str]) -> None:
    wire[0].board.receive = lambda data: wire[0].board.run()  # type: ignore[method-assign]
    with pytest.raises(BoardError, match="does not answer") as failure:
        Board(wire[1], protocol.BAUD_RATE, ignore)
    assert failure.value.name == "no_board"


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
    assert failure.value.name == "version_mismatch"


def streaming(wire: tuple[BoardOnAWire, str]) -> Board:
    board = Board(wire[1], protocol.BAUD_RATE, ignore)
    board.configure(0, 238, 245)
    board.start()
    return board


def test_a_board_that_falls_silent_while_streaming_is_noticed_within_a_second_and_a_bit(
    wire: tuple[BoardOnAWire, str],
) -> None:
    with closing(streaming(wire)) as board:
        board.check()
        wire[0].hold.set()
        error, after_s = fault_of(board)
    assert error.name == "board_link_lost" and 0.5 < after_s < 2.0


def test_noise_instead_of_frames_while_streaming_is_a_lost_link(wire: tuple[BoardOnAWire, str]) -> None:
    with closing(streaming(wire)) as board:
        wire[0].on_send = lambda data: bytes(byte >> 1 | 0x80 for byte in data)
        error, after_s = fault_of(board)
    assert error.name == "board_link_lost" and after_s < 2.0


def test_a_closed_socket_is_noticed_at_once() -> None:
    with socket.create_server((HOST, 0)) as server:
        server.settimeout(10)
        accepted: list[socket.socket] = []

        def accept() -> int:
            accepted.append(server.accept()[0])
            return accepted[0].fileno()

        far_end = BoardOnAWire(accept)
        far_end.start()
        with closing(streaming((far_end, f"socket://{HOST}:{server.getsockname()[1]}"))) as board:
            far_end.finish()
            accepted[0].close()
            error, after_s = fault_of(board)
            assert error.name == "board_link_lost" and after_s < 0.5
            with pytest.raises(BoardError, match="board_link_lost"):
                board.status()


def test_a_board_that_restarts_while_streaming_is_reported(wire: tuple[BoardOnAWire, str]) -> None:
    with closing(streaming(wire)) as board:
        wire[0].reset.set()
        error, _ = fault_of(board)
    assert error.name == "board_error" and "restarted" in error.what


def test_a_sensor_that_falls_silent_is_reported(wire: tuple[BoardOnAWire, str]) -> None:
    with closing(streaming(wire)) as board:
        wire[0].board.gyro.values[0x10] = 0  # powered down behind the board's back: no more data-ready
        error, _ = fault_of(board)
    assert error.name == "sensor_silent" and "LSM9DS1" in error.what


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

        wait_for(failed)

"""The firmware's core on this machine, undefined behaviour trapped: its requests."""

from zlib import crc32

import pytest
from cobs import cobs
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_host import protocol
from firmware_host.frames import encode
from firmware_host.parts import BOARD_PARTS, MAGNETOMETERS
from support.board.host_board import PERIOD_US, HostBoard, convert, error_of, streaming_board


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


# Requests


@pytest.mark.slow
@settings(max_examples=50)
@given(st.lists(st.integers(1, 30), max_size=10), st.binary(max_size=60).map(lambda noise: noise.replace(b"\0", b"\1")))
def test_a_request_in_pieces_after_noise_is_answered(pieces: list[int], noise: bytes) -> None:
    board = HostBoard()
    stream = noise + b"\0" + encode("hello", 7)
    for piece in pieces:
        board.receive(stream[:piece])
        stream = stream[piece:]
    board.receive(stream)
    (identity,) = board.frames()
    assert identity.name == "identity" and identity.values["reply_to"] == 7


def test_identity_names_board_firmware_and_sensor(board: HostBoard) -> None:
    (identity,) = board.ask("hello")
    assert identity.values["protocol"] == protocol.PROTOCOL_VERSION
    assert protocol.text(identity.values["firmware"]) == protocol.FIRMWARE_VERSION
    assert identity.values["unique_id"].hex() == "0123456789abcdef01234567"
    assert identity.items.tolist() == [
        (part.name.encode(), part.who_am_i, 1, name in MAGNETOMETERS) for name, part in BOARD_PARTS.items()
    ]


def test_a_frame_longer_than_any_request_is_counted_and_the_next_one_answered(board: HostBoard) -> None:
    for _ in range(3):
        board.receive(b"\x22" * 120)
    board.receive(b"\0")
    (report,) = board.ask("status")
    assert report.values["rx_errors"] == 1


@pytest.mark.parametrize("burst", [b"\x22" * 700, encode("reboot", 3) * 40])
def test_a_burst_that_overruns_the_receive_ring_costs_only_itself(board: HostBoard, burst: bytes) -> None:
    for byte in burst:
        board.core.link_byte_received(byte)
    board.run()
    board.receive(b"\0")
    (report,) = board.ask("status")
    assert report.values["rx_errors"] == 1
    assert board.restarts == 0, "what is left in the ring is a mixture"


def test_requests_that_cannot_be_met_are_refused_by_name(board: HostBoard) -> None:
    assert error_of(board.ask("start", sensors=0)) == "not_configured"
    assert error_of(board.ask("start", sensors=1)) == "not_configured"
    assert (
        error_of(
            board.ask("configure", sensor=len(BOARD_PARTS), rate_hz=238, range_deg_s=245, range_g=0, range_gauss=0)
        )
        == "no_such_sensor"
    )
    assert error_of(board.ask("ack", reply_to=0)) == "unknown_message"
    body = bytes((1, 5)) + b"hello takes no payload"
    board.receive(cobs.encode(body + crc32(body).to_bytes(4, "little")) + b"\0")
    assert error_of(board.frames()) == "bad_length"
    streaming = streaming_board()
    assert (
        error_of(streaming.ask("configure", sensor=0, rate_hz=238, range_deg_s=245, range_g=0, range_gauss=0))
        == "busy_streaming"
    )


def test_an_idle_board_names_itself_twice_a_second_and_a_streaming_one_does_not() -> None:
    board = HostBoard()
    for time_ms in range(0, 3001, 50):
        board.set_time(time_ms * 1000)
        board.run()
    assert [(f.name, f.values["reply_to"]) for f in board.frames()] == [("identity", 0)] * 6
    board = streaming_board()
    for k in range(1, 500):
        convert(board, k * PERIOD_US)
    assert {frame.name for frame in board.frames()} == {"samples"}


def test_reboot_waits_until_its_ack_has_left(board: HostBoard) -> None:
    board.line_is_free = False
    board.receive(encode("reboot", 3))
    assert board.restarts == 0
    board.sent()
    board.run()
    assert board.restarts == 1
    assert [(f.name, f.values["reply_to"]) for f in board.frames()] == [("ack", 3)]

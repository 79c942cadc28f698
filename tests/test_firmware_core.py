"""The firmware's core on this machine, undefined behaviour trapped: frames, requests, driver, accounting."""

import ctypes
import math
from zlib import crc32

import pytest
from cobs import cobs
from host_board import CFrame, HostBoard, core
from hypothesis import example, given, settings
from hypothesis import strategies as st

from firmware_host import protocol
from firmware_host.protocol import ERROR_BY_CODE, Frame, encode

PERIOD_US = 4202  # 238 Hz
BATCH_MAX = 18
SETTLING = 8  # conversions thrown away after a configure


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


def streaming_board() -> HostBoard:
    """A board that has just been started at 238 Hz, with nothing on the wire yet."""
    board = HostBoard()
    assert [frame.name for frame in board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245)] == ["setup"]
    assert [frame.name for frame in board.ask("start", sensors=0)] == ["ack"]
    settle(board)
    return board


def settle(board: HostBoard, time_us: int = 0) -> None:
    """The conversions after a configure that are no samples yet."""
    for _ in range(SETTLING):
        convert(board, time_us, (32767, 32767, 32767), late_us=0)


def convert(board: HostBoard, time_us: int, counts: tuple[int, int, int] = (1, -2, 3), late_us: int = 20) -> None:
    """One conversion: the interrupt at `time_us`, the main loop `late_us` after."""
    board.gyro.convert(counts, -48)
    board.data_ready(time_us)
    board.set_time(time_us + late_us)
    board.run()


def error_of(frames: list[Frame]) -> str:
    (frame,) = frames
    assert frame.name == "error"
    return ERROR_BY_CODE[frame.values["code"]].name


def sample_sequences(frames: list[Frame]) -> list[int]:
    return [f.values["sequence"] + i for f in frames if f.name == "samples" for i in range(f.values["count"])]


# Frames against the PyPI package and the standard library


@given(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=protocol.PAYLOAD_MAX))
@example(1, 0, bytes(protocol.PAYLOAD_MAX))
@example(255, 255, b"\xff" * protocol.PAYLOAD_MAX)
def test_an_encoded_frame_is_what_cobs_and_zlib_make(kind: int, sequence: int, payload: bytes) -> None:
    buffer = (ctypes.c_uint8 * len(payload)).from_buffer_copy(payload)
    frame = CFrame(kind, sequence, len(payload), ctypes.cast(buffer, ctypes.POINTER(ctypes.c_uint8)))
    wire = ctypes.create_string_buffer(300)
    size = core().frame_encode(ctypes.byref(frame), wire)
    body = bytes((kind, sequence)) + payload
    assert wire.raw[:size] == cobs.encode(body + crc32(body).to_bytes(4, "little")) + b"\0"


def decode_in_c(block: bytes) -> bytes | None:
    buffer = ctypes.create_string_buffer(block, max(len(block), 1))
    frame = CFrame()
    if not core().frame_decode(buffer, ctypes.c_size_t(len(block)), ctypes.byref(frame)):
        return None
    return bytes((frame.type, frame.sequence)) + ctypes.string_at(frame.payload, frame.size)


@given(st.binary(max_size=260))
def test_noise_decodes_to_nothing(block: bytes) -> None:
    try:
        body = cobs.decode(block)
    except cobs.DecodeError:
        body = b""
    whole = 6 <= len(body) <= protocol.PAYLOAD_MAX + 6 and crc32(body[:-4]).to_bytes(4, "little") == body[-4:]
    expected = body[:-4] if whole else None
    assert decode_in_c(block) == expected


@given(st.binary(min_size=2, max_size=242), st.data())
def test_a_damaged_frame_is_dropped_and_a_sound_one_decodes(body: bytes, data: st.DataObject) -> None:
    block = bytearray(cobs.encode(body + crc32(body).to_bytes(4, "little")))
    assert decode_in_c(bytes(block)) == body
    bit = data.draw(st.integers(0, 8 * len(block) - 1))
    block[bit // 8] ^= 1 << bit % 8
    assert decode_in_c(bytes(block)) is None


# Requests


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
    assert identity.items.tolist() == [(b"LSM9DS1", 0x68, 1), (b"MPU-9250", 0x71, 1), (b"ADIS16465", 0x4051, 1)]


def test_a_frame_longer_than_any_request_is_counted_and_the_next_one_answered(board: HostBoard) -> None:
    for _ in range(3):
        board.receive(b"\x22" * 120)
    board.receive(b"\0")
    (report,) = board.ask("status")
    assert report.values["rx_errors"] == 1


def test_a_burst_that_overruns_the_receive_ring_costs_only_itself(board: HostBoard) -> None:
    for byte in b"\x22" * 700:
        board.core.link_byte_received(byte)
    board.run()
    board.receive(b"\0")
    (report,) = board.ask("status")
    assert report.values["rx_errors"] == 1


def test_requests_that_cannot_be_met_are_refused_by_name(board: HostBoard) -> None:
    assert error_of(board.ask("start", sensors=0)) == "not_configured"
    assert error_of(board.ask("start", sensors=1)) == "no_calibration"
    assert error_of(board.ask("configure", sensor=3, rate_hz=238, range_deg_s=245)) == "no_such_sensor"
    assert error_of(board.ask("ack", reply_to=0)) == "unknown_message"
    body = bytes((1, 5)) + b"hello takes no payload"
    board.receive(cobs.encode(body + crc32(body).to_bytes(4, "little")) + b"\0")
    assert error_of(board.frames()) == "bad_length"
    streaming = streaming_board()
    assert error_of(streaming.ask("configure", sensor=0, rate_hz=238, range_deg_s=245)) == "busy_streaming"


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


# The gyroscope's driver


@pytest.mark.parametrize(
    ("wanted_hz", "hz", "code"),
    [(1, 14.9, 1), (50, 59.5, 2), (100, 119.0, 3), (200, 238.0, 4), (238, 238.0, 4), (400, 476.0, 5), (1e4, 952.0, 6)],
)
def test_the_nearest_data_rate_is_set(board: HostBoard, wanted_hz: float, hz: float, code: int) -> None:
    (setup,) = board.ask("configure", sensor=0, rate_hz=wanted_hz, range_deg_s=245)
    assert setup.values["rate_hz"] == hz
    assert board.gyro.values[0x10] == code << 5


@pytest.mark.parametrize(
    ("wanted", "deg_s", "code", "mdps"),
    [(100, 245, 0, 8.75), (245, 245, 0, 8.75), (246, 500, 1, 17.5), (2000, 2000, 3, 70)],
)
def test_the_next_range_up_is_set_with_its_own_sensitivity(
    board: HostBoard, wanted: float, deg_s: float, code: int, mdps: float
) -> None:
    (setup,) = board.ask("configure", sensor=0, rate_hz=238, range_deg_s=wanted)
    assert setup.values["range_deg_s"] == deg_s
    assert setup.values["sensitivity_rad_s"] == pytest.approx(math.radians(mdps * 1e-3), rel=1e-15)
    assert (setup.values["temperature_scale_c"], setup.values["temperature_offset_c"]) == (1 / 16, 25.0)
    assert board.gyro.values[0x10] >> 3 & 3 == code


def test_settings_that_decide_what_a_reading_means_are_written_whatever_they_were(board: HostBoard) -> None:
    addresses = (0x0C, 0x11, 0x12, 0x13, 0x1E, 0x22, 0x23, 0x24)
    for address in addresses:
        board.gyro.values[address] = 0xFF & ~0x01
    board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245)
    # data-ready of the gyroscope alone; no filter, sign change, I2C or self-test; three axes; BDU, address increment
    expected = {0x0C: 0x02, 0x11: 0, 0x12: 0, 0x13: 0, 0x1E: 0x38, 0x22: 0x44, 0x23: 0x04, 0x24: 0}
    assert {address: board.gyro.values[address] for address in addresses} == expected
    assert board.gyro.writes[-1][0] == 0x10, "the part must start only when everything else is set"


@pytest.mark.parametrize("rate_hz", [0.0, -238.0, math.nan, math.inf])
def test_a_rate_that_is_no_rate_is_refused(board: HostBoard, rate_hz: float) -> None:
    assert error_of(board.ask("configure", sensor=0, rate_hz=rate_hz, range_deg_s=245)) == "bad_rate"


@pytest.mark.parametrize("range_deg_s", [0.0, -245.0, 2001.0, math.nan, math.inf])
def test_a_range_the_part_does_not_have_is_refused(board: HostBoard, range_deg_s: float) -> None:
    assert error_of(board.ask("configure", sensor=0, rate_hz=238, range_deg_s=range_deg_s)) == "bad_range"


def test_a_missing_sensor_is_named_in_identity_and_refused_in_configure(board: HostBoard) -> None:
    board.gyro.values[0x0F] = 0xFF
    (identity,) = board.ask("hello")
    assert identity.items.tolist()[0] == (b"LSM9DS1", 0xFF, 0)
    assert error_of(board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245)) == "sensor_absent"


def test_a_setting_that_does_not_stick_is_refused_and_takes_the_sensor_out(board: HostBoard) -> None:
    board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245)
    board.gyro.stuck.add(0x10)
    assert error_of(board.ask("configure", sensor=0, rate_hz=476, range_deg_s=245)) == "setup_failed"
    assert error_of(board.ask("start", sensors=0)) == "not_configured"


def test_one_sample_is_one_transfer_of_temperature_status_and_rates() -> None:
    board = streaming_board()
    board.gyro.transfers.clear()
    for k in range(1, 20):
        convert(board, k * PERIOD_US, (-32768, 32767, k))
    assert board.gyro.transfers == [10] * 19
    first = next(frame for frame in board.frames() if frame.name == "samples")
    assert first.items["counts"][0].tolist() == [-32768, 32767, 1]
    assert first.items["temperature_counts"][0] == -48


# Time stamps, sequence numbers, losses


def test_the_time_stamp_is_the_interrupts_and_counts_beyond_32_bits() -> None:
    board = HostBoard()
    start = 2**32 - 50_000
    board.set_time(start)
    board.core.board_reset()
    board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245)
    board.ask("start", sensors=0)
    settle(board, start)
    times = [start + k * PERIOD_US for k in range(1, 60)]
    for time_us in times:
        convert(board, time_us, late_us=1500)
    board.receive(encode("stop", 4))
    batches = [frame for frame in board.frames() if frame.name == "samples"]
    assert [f.values["base_time_us"] + d for f in batches for d in f.items["delta_us"].tolist()] == times


def test_a_batch_leaves_when_it_is_40_ms_old_or_full() -> None:
    board = streaming_board()
    for k in range(1, 100):
        convert(board, k * PERIOD_US)
    batches = board.frames()
    assert {frame.values["count"] for frame in batches} == {11}  # ten periods of 4.2 ms
    assert [frame.sequence for frame in batches] == list(range(batches[0].sequence, batches[0].sequence + len(batches)))

    board = HostBoard()
    board.ask("configure", sensor=0, rate_hz=952, range_deg_s=245)
    board.ask("start", sensors=0)
    settle(board)
    for k in range(1, 100):
        convert(board, k * 1050)
    assert {frame.values["count"] for frame in board.frames()} == {BATCH_MAX}


def test_what_a_part_converts_while_it_settles_is_no_sample_and_no_loss() -> None:
    board = HostBoard()
    board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245)
    board.ask("start", sensors=0)
    for k in range(1, SETTLING + 4):
        convert(board, k * PERIOD_US, (k, 0, 0))
    (batch, _) = board.ask("stop", 2)
    assert (batch.values["sequence"], batch.values["dropped"], batch.values["count"]) == (0, 0, 3)
    assert batch.items["counts"][:, 0].tolist() == [SETTLING + 1, SETTLING + 2, SETTLING + 3]


def test_stop_sends_what_is_left_before_its_ack() -> None:
    board = streaming_board()
    for k in range(1, 6):
        convert(board, k * PERIOD_US)
    assert [frame.name for frame in board.ask("stop", 9)] == ["samples", "ack"]


def test_a_start_that_arrives_twice_does_not_restart_the_sequence() -> None:
    board = streaming_board()
    for k in range(1, 6):
        convert(board, k * PERIOD_US)
    assert [frame.name for frame in board.ask("start", 2, sensors=0)] == ["ack"]
    assert sample_sequences(board.ask("stop", 3)) == [0, 1, 2, 3, 4]


def test_a_new_start_counts_from_zero_and_lowers_a_data_ready_line_left_high() -> None:
    board = streaming_board()
    convert(board, PERIOD_US)
    board.ask("stop", 2)
    board.gyro.convert((0, 0, 0), 0)  # nobody reads this one: the line stays high
    board.data_ready(2 * PERIOD_US)
    board.ask("start", 3, sensors=0)
    assert not board.gyro.fresh
    convert(board, 9 * PERIOD_US)
    (batch, _) = board.ask("stop", 4)
    assert (batch.values["sequence"], batch.values["dropped"], batch.values["count"]) == (0, 0, 1)


def test_conversions_that_passed_while_the_line_was_high_are_counted_as_lost() -> None:
    board = streaming_board()
    for k in (1, 2, 3, 7, 8):  # three without an edge, as when the main loop is late
        convert(board, k * PERIOD_US)
    frames = board.ask("stop", 2)
    assert sample_sequences(frames) == [0, 1, 2, 6, 7]
    assert frames[-2].values["dropped"] == 3


def test_two_interrupts_before_one_read_lose_one_sample() -> None:
    board = streaming_board()
    convert(board, PERIOD_US)
    board.data_ready(2 * PERIOD_US)
    convert(board, 3 * PERIOD_US)
    frames = board.ask("stop", 2)
    assert sample_sequences(frames) == [0, 2]
    assert frames[-2].values["dropped"] == 1


@pytest.mark.parametrize("status", ["stale", "disconnected"])
def test_a_read_without_new_data_is_a_bus_error_and_no_sample(status: str) -> None:
    board = streaming_board()
    convert(board, PERIOD_US)
    if status == "stale":
        board.data_ready(2 * PERIOD_US)
        board.set_time(2 * PERIOD_US)
        board.run()
    else:
        transfer = board.gyro.transfer
        board.gyro.transfer = lambda data, *_: b"\xff" * len(data)  # type: ignore[method-assign]
        convert(board, 2 * PERIOD_US)
        board.gyro.transfer = transfer  # type: ignore[method-assign]
    convert(board, 3 * PERIOD_US)
    report = board.ask("status", 2)[-1]
    frames = board.ask("stop", 3)
    assert report.values["bus_errors"] == 1
    assert sample_sequences(frames) == [0, 2]
    assert frames[-2].values["dropped"] == 1


def test_a_sensor_that_falls_silent_is_reported_once() -> None:
    board = streaming_board()
    convert(board, PERIOD_US)
    for time_ms in range(50, 1000, 50):
        board.set_time(time_ms * 1000)
        board.run()
    errors = [frame for frame in board.frames() if frame.name == "error"]
    assert error_of(errors) == "sensor_silent"
    assert errors[0].values["reply_to"] == 0


def test_a_line_that_does_not_keep_up_costs_the_newest_samples_and_stop_waits_for_the_others() -> None:
    board = streaming_board()
    board.line_is_free = False
    for k in range(1, 301):
        convert(board, k * PERIOD_US, (k, 0, 0))
    board.receive(encode("stop", 2))
    for _ in range(20):
        board.sent()
        board.run(1)
    frames = board.frames()
    sequences = sample_sequences(frames)
    assert sequences == list(range(len(sequences))) and 64 < len(sequences) < 150
    assert frames[-1].name == "ack" and frames[-2].name == "samples"
    assert frames[-2].values["dropped"] == 300 - len(sequences)


def test_answers_there_is_no_room_for_are_counted_and_the_question_can_be_asked_again(board: HostBoard) -> None:
    board.line_is_free = False
    for sequence in range(1, 101):
        board.receive(encode("status", sequence))
    board.line_is_free = True
    board.sent()
    board.run()
    answered = [frame.values["reply_to"] for frame in board.frames()]
    assert answered == list(range(1, len(answered) + 1))
    (report,) = board.ask("status", 101)
    assert report.values["tx_overruns"] == 100 - len(answered) > 0


@settings(max_examples=100)
@given(
    st.lists(st.tuples(st.integers(1, 90), st.integers(1, 3), st.booleans(), st.booleans()), min_size=1, max_size=20)
)
def test_every_conversion_is_either_received_or_counted_as_dropped(steps: list[tuple[int, int, bool, bool]]) -> None:
    """Any mixture of missed edges, reads without new data and a transmitter that does not keep up."""
    board = streaming_board()
    conversion = 0
    for length, skip, fresh, line_is_free in steps:
        board.line_is_free = line_is_free
        if line_is_free:
            board.sent()
        for _ in range(length):
            conversion += skip if conversion else 1
            if fresh:
                convert(board, conversion * PERIOD_US, (conversion % 32000, 0, 0))
            else:
                board.data_ready(conversion * PERIOD_US)
                board.run()
    board.line_is_free = True
    board.sent()
    board.receive(encode("stop", 200))
    board.run(16)  # with a gap after every sample a batch is one sample, and seven fit a pass
    frames = board.frames()
    sequences = sample_sequences(frames)
    counts = [int(c[0]) for f in frames if f.name == "samples" for c in f.items["counts"]]
    assert counts == [(sequence + 1) % 32000 for sequence in sequences], "a sample under another one's number"
    assert sequences == sorted(set(sequences))
    names = [frame.name for frame in frames]
    assert "samples" not in names[names.index("ack") :]
    item = board.ask("status", 201)[-1].items[0]
    assert int(item["conversions"]) == conversion
    assert int(item["samples"]) == len(sequences)
    assert int(item["samples"]) + int(item["dropped"]) == conversion

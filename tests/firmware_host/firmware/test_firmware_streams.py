"""From data-ready edges to batches: time stamps, sequence numbers, losses."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_host.frames import encode
from support.board.host_board import (
    PERIOD_US,
    SETTLING,
    HostBoard,
    convert,
    error_of,
    sample_sequences,
    settle,
    streaming_board,
)

BATCH_MAX = 18


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


def test_the_time_stamp_is_the_interrupts_and_counts_beyond_32_bits() -> None:
    board = HostBoard()
    start = 2**32 - 50_000
    board.set_time(start)
    board.core.board_reset()
    board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245, range_g=0, range_gauss=0)
    board.ask("start", sensors=0)
    settle(board, start)
    times = [start + k * PERIOD_US for k in range(1, 60)]
    for time_us in times:
        convert(board, time_us, late_us=1500)
    board.receive(encode("stop", 4))
    batches = [frame for frame in board.frames() if frame.name == "samples"]
    assert [f.values["base_time_us"] + d for f in batches for d in f.items["delta_us"].tolist()] == times


@pytest.mark.parametrize(
    ("rate_hz", "period_us", "count"),
    [(119, 8403, 11), (238, PERIOD_US, BATCH_MAX), (952, 1050, BATCH_MAX)],  # ten periods of 8.4 ms, or a full frame
)
def test_a_batch_leaves_when_it_is_80_ms_old_or_full(rate_hz: float, period_us: int, count: int) -> None:
    board = HostBoard()
    board.ask("configure", sensor=0, rate_hz=rate_hz, range_deg_s=245, range_g=0, range_gauss=0)
    board.ask("start", sensors=0)
    settle(board)
    for k in range(1, 100):
        convert(board, k * period_us)
    batches = board.frames()
    assert {frame.values["count"] for frame in batches} == {count}
    assert [frame.sequence for frame in batches] == list(range(batches[0].sequence, batches[0].sequence + len(batches)))


def test_what_a_part_converts_while_it_settles_is_no_sample_and_no_loss() -> None:
    board = HostBoard()
    board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245, range_g=0, range_gauss=0)
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


def test_a_line_that_rose_again_before_it_was_seen_to_fall_does_not_stop_the_stream() -> None:
    """No edge comes of that, and none would any more: the part is read until its line is down; one is lost."""
    board = streaming_board()
    for k in (1, 2):
        convert(board, k * PERIOD_US)
    board.gyro.again_after_reading = 1
    convert(board, 3 * PERIOD_US)
    assert not board.gyro.fresh
    for k in (5, 6):
        convert(board, k * PERIOD_US)
    frames = board.ask("stop", 2)
    assert sample_sequences(frames) == [0, 1, 2, 4, 5]
    assert frames[-2].values["dropped"] == 1


def test_a_line_that_is_stuck_up_does_not_hold_the_board() -> None:
    board = streaming_board()
    board.gyro.again_after_reading = 10**6
    convert(board, PERIOD_US)
    assert board.gyro.fresh
    assert board.ask("status", 2)[-1].name == "report"


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


def test_a_part_that_runs_fast_has_every_interrupt_counted() -> None:
    board = streaming_board()
    convert(board, PERIOD_US)
    for k in range(2, 9):  # seven between two reads, in the time of six
        board.data_ready(PERIOD_US + (k - 1) * PERIOD_US * 9 // 10)
    convert(board, PERIOD_US + 8 * PERIOD_US * 9 // 10)
    frames = board.ask("stop", 2)
    assert sample_sequences(frames) == [0, 8]


def test_an_interrupt_of_a_moment_before_the_clock_was_read_keeps_its_time() -> None:
    board = streaming_board()
    convert(board, PERIOD_US)
    board.set_time(2 * PERIOD_US + 5)
    board.run()  # looks at the clock for another reason, just before it sees the interrupt
    convert(board, 2 * PERIOD_US)
    (batch, _ack) = board.ask("stop", 2)
    assert batch.items["delta_us"].tolist() == [0, PERIOD_US]
    assert batch.values["dropped"] == 0


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
        board.gyro.transfer = lambda data, *_: b"\xff" * len(data)  # pyrefly: ignore[bad-assignment, method-assign]  # a stand-in
        convert(board, 2 * PERIOD_US)
        board.gyro.transfer = transfer  # pyrefly: ignore[method-assign]  # a stand-in
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


def test_a_line_that_was_left_high_is_lowered_so_that_edges_come_again() -> None:
    board = streaming_board()
    convert(board, PERIOD_US)
    board.gyro.convert((1, 2, 3), 0)  # its edge was lost
    for time_ms in range(50, 500, 50):
        board.set_time(time_ms * 1000)
        board.run()
    assert not board.gyro.fresh


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


@pytest.mark.slow
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


def test_a_line_that_rattles_does_not_hold_the_board_up(board: HostBoard) -> None:
    board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245, range_g=0, range_gauss=0)
    transfer = board.gyro.transfer

    def rattling(data: bytes, max_hz: int, time_us: int, /) -> bytes:
        board.data_ready(time_us)
        return transfer(data, max_hz, time_us)

    board.gyro.transfer = rattling  # pyrefly: ignore[bad-assignment, method-assign]  # a stand-in
    assert [frame.name for frame in board.ask("start", 2, sensors=0)] == ["ack"]

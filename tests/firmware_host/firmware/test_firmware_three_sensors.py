"""Three sensors at once: each at its own data rate, none disturbed by another."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_host.frames import Frame, encode
from firmware_host.parts import BOARD_PARTS
from firmware_host.protocol import ERRORS
from support.board.host_board import HostBoard, convert, sample_sequences
from support.board.host_sensors import Nobody

SETUPS = ((0, 238.0, 245.0), (1, 200.0, 250.0), (2, 400.0, 125.0))
PERIODS_US = (4202, 5000, 2500)


def three_streams() -> HostBoard:
    """All three started, each at its own rate; what they convert while settling is over at 100 ms."""
    board = HostBoard()
    for sensor, rate_hz, range_deg_s in SETUPS:
        (setup,) = board.ask(
            "configure", sensor=sensor, rate_hz=rate_hz, range_deg_s=range_deg_s, range_g=0, range_gauss=0
        )
        assert setup.values["rate_hz"] == rate_hz
    board.ask("start", sensors=0)
    settling = ((0, 8), (1, 15), (2, 2))
    for time_us, sensor in sorted(
        (20_000 + PERIODS_US[sensor] * k, sensor) for sensor, n in settling for k in range(n)
    ):
        convert(board, time_us, (32767, 0, 0), sensor=sensor)
    return board


def edges(until_us: int, dead: tuple[int, ...] = ()) -> list[tuple[int, int, int]]:
    """(time, sensor, number) of the conversions from 100 ms on, in the order of time."""
    times = [
        (100_000 + PERIODS_US[sensor] * k, sensor, k)
        for sensor in range(3)
        if sensor not in dead
        for k in range((until_us - 100_000) // PERIODS_US[sensor])
    ]
    return sorted(times)


def test_three_sensors_stream_at_their_own_rates_with_their_own_time_stamps_and_numbers() -> None:
    board = three_streams()
    for time_us, sensor, number in edges(1_100_000):
        convert(board, time_us, (sensor, number, -number), sensor=sensor)
    frames = board.ask("stop", 2)
    for sensor, period_us in enumerate(PERIODS_US):
        batches = [f for f in frames if f.name == "samples" and f.values["sensor"] == sensor]
        sequences = sample_sequences(frames, sensor)
        assert sequences == list(range(1_000_000 // period_us))
        times = [f.values["base_time_us"] + d for f in batches for d in f.items["delta_us"].tolist()]
        assert times == [100_000 + period_us * k for k in sequences]
        counts = [c.tolist() for f in batches for c in f.items["counts"]]
        assert counts == [[sensor, k, -k] for k in sequences]
        assert batches[-1].values["dropped"] == 0


@pytest.mark.slow
@settings(max_examples=50)
@given(st.lists(st.sampled_from(("read", "late", "stale", "line busy")), min_size=1, max_size=120), st.integers(1, 9))
def test_every_conversion_of_every_sensor_is_received_or_counted_as_dropped(fates: list[str], stride: int) -> None:
    """Fates of the conversions of all three in turn: read, read only after the next edge, no new data, busy line."""
    board = three_streams()
    seen = [0, 0, 0]
    for k, (time_us, sensor, _) in enumerate(edges(600_000)):
        fate = fates[k * stride % len(fates)] if seen[sensor] else "read"
        seen[sensor] += 1
        board.line_is_free = fate != "line busy"
        if board.line_is_free:
            board.sent()
        if fate == "late":
            board.data_ready(time_us, sensor)
        elif fate == "stale":
            board.data_ready(time_us, sensor)
            board.wait_until(time_us)
            board.run()
        else:
            convert(board, time_us, sensor=sensor)
    board.line_is_free = True
    board.sent()
    board.run(30)
    report = board.ask("status", 2)[-1]
    board.receive(encode("stop", 3))
    board.run(30)
    assert [int(item["conversions"]) for item in report.items[:3]] == seen
    assert [int(i["samples"]) + int(i["dropped"]) for i in board.ask("status", 4)[-1].items[:3]] == seen


def errors_of(frames: list[Frame]) -> list[tuple[int, str]]:
    return [(f.values["sensor"], ERRORS[f.values["code"]].name) for f in frames if f.name == "error"]


def test_dead_sensors_are_named_once_and_cost_the_others_nothing() -> None:
    board = three_streams()
    nobody = Nobody()
    board.sensors[1] = nobody
    board.adis16465.damage = 1
    for time_us, sensor, number in edges(
        3_100_000, dead=(1,)
    ):  # the MPU-9250 falls silent, the ADIS16465 talks nonsense
        convert(board, time_us, (number % 1000, 0, 0), sensor=sensor)
    frames = board.ask("stop", 2)
    assert sorted(errors_of(frames)) == [(1, "sensor_silent"), (2, "checksum_failed")]
    assert sample_sequences(frames, 0) == list(range(3_000_000 // PERIODS_US[0]))
    assert sample_sequences(frames, 1) == sample_sequences(frames, 2) == []
    report = board.ask("status", 3)[-1]
    assert report.items["dropped"].tolist() == [0, 0, 1200, *[0] * (len(BOARD_PARTS) - 3)]
    assert report.values["bus_errors"] == 1200
    assert nobody.transfers < 3 * 10, "a silent part is tried now and then, not in every pass"


@pytest.mark.parametrize(
    ("sensor", "level", "name"), [(0, 0xFF, "sensor_absent"), (1, 0x00, "sensor_absent"), (2, 0x00, "checksum_failed")]
)
def test_a_part_that_signals_but_does_not_answer_is_named(sensor: int, level: int, name: str) -> None:
    board = three_streams()
    board.sensors[sensor] = Nobody(level)
    for k in range(9):
        convert(board, 100_000 + k * PERIODS_US[sensor], sensor=sensor)
    assert errors_of(board.frames()) == []
    for k in range(9, 30):
        convert(board, 100_000 + k * PERIODS_US[sensor], sensor=sensor)
    assert [error for error in errors_of(board.frames()) if error[0] == sensor] == [(sensor, name)]

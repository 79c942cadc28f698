"""The driver of the MPU-9250 against its registers."""

import math

import pytest

from support.board.host_board import HostBoard, configure, convert, first_samples


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


@pytest.mark.parametrize(
    ("wanted_hz", "hz", "divider", "filter_code"),
    [
        (8000, 1000, 0, 1),
        (700, 500, 1, 1),
        (800, 1000, 0, 1),
        (238, 250, 3, 2),
        (200, 200, 4, 2),
        (100, 100, 9, 3),
        (50, 50, 19, 4),
        (20, 20, 49, 5),
        (1, 4, 249, 6),
    ],
)
def test_the_divider_acts_because_the_filter_is_on_and_the_filter_keeps_below_half_the_rate(
    board: HostBoard, wanted_hz: float, hz: float, divider: int, filter_code: int
) -> None:
    assert configure(board, 1, rate_hz=wanted_hz)["rate_hz"] == hz
    assert (board.mpu9250.values[0x19], board.mpu9250.values[0x1A]) == (divider, filter_code)
    assert board.mpu9250.values[0x1B] & 3 == 0, "FCHOICE_B would go round the filter"


@pytest.mark.parametrize(
    ("wanted", "deg_s", "code", "counts_per_deg_s"),
    [(1, 250, 0, 131), (250, 250, 0, 131), (251, 500, 1, 65.5), (1000, 1000, 2, 32.8), (2000, 2000, 3, 16.4)],
)
def test_the_ranges_of_the_mpu9250_have_the_data_sheets_sensitivities(
    board: HostBoard, wanted: float, deg_s: float, code: int, counts_per_deg_s: float
) -> None:
    setup = configure(board, 1, range_deg_s=wanted)
    assert setup["range_deg_s"] == deg_s
    assert setup["sensitivity_rad_s"] == pytest.approx(math.radians(1 / counts_per_deg_s), rel=1e-15)
    assert (setup["temperature_scale_c"], setup["temperature_offset_c"]) == (1 / 333.87, 21.0)
    assert board.mpu9250.values[0x1B] == code << 3


def test_what_the_mpu9250_was_told_before_is_overruled(board: HostBoard) -> None:
    values = board.mpu9250.values
    for address in (*range(0x13, 0x1C), 0x23, 0x37, 0x38, 0x6A, 0x6C):
        values[address] = 0xFF
    configure(board, 1)
    assert bytes(values[0x13:0x19]) == bytes(6), "an offset would hide the bias"
    # gyroscope through the filter without self-test; no FIFO; pulses, active high; data-ready alone; no I2C; all axes
    expected = {0x1B: 0, 0x23: 0, 0x37: 0, 0x38: 0x01, 0x6A: 0x10, 0x6B: 0x01, 0x6C: 0}
    assert {address: values[address] for address in expected} == expected
    assert board.mpu9250.writes[-1] == (0x38, 0x01), "the part may signal only when everything else is set"


def test_a_sleeping_mpu9250_is_woken_first_and_given_time(board: HostBoard) -> None:
    board.mpu9250.values[0x6B] = 0x40
    configure(board, 1)
    assert board.mpu9250.writes[:2] == [(0x6A, 0x10), (0x6B, 0x01)]
    assert board.core.port_time_us() >= 10_000


def test_an_mpu9250_sample_is_one_burst_high_byte_first(board: HostBoard) -> None:
    configure(board, 1)
    board.mpu9250.transfers.clear()
    batch = first_samples(board, 1, (-32768, 258, 32767))
    assert board.mpu9250.transfers == [16] * 41  # one at the start, to begin with a line that is low
    assert batch.items["counts"][0].tolist() == [-32768, 258, 32767]
    assert batch.items["temperature_counts"][0] == -48


@pytest.mark.parametrize(("rate_hz", "settling"), [(1000, 71), (200, 15), (4, 1)])
def test_the_mpu9250_has_70_ms_to_start_up(board: HostBoard, rate_hz: float, settling: int) -> None:
    configure(board, 1, rate_hz=rate_hz)
    board.ask("start", 2, sensors=0)
    for k in range(80):
        convert(board, round(100_000 + 1e6 / rate_hz * k), (k, 0, 0), sensor=1)
    first = next(frame for frame in board.ask("stop", 3) if frame.name == "samples")
    assert (first.values["sequence"], int(first.items["counts"][0][0])) == (0, settling)

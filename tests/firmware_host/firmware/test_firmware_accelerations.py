"""Accelerations along with the rates: the drivers' settings, what they make of the registers, and the stream."""

import math

import pytest

from support.board.host_board import (
    PERIOD_US,
    HostBoard,
    configure,
    convert,
    error_of,
    first_samples,
    sample_sequences,
    settle,
)

G_M_S2 = 9.80665


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


# What holds for every part


@pytest.mark.slow
@pytest.mark.parametrize("sensor", range(3))
@pytest.mark.parametrize("range_g", [-1.0, 16.5, math.nan, math.inf])
def test_a_range_of_accelerations_the_part_does_not_have_is_refused(
    board: HostBoard, sensor: int, range_g: float
) -> None:
    answer = board.ask("configure", sensor=sensor, rate_hz=200, range_deg_s=125, range_g=range_g, range_gauss=0)
    assert error_of(answer) == "bad_range"


@pytest.mark.parametrize("sensor", range(3))
@pytest.mark.parametrize(("range_g", "name"), [(0.0, "samples"), (8.0, "imu_samples")])
def test_accelerations_come_with_their_rates_only_where_they_are_wanted(
    board: HostBoard, sensor: int, range_g: float, name: str
) -> None:
    setup = configure(board, sensor, range_g=range_g)
    assert (setup["range_m_s2"], setup["sensitivity_m_s2"] > 0) == (pytest.approx(range_g * G_M_S2), range_g > 0)
    batch = first_samples(board, sensor, (-3, 2, 1), acceleration=(300, -200, -32768))
    assert (batch.name, batch.values["mode"]) == (name, 0)
    assert batch.items["counts"][0].tolist() == [-3, 2, 1]
    assert batch.items["temperature_counts"][0] == -48
    if range_g:
        assert batch.items["acceleration"][0].tolist() == [300, -200, -32768]


@pytest.mark.parametrize("sensor", range(3))
def test_a_stream_with_accelerations_is_numbered_and_stamped_as_any_other(board: HostBoard, sensor: int) -> None:
    configure(board, sensor, range_g=8)
    board.ask("start", 2, sensors=0)
    for k in range(60):
        convert(board, 100_000 + 5000 * k, (k, 0, 0), sensor=sensor, acceleration=(0, k, 0))
    frames = [f for f in board.ask("stop", 3) if f.name == "imu_samples"]
    assert max(f.values["count"] for f in frames) <= 12, "so many fit a frame"
    numbers = [int(item["counts"][0]) for f in frames for item in f.items]
    assert numbers == list(range(numbers[0], 60))
    assert [int(item["acceleration"][1]) for f in frames for item in f.items] == numbers
    assert sample_sequences(frames, sensor) == list(range(len(numbers)))
    times_us = [f.values["base_time_us"] + d for f in frames for d in f.items["delta_us"].tolist()]
    assert times_us == [100_000 + 5000 * k for k in numbers]


# LSM9DS1


@pytest.mark.parametrize(
    ("wanted_g", "g", "code", "mg"),
    [(1, 2, 0, 0.061), (2, 2, 0, 0.061), (2.1, 4, 2, 0.122), (8, 8, 3, 0.244), (9, 16, 1, 0.732)],
)
def test_the_lsm9ds1s_ranges_have_the_data_sheets_sensitivities(
    board: HostBoard, wanted_g: float, g: float, code: int, mg: float
) -> None:
    """At 16 g a count is half as much again as the full scale would have it."""
    setup = configure(board, 0, rate_hz=238, range_g=wanted_g)
    assert setup["range_m_s2"] == pytest.approx(g * G_M_S2, rel=1e-15)
    assert setup["sensitivity_m_s2"] == pytest.approx(mg * 1e-3 * G_M_S2, rel=1e-14)
    assert board.gyro.values[0x20] == 4 << 5 | code << 3 | 0x06, "the gyroscope's rate, and 105 Hz"
    addresses = [address for address, _value in board.gyro.writes]
    assert addresses.index(0x20) < addresses.index(0x10), "written last, it would leave the accelerometer running alone"


@pytest.mark.parametrize(
    ("rate_hz", "filter_code"),
    [(14.9, 3), (59.5, 3), (119, 3), (238, 2), (476, 1), (952, 0)],  # 50, 105, 211, 408 Hz
)
def test_the_lsm9ds1s_accelerations_are_filtered_below_the_data_rate(
    board: HostBoard, rate_hz: float, filter_code: int
) -> None:
    configure(board, 0, rate_hz=rate_hz, range_g=2)
    assert board.gyro.values[0x20] & 0x07 == 0x04 | filter_code


def test_both_triads_of_the_lsm9ds1_come_in_right_handed_axes(board: HostBoard) -> None:
    """Its own x of both points the other way than its magnetometer's (datasheet, figure 1)."""
    configure(board, 0, range_g=2)
    board.gyro.convert((0, 0, 0), 0)
    own = {0x18: (1000, -2000, 3000), 0x28: (-32768, 5000, 6000)}

    def left_handed() -> None:
        for address, vector in own.items():
            data = b"".join(value.to_bytes(2, "little", signed=True) for value in vector)
            board.gyro.values[address : address + 6] = data

    board.ask("start", 2, sensors=0)
    settle(board)
    left_handed()
    board.gyro.fresh = board.gyro.fresh_acceleration = True
    board.data_ready(PERIOD_US)
    board.run()
    (batch,) = [f for f in board.ask("stop", 3) if f.name == "imu_samples"]
    assert batch.items["counts"][0].tolist() == [-1000, -2000, 3000]
    assert batch.items["acceleration"][0].tolist() == [32767, 5000, 6000]


@pytest.mark.parametrize("moment", ["before_acceleration", "after_acceleration"])
def test_a_conversion_between_the_lsm9ds1s_two_bursts_costs_that_reading_and_nobody_is_blamed(
    board: HostBoard, moment: str
) -> None:
    """Rates of one conversion and accelerations of the next must not make a sample."""
    configure(board, 0, rate_hz=238, range_g=2)
    board.ask("start", 2, sensors=0)
    settle(board)
    for k in range(1, 30):
        time_us = k * 2 * PERIOD_US

        def next_conversion(k: int = k, time_us: int = time_us) -> None:
            board.gyro.convert((-k, 0, 0), 0, (-k, 0, 0))
            board.data_ready(time_us + PERIOD_US)

        setattr(board.gyro, moment, next_conversion)
        convert(board, time_us, (k, 0, 0), late_us=PERIOD_US - 10, acceleration=(k, 0, 0))
        board.run()
    frames = board.ask("stop", 3)
    items = [item for f in frames if f.name == "imu_samples" for item in f.items]
    assert [int(item["counts"][0]) for item in items] == [-k for k in range(1, 30)]
    assert all(item["counts"][0] == item["acceleration"][0] for item in items)
    report = board.ask("status", 4)[-1]
    assert (report.items["dropped"][0], report.items["samples"][0], report.values["bus_errors"]) == (29, 29, 0)


# MPU-9250


@pytest.mark.parametrize(
    ("wanted_g", "g", "code", "counts_per_g"), [(1, 2, 0, 16384), (3, 4, 1, 8192), (8, 8, 2, 4096), (16, 16, 3, 2048)]
)
def test_the_mpu9250s_ranges_have_the_data_sheets_sensitivities(
    board: HostBoard, wanted_g: float, g: float, code: int, counts_per_g: float
) -> None:
    board.mpu9250.values[0x1C] = board.mpu9250.values[0x1D] = 0xFF  # self-test, around the filter
    setup = configure(board, 1, range_g=wanted_g)
    assert setup["range_m_s2"] == pytest.approx(g * G_M_S2, rel=1e-15)
    assert setup["sensitivity_m_s2"] == pytest.approx(G_M_S2 / counts_per_g, rel=1e-15)
    assert board.mpu9250.values[0x1C] == code << 3
    assert board.mpu9250.values[0x1D] == board.mpu9250.values[0x1A] == 2, "the same filter as the gyroscope's"


def test_the_factorys_trim_of_the_mpu9250s_accelerometer_is_left_alone(board: HostBoard) -> None:
    trim = range(0x77, 0x7F)
    for address in trim:
        board.mpu9250.values[address] = address
    configure(board, 1, range_g=2)
    assert not {address for address, _value in board.mpu9250.writes} & set(trim)


# ADIS16465


def test_the_adis16465_has_one_range_of_accelerations(board: HostBoard) -> None:
    setup = configure(board, 2, range_g=2)
    assert setup["range_m_s2"] == pytest.approx(8 * G_M_S2, rel=1e-15)
    assert setup["sensitivity_m_s2"] == pytest.approx(G_M_S2 / 4000, rel=1e-15)
    assert (
        error_of(board.ask("configure", sensor=2, rate_hz=200, range_deg_s=125, range_g=8.1, range_gauss=0))
        == "bad_range"
    )


@pytest.mark.parametrize(("range_g", "name"), [(0, "samples"), (8, "imu_samples")])
def test_the_adis16465s_outputs_are_rounded_to_the_nearest_count(board: HostBoard, range_g: float, name: str) -> None:
    configure(board, 2, range_g=range_g)
    board.ask("start", 2, sensors=0)
    for k in range(6):
        board.adis16465.convert((-1, 5, 32767), 0, (-7, 99, -32768), (0x8000, 0x7FFF, 0xFFFF, 0x8001, 0x0000, 0xFFFF))
        board.data_ready(100_000 + 5000 * k, 2)
        board.wait_until(100_020 + 5000 * k)
        board.run()
    (batch,) = [f for f in board.ask("stop", 3) if f.name == name]
    assert batch.items["counts"][0].tolist() == [0, 5, 32767], "which is the most there is"
    if range_g:
        assert batch.items["acceleration"][0].tolist() == [-6, 99, -32767]


def test_lower_words_of_the_next_conversion_cost_that_reading_and_nobody_is_blamed(board: HostBoard) -> None:
    configure(board, 2)
    board.ask("start", 2, sensors=0)
    for k in range(3):
        convert(board, 50_000 + 5000 * k, sensor=2)
    part = board.adis16465
    for k in range(20):
        next_us = 65_000 + 10_000 * k + 5000

        def overtake(next_us: int = next_us) -> None:
            part.convert((7, 7, 7), -48, low_words=(0x8000,) * 6)
            board.data_ready(next_us, 2)

        part.after_burst = overtake
        convert(board, next_us - 5000, (1, 1, 1), late_us=4900, sensor=2)
        board.wait_until(next_us)
        board.run()
    frames = board.ask("stop", 3)
    assert [f for f in frames if f.name == "error"] == []
    counts = [item["counts"].tolist() for f in frames if f.name == "samples" for item in f.items]
    assert counts[1:] == [[8, 8, 8]] * 20
    report = board.ask("status", 4)[-1]
    assert (report.items["dropped"][2], report.values["bus_errors"]) == (20, 0)

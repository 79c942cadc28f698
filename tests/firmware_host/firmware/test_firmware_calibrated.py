"""The board remembers calibrations and streams by them: the core on this machine."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from firmware_host.answers import NO_CHANGE
from firmware_host.frames import Frame
from firmware_host.parts import BOARD_PARTS
from firmware_host.protocol import text
from rig.estimation.arrays import Array
from support.board.host_board import PERIOD_US, HostBoard, configure, convert, error_of, settle, streaming_board
from support.board.host_flash import HostFlash
from support.motions.warmed_sweeps import REFERENCE_C, calibrate, drawn, session

RAD_S = np.radians(8.75e-3)  # per count of the LSM9DS1 at 245 °/s
SCALE, BIAS_RAD_S = np.array([1.1771, 1.1554, 1.1440]), np.array([0.0077, -0.0100, -0.0051])
CALIBRATION: dict[str, Any] = {
    "model": 1,
    "serial_number": "LSM-0042",
    "written_unix_s": 1_790_000_000,
    "temperature_c": 23.5,
    "matrix": np.diag(SCALE),
    "bias_rad_s": tuple(BIAS_RAD_S),
    "lowest_c": 23.5,
    "highest_c": 23.5,
    "scale_change": NO_CHANGE,
    "bias_change_rad_s": NO_CHANGE,
}
MATRIX = np.array([[1.1771, -0.0052, 0.0031], [-0.0053, 1.1554, 0.0047], [0.0032, 0.0048, 1.1440]])
WHOLE = CALIBRATION | {"model": 2, "matrix": MATRIX}


def test_a_calibration_is_read_back_as_written_with_the_part_it_belongs_to() -> None:
    board = HostBoard()
    assert error_of(board.ask("read_calibration", sensor=0)) == "no_calibration"
    configure(board, 0, 238, 245)
    (ack,) = board.ask("write_calibration", sensor=0, **CALIBRATION)
    assert ack.name == "ack"
    board.core.board_reset()
    (stored,) = board.ask("read_calibration", sequence=9, sensor=0)
    values = stored.values
    assert (values["reply_to"], values["sensor"], values["sequence"], values["who_am_i"]) == (9, 0, 1, 0x68)
    assert (text(values["part"]), text(values["serial_number"])) == ("LSM9DS1", "LSM-0042")
    assert (values["range_deg_s"], values["written_unix_s"], values["temperature_c"]) == (245, 1_790_000_000, 23.5)
    assert np.array(values["matrix"]) == pytest.approx(np.diag(SCALE), rel=1e-7)
    assert values["bias_rad_s"] == pytest.approx(BIAS_RAD_S, rel=1e-7)
    (ack,) = board.ask("erase_calibration", sensor=0)
    assert ack.name == "ack"
    assert error_of(board.ask("read_calibration", sensor=0)) == "no_calibration"


def test_a_write_that_comes_twice_is_stored_once() -> None:
    board, flash = HostBoard(), HostFlash()
    configure(board, 0, 238, 245)
    board.ask("write_calibration", sensor=0, **CALIBRATION)
    done = len(flash.operations)
    (ack,) = board.ask("write_calibration", sensor=0, **CALIBRATION)
    assert ack.name == "ack" and len(flash.operations) == done
    board.ask("write_calibration", sensor=0, **CALIBRATION | {"written_unix_s": 1_790_000_001})
    assert len(flash.operations) == 2 * done


NAN, INFINITY = float("nan"), float("inf")


@pytest.mark.parametrize(
    "wrong",
    [
        {"model": 0},
        {"model": 3},
        {"matrix": np.diag((1.0, 0.0, 1.0))},
        {"matrix": np.diag((1.0, -1.0, 1.0))},
        {"matrix": np.diag((1.0, 1.0, INFINITY))},
        {"matrix": np.diag((1e30, 1.0, 1.0))},
        {"matrix": ((NAN, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))},
        {"matrix": MATRIX},
        {"model": 2, "matrix": ((1.0, 0.6, -0.5), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))},
        {"model": 2, "matrix": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (NAN, 0.0, 1.0))},
        {"model": 2, "matrix": -MATRIX},
        {"bias_rad_s": (0.0, NAN, 0.0)},
        {"bias_rad_s": (0.0, 0.0, -INFINITY)},
        {"bias_rad_s": (-1e30, 0.0, 0.0)},
    ],
)
def test_a_calibration_that_cannot_be_right_is_refused_and_the_stored_one_stays(wrong: dict[str, Any]) -> None:
    board = HostBoard()
    configure(board, 0, 238, 245)
    board.ask("write_calibration", sensor=0, **CALIBRATION)
    assert error_of(board.ask("write_calibration", sensor=0, **CALIBRATION | wrong)) == "bad_calibration"
    (stored,) = board.ask("read_calibration", sensor=0)
    assert stored.values["sequence"] == 1


def test_requests_about_calibrations_are_refused_by_name() -> None:
    board = HostBoard()
    none = dict[str, Any]()
    for name, values in (("read_calibration", none), ("write_calibration", CALIBRATION), ("erase_calibration", none)):
        assert error_of(board.ask(name, sensor=len(BOARD_PARTS), **values)) == "no_such_sensor"
    assert error_of(board.ask("write_calibration", sensor=0, **CALIBRATION)) == "not_configured"
    configure(board, 0, 238, 245)
    board.gyro.values[0x0F] = 0x00
    assert error_of(board.ask("write_calibration", sensor=0, **CALIBRATION)) == "sensor_absent"
    board.gyro.values[0x0F] = 0x69
    assert error_of(board.ask("write_calibration", sensor=0, **CALIBRATION)) == "sensor_mismatch"
    streaming = streaming_board()
    assert error_of(streaming.ask("write_calibration", sensor=0, **CALIBRATION)) == "busy_streaming"
    assert error_of(streaming.ask("erase_calibration", sensor=0)) == "busy_streaming"
    assert error_of(streaming.ask("read_calibration", sensor=0)) == "no_calibration"


def test_flash_that_fails_is_named() -> None:
    board, flash = HostBoard(), HostFlash()
    configure(board, 0, 238, 245)
    flash.power_up(lasts=3)
    assert error_of(board.ask("write_calibration", sensor=0, **CALIBRATION)) == "flash_failed"
    assert error_of(board.ask("erase_calibration", sensor=0)) == "flash_failed"


# Streaming calibrated


def calibrated_board(calibration: dict[str, Any] = CALIBRATION) -> HostBoard:
    """An LSM9DS1 that has just been started to send calibrated rates."""
    board = HostBoard()
    configure(board, 0, 238, 245)
    board.ask("write_calibration", sensor=0, **calibration)
    (ack,) = board.ask("start", sensors=1)
    assert ack.name == "ack"
    settle(board)
    return board


def rates(frames: list[Frame]) -> Array:
    """(n, 3) rad/s of the calibrated batches."""
    batches = [frame.items["rate_urad_s"] for frame in frames if frame.name == "rates"]
    return np.concatenate(batches) * 1e-6


def test_calibrated_rates_are_k_times_m_plus_b_to_the_microradian() -> None:
    board = calibrated_board()
    counts = np.random.default_rng(4).integers(-32768, 32768, (100, 3))
    for k, row in enumerate(counts.tolist()):
        convert(board, (k + 1) * PERIOD_US, row)
    frames = board.ask("stop")
    streamed = [frame for frame in frames if frame.name == "rates"]
    assert {frame.values["mode"] for frame in streamed} == {1}
    assert [frame.values["sequence"] for frame in streamed] == list(range(0, 100, 12))
    assert {int(temperature) for frame in streamed for temperature in frame.items["temperature_counts"]} == {-48}
    times = np.concatenate([f.values["base_time_us"] + f.items["delta_us"].astype(np.int64) for f in streamed])
    assert times.tolist() == [(k + 1) * PERIOD_US for k in range(100)]
    assert rates(frames) == pytest.approx(SCALE * (counts * RAD_S + BIAS_RAD_S), abs=1.5e-6)


@pytest.mark.parametrize("range_deg_s", [245, 500, 2000])
def test_the_whole_matrix_corrects_within_the_bound_of_single_precision(range_deg_s: float) -> None:
    board = HostBoard()
    setup = configure(board, 0, 238, range_deg_s)
    board.ask("write_calibration", sensor=0, **WHOLE)
    board.ask("start", sensors=1)
    settle(board)
    counts = np.random.default_rng(5).integers(-32767, 32768, (2000, 3))  # all that the part's x, turned, can be
    counts[:8] = np.array(np.meshgrid(*3 * [[-32767, 32767]])).reshape(3, -1).T
    frames = []
    for k, row in enumerate(counts.tolist()):
        convert(board, (k + 1) * PERIOD_US, row)
        frames.extend(board.frames())
    frames.extend(board.ask("stop"))
    matrix, bias = (values.astype(np.float32).astype(float) for values in (MATRIX, BIAS_RAD_S))  # as kept
    readings = counts * setup["sensitivity_rad_s"]
    error_rad_s = np.abs(rates(frames) - (readings + bias) @ matrix.T)
    bound_rad_s = 0.5e-6 + 8 * 2.0**-24 * (np.abs(readings) + np.abs(bias)) @ np.abs(matrix).T
    assert np.all(error_rad_s <= bound_rad_s)
    assert bound_rad_s.max() < (3.5e-6 if range_deg_s == 245 else 2.5e-5)


def test_calibrated_rates_are_rounded_not_cut_off() -> None:
    urad_per_count = 1e6 * RAD_S  # 152.7
    board = calibrated_board(CALIBRATION | {"matrix": np.eye(3), "bias_rad_s": (0.0, 0.0, 0.0)})
    for count in range(1, 30):
        convert(board, count * PERIOD_US, (count, -count, 0))
    exact = np.arange(1, 30) * urad_per_count
    rounded = np.round(rates(board.ask("stop")) * 1e6)
    assert rounded[:, 0].tolist() == np.round(exact).tolist()
    assert rounded[:, 1].tolist() == np.round(-exact).tolist()


def test_one_sensor_streams_calibrated_beside_another_that_streams_raw() -> None:
    board = HostBoard()
    configure(board, 0, 238, 245)
    configure(board, 2)
    board.ask("write_calibration", sensor=2, **CALIBRATION)
    (ack,) = board.ask("start", sensors=4)
    assert ack.name == "ack"
    for k in range(1, 80):
        convert(board, 10_000 * k)
        convert(board, 10_000 * k + 5_000, sensor=2)
    modes = {(frame.name, frame.values["sensor"], frame.values["mode"]) for frame in board.ask("stop")[:-1]}
    assert modes == {("samples", 0, 0), ("rates", 2, 1)}


def test_rates_that_do_not_fit_are_the_largest_that_do() -> None:
    board = calibrated_board(CALIBRATION | {"matrix": np.diag((1e5, 1e5, 1.0)), "bias_rad_s": (0.0, 0.0, 0.0)})
    convert(board, PERIOD_US, (32767, -32768, 0))
    assert rates(board.ask("stop")) == pytest.approx(np.array([[2147.483647, -2147.483647, 0.0]]), abs=1e-9)


def test_a_start_that_comes_twice_changes_nothing_and_another_mode_is_refused() -> None:
    board = calibrated_board()
    convert(board, PERIOD_US)
    assert [frame.name for frame in board.ask("start", sensors=1)] == ["ack"]
    assert error_of(board.ask("start", sensors=0)) == "busy_streaming"
    convert(board, 2 * PERIOD_US)
    frames = board.ask("stop")
    assert [(frame.name, frame.values.get("sequence"), len(frame.items)) for frame in frames] == [
        ("rates", 0, 2),
        ("ack", None, 0),
    ]


def test_a_calibrated_start_without_a_fitting_calibration_is_refused() -> None:
    board = HostBoard()
    assert error_of(board.ask("start", sensors=1 << len(BOARD_PARTS))) == "no_such_sensor"
    configure(board, 0, 238, 245)
    assert error_of(board.ask("start", sensors=1)) == "no_calibration"
    assert error_of(board.ask("start", sensors=3)) == "not_configured"
    board.ask("write_calibration", sensor=0, **CALIBRATION)
    configure(board, 0, 238, 500)
    assert error_of(board.ask("start", sensors=1)) == "other_sensor"
    configure(board, 0, 238, 245)
    board.gyro.values[0x0F] = 0xFF
    assert error_of(board.ask("start", sensors=1)) == "sensor_absent"
    board.gyro.values[0x0F] = 0x68
    (ack,) = board.ask("start", sensors=1)
    assert ack.name == "ack"


def test_what_is_kept_is_uncalibrated_also_while_the_stream_is_calibrated() -> None:
    board = calibrated_board()
    assert [frame.name for frame in board.ask("keep", sensors=1, duration_s=1.0)] == ["ack"]
    for k in range(1, 30):
        convert(board, k * PERIOD_US, (1000, 0, 0))
    frames = board.ask("observe", sensor=0, index=0, start_us=PERIOD_US, end_us=20 * PERIOD_US, speed_rad_s=1.0)
    (observed,) = [frame for frame in frames if frame.name == "observed"]
    assert observed.values["mean_rad_s"] == pytest.approx((1000 * RAD_S, 0, 0))


# Over temperature


def cubic(*rows: tuple[float, float, float]) -> Array:
    return np.array(rows)


OVER_TEMPERATURE: dict[str, Any] = CALIBRATION | {
    "lowest_c": 10.0,
    "highest_c": 60.0,
    "scale_change": cubic((3e-4, -2e-4, 2e-4), (2e-6, 1e-6, -1e-6), (1e-8, 0.0, -2e-8)),
    "bias_change_rad_s": cubic((5e-4, -4e-4, 3e-4), (5e-6, 3e-6, -4e-6), (-1e-8, 2e-8, 0.0)),
}


def twin(calibration: dict[str, Any], readings: Array, temperature_c: Array) -> tuple[Array, Array]:
    """(n, 3) rates in double precision of readings (n, 3), and the bound of the board's error beside half a count."""
    matrix, bias, scale_change, bias_change = (
        np.asarray(calibration[name], dtype=np.float32).astype(float)
        for name in ("matrix", "bias_rad_s", "scale_change", "bias_change_rad_s")
    )
    away = np.clip(temperature_c, calibration["lowest_c"], calibration["highest_c"]) - calibration["temperature_c"]
    powers = away[:, None] ** np.arange(1, 4)
    rates = ((1 + powers @ scale_change) * (readings + bias + powers @ bias_change)) @ matrix.T
    moved = np.abs(powers) @ np.abs(bias_change)
    magnitudes = (np.abs(readings) + np.abs(bias) + moved) @ np.abs(matrix).T
    return rates, 16 * 2.0**-24 * magnitudes


@pytest.mark.parametrize("base", [CALIBRATION, WHOLE], ids=["diagonal", "matrix"])
def test_readings_are_corrected_as_warm_as_the_part_is_and_beyond_the_range_as_at_its_ends(
    base: dict[str, Any],
) -> None:
    board = HostBoard()
    setup = configure(board, 0, 238, 245)
    calibration = OVER_TEMPERATURE | {name: base[name] for name in ("model", "matrix")}
    (ack,) = board.ask("write_calibration", sensor=0, **calibration)
    assert ack.name == "ack"
    board.ask("start", sensors=1)
    settle(board)
    rng = np.random.default_rng(6)
    counts, warm = rng.integers(-32767, 32768, (600, 3)), rng.integers(-700, 900, 600)
    frames = []
    for k, (row, temperature) in enumerate(zip(counts.tolist(), warm.tolist(), strict=True)):
        convert(board, (k + 1) * PERIOD_US, row, temperature_counts=temperature)
        frames.extend(board.frames())
    frames.extend(board.ask("stop"))
    temperature_c = warm * setup["temperature_scale_c"] + setup["temperature_offset_c"]
    assert temperature_c.min() < 0 and temperature_c.max() > 70
    expected, bound = twin(calibration, counts * setup["sensitivity_rad_s"], temperature_c)
    assert np.all(np.abs(rates(frames) - expected) <= 0.5e-6 + bound)
    assert bound.max() < 1.2e-5
    constant, _ = twin(calibration, counts * setup["sensitivity_rad_s"], np.full(600, 23.5))
    assert np.abs(rates(frames) - constant).max() > 1e-2, "without temperature it would be another rate"


def test_polynomials_come_back_as_written() -> None:
    board = HostBoard()
    configure(board, 0, 238, 245)
    board.ask("write_calibration", sensor=0, **OVER_TEMPERATURE)
    board.core.board_reset()
    (stored,) = board.ask("read_calibration", sensor=0)
    assert (stored.values["lowest_c"], stored.values["highest_c"]) == (10.0, 60.0)
    for name in ("scale_change", "bias_change_rad_s"):
        assert np.array(stored.values[name]) == pytest.approx(OVER_TEMPERATURE[name], rel=1e-7)


@pytest.mark.parametrize(
    "wrong",
    [
        {"lowest_c": 24.0},
        {"highest_c": 23.0},
        {"lowest_c": NAN},
        {"highest_c": INFINITY},
        {"temperature_c": NAN},
        {"scale_change": cubic((0.02, 0, 0), (0, 0, 0), (0, 0, 0))},
        {"scale_change": cubic((0, 0, 0), (0, 0, 0), (0, NAN, 0))},
        {"bias_change_rad_s": cubic((0, 0, 0), (0, 0, INFINITY), (0, 0, 0))},
    ],
)
def test_polynomials_that_cannot_be_right_are_refused(wrong: dict[str, Any]) -> None:
    board = HostBoard()
    configure(board, 0, 238, 245)
    assert error_of(board.ask("write_calibration", sensor=0, **OVER_TEMPERATURE | wrong)) == "bad_calibration"


@pytest.mark.thorough
@pytest.mark.slow
def test_what_the_board_leaves_of_a_bias_over_temperature_is_thirty_times_less_than_before() -> None:
    """Polynomials of sweeps from 20 to 60 °C and back, in the board's flash, correct a part that stands still there."""
    sensor_index, (at_zero_c, counts_per_k) = list(BOARD_PARTS).index("icm42688p"), (25.0, 132.48)
    before = []
    after = []
    u = []
    for seed in range(4):
        rng = np.random.default_rng([31, seed])
        sensor = replace(drawn(rng, gradient_k=0.0, walk=0.0), leaning=np.zeros((12, 3)))
        found = calibrate(sensor, session(), rng)
        board = HostBoard()
        setup = configure(board, sensor_index, 500, 15.625)
        about: dict[str, Any] = {"model": 1, "serial_number": "1", "written_unix_s": 0, "temperature_c": REFERENCE_C}
        board.ask(
            "write_calibration", sensor=sensor_index, **about,
            matrix=np.diag(found.scale[0]), bias_rad_s=-found.bias[0],
            lowest_c=found.range_c[0], highest_c=found.range_c[1],
            scale_change=found.scale[1:] / found.scale[0], bias_change_rad_s=-found.bias[1:],
        )  # fmt: skip
        board.ask("start", sensors=1 << sensor_index)
        warm = np.linspace(*found.range_c, 9)
        reads = np.array([sensor.evaluate(each)[3:] for each in warm])
        frames = []
        for k, place in enumerate([0] * 60 + list(range(9))):  # the part settles first
            counts = np.round(reads[place] / setup["sensitivity_rad_s"]).astype(int).tolist()
            temperature = round((warm[place] - at_zero_c) * counts_per_k)
            convert(board, 2000 * (k + 1), counts, sensor=sensor_index, temperature_counts=temperature)
            frames.extend(board.frames())
        frames.extend(board.ask("stop"))
        left = rates(frames)[-9:]
        before.append(reads - sensor.evaluate(REFERENCE_C)[3:])
        after.append(left / found.scale[0])
        u.append([found.evaluate(float(each)).std[3:] for each in warm])
    rms_before, rms_after, rms_u = (float(np.sqrt(np.mean(np.square(each)))) for each in (before, after, u))
    print(f"before {rms_before:.2e}, after {rms_after:.2e} rad/s: 1/{rms_before / rms_after:.0f}, u {rms_u:.2e}")

    assert rms_after * 30 <= rms_before
    assert rms_after <= 1.2 * rms_u

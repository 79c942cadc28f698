"""The errors of a simulated gyroscope beyond scale, bias and white noise are those that were asked for."""

import math

import numpy as np
import pytest

from firmware_host.emulator.parts.gyroscope import Gyroscope, GyroTruth, Warming, readings
from firmware_host.emulator.parts.triad import LowPass


def reading(truth: GyroTruth, *motion: float, time_s: float = 1.0, temperature_c: float = 25.0) -> list[float]:
    return Gyroscope(lambda _time_s: motion, truth, 1, temperature_c).read(time_s)


def drift(truth: GyroTruth, duration_s: float, step_s: float) -> np.ndarray:
    """The readings (n, 3) of a part at rest without noise."""
    times_s = np.arange(0.0, duration_s, step_s)
    return readings(truth, times_s, np.zeros((len(times_s), 3)), 3)


def allan_deviation(rates: np.ndarray, step_s: float, time_s: float) -> float:
    """Overlapping Allan deviation, the root mean square over the axes (IEEE Std 952-1997, annex C)."""
    m = round(time_s / step_s)
    angle = np.cumsum(rates, axis=0) * step_s
    second = angle[2 * m :] - 2 * angle[m:-m] + angle[: -2 * m]
    return float(np.sqrt(np.mean(second**2) / (2 * time_s**2)))


def test_specific_force_adds_to_a_reading_row_by_row() -> None:
    per_g = ((1e-3, 2e-3, 3e-3), (4e-3, 5e-3, 6e-3), (7e-3, 8e-3, 9e-3))
    truth = GyroTruth((2.0, 2.0, 2.0), (0.1, 0.2, 0.3), g_sensitivity_rad_s_per_g=per_g)
    force_g = (0.5, -1.0, 0.25)
    expected = np.array([0.4, 0.2, 0.0]) / 2 + np.array(per_g) @ force_g - np.array([0.1, 0.2, 0.3])
    assert reading(truth, 0.4, 0.2, 0.0, *force_g) == pytest.approx(expected)


@pytest.mark.parametrize("rate", [-2.0, -0.5, 0.0, 1.0, 3.0])
def test_the_scale_changes_with_the_rate_and_with_its_magnitude(rate: float) -> None:
    """0.05 % per rad/s each: the odd part in both directions alike, the even part in one more and in the other less."""
    odd = reading(GyroTruth(nonlinearity_odd_per_rad_s=5e-4), rate, 0.0, 0.0)[0]
    even = reading(GyroTruth(nonlinearity_even_per_rad_s=5e-4), rate, 0.0, 0.0)[0]
    assert odd == pytest.approx(rate * (1 + 5e-4 * abs(rate)), abs=1e-15)
    assert even == pytest.approx(rate + 5e-4 * rate**2, abs=1e-15)


def test_scale_and_bias_follow_the_temperature_and_hold_where_they_were_found() -> None:
    truth = GyroTruth(
        (1.2, 1.0, 0.9),
        (0.01, 0.0, -0.01),
        scale_per_k=(1e-3, -1e-3, 0.0),
        bias_rad_s_per_k=(1e-4, 2e-4, -3e-4),
        holds_at_c=30.0,
    )
    warming = Warming(20.0, 30.0, 100.0, begins_s=5.0)
    gyroscope = Gyroscope(lambda _time_s: (1.0, 1.0, 1.0), truth, 1, warming)
    for time_s in (0.0, 5.0, 105.0, 5.0 + 1e4):
        off_k = -10.0 * math.exp(-max(0.0, time_s - 5.0) / 100.0)
        scale = np.array(truth.scale) * (1 + np.array(truth.scale_per_k) * off_k)
        bias = np.array(truth.bias_rad_s) + np.array(truth.bias_rad_s_per_k) * off_k
        assert gyroscope.temperature_c(time_s) == pytest.approx(30.0 + off_k)
        assert gyroscope.read(time_s) == pytest.approx(1 / scale - bias)


@pytest.mark.thorough
@pytest.mark.slow
def test_flicker_makes_a_floor_of_the_allan_deviation() -> None:
    """Two hours, a floor around 10 s: level within a fifth from 1 s to 30 s, and it does not begin with a jump."""
    rates = drift(GyroTruth(instability_rad_s=1e-5, instability_time_s=10.0), 7200.0, 0.1)
    assert not rates[0].any()
    for time_s in (1.0, 3.0, 10.0, 30.0):
        assert allan_deviation(rates, 0.1, time_s) == pytest.approx(1e-5, rel=0.2)


@pytest.mark.thorough
@pytest.mark.slow
def test_a_random_walk_grows_with_the_root_of_time() -> None:
    """Allan deviation of a rate random walk q: q √(τ / 3)."""
    rates = drift(GyroTruth(random_walk_rad_s_per_sqrt_s=3e-5), 7200.0, 0.1)
    for time_s in (1.0, 10.0, 60.0):
        assert allan_deviation(rates, 0.1, time_s) == pytest.approx(3e-5 * math.sqrt(time_s / 3), rel=0.15)


def test_the_low_pass_weakens_and_delays_as_one_of_first_order() -> None:
    """A sine of the cut-off frequency: 1/√2 of its height, an eighth of its period late."""
    low_pass, turn = LowPass(5.0), 2 * math.pi * 5.0
    times_s = np.arange(0.0, 2.0, 1e-3)
    seen = np.array([low_pass.step(t, [math.sin(turn * t)])[0] for t in times_s])[1000:]
    assert seen == pytest.approx(math.sqrt(0.5) * np.sin(turn * times_s[1000:] - math.pi / 4), abs=1e-3)
    ramp = LowPass(5.0)
    *_, value = [ramp.step(float(t), [3.0 * t])[0] for t in np.arange(0.0, 2.0, 0.05)]
    assert value == pytest.approx(3.0 * (1.95 - 1 / turn), abs=1e-9)  # exact however far apart the steps of a ramp are


def test_a_reading_is_late_by_the_delay() -> None:
    gyroscope = Gyroscope(lambda time_s: (time_s, 2 * time_s, 0.0), GyroTruth(delay_s=0.003), 1)
    assert gyroscope.read(1.0) == pytest.approx([0.997, 1.994, 0.0])


def test_arrays_of_readings_are_those_taken_one_by_one() -> None:
    truth = GyroTruth(
        (1.1, 0.9, 1.0),
        (0.01, -0.02, 0.03),
        0.002,
        (0.01, -0.005, 0.004),
        (1e-4, 0.0, -1e-4),
        (1e-4, 1e-4, 0.0),
        25.0,
        ((1e-3, 0.0, 0.0), (0.0, 1e-3, 0.0), (1e-3, 0.0, 1e-3)),
        2e-4,
        5e-4,
        40.0,
        0.0,
        1e-5,
        10.0,
        1e-5,
    )
    times_s = np.arange(400) / 200.0 + 0.01
    motion = np.column_stack([np.sin(times_s * rate) for rate in (1.0, 2.0, 3.0, 0.5, 0.7, 0.9)])
    rows = dict(zip(times_s.tolist(), motion.tolist(), strict=True))
    warming = Warming(20.0, 30.0, 1.0)
    gyroscope = Gyroscope(rows.__getitem__, truth, 5, warming)
    one_by_one = np.array([gyroscope.read(time_s) for time_s in rows])
    np.testing.assert_allclose(readings(truth, times_s, motion, 5, warming), one_by_one, atol=1e-12)


def test_drift_leaves_the_noise_as_it_was() -> None:
    """Another effect switched on does not draw other noise."""
    times_s, still = np.arange(10) / 10, np.zeros((10, 3))
    quiet = readings(GyroTruth(noise_rad_s=0.01), times_s, still, 3)
    drifting = readings(GyroTruth(noise_rad_s=0.01, random_walk_rad_s_per_sqrt_s=1e-9), times_s, still, 3)
    np.testing.assert_allclose(drifting, quiet, atol=1e-7)

"""The errors of a simulated accelerometer are those that were asked for."""

import numpy as np
import pytest

from firmware_host.emulator.parts.accelerometer import Accelerometer, AccelerometerTruth, accelerations
from firmware_host.emulator.parts.gyroscope import Warming

G_M_S2 = 9.80665
TRUTH = AccelerometerTruth((1.02, 0.99, 1.01), (0.2, -0.1, 0.3), 0.0, (0.02, -0.01, 0.03), (1e-4, -9e-5, 2e-5))


def reading(truth: AccelerometerTruth | None, *motion: float) -> list[float]:
    return Accelerometer(lambda _time_s: motion, truth, 1).read(1.0)


def test_a_reading_is_the_bent_force_along_its_axes_divided_by_scale_less_the_bias() -> None:
    """s + φ s² along each component, then the axes, then g = K (m + b) as of a gyroscope."""
    force_g = np.array([0.5, -0.7, 0.4])
    s = G_M_S2 * force_g
    axes = np.array(
        [
            [1.0, 0.0, 0.0],
            [np.sin(0.02), np.cos(0.02), 0.0],
            [np.sin(-0.01), np.sin(0.03), np.sqrt(1 - np.sin(0.01) ** 2 - np.sin(0.03) ** 2)],
        ]
    )
    expected = axes @ (s + TRUTH.second_order_s2_m * s**2) / TRUTH.scale - TRUTH.bias_m_s2
    assert reading(TRUTH, 9.0, 9.0, 9.0, *force_g.tolist()) == pytest.approx(expected.tolist(), rel=1e-14)


def test_without_a_truth_the_force_is_felt_as_it_is() -> None:
    assert reading(None, 1.0, 2.0, 3.0, 0.25, -0.5, 2.0) == [0.25 * G_M_S2, -0.5 * G_M_S2, 2.0 * G_M_S2]
    assert reading(None, 1.0, 2.0, 3.0) == [0.0, 0.0, G_M_S2]


def test_arrays_of_readings_are_those_taken_one_by_one() -> None:
    truth = AccelerometerTruth(
        (1.1, 0.9, 1.0),
        (0.1, -0.2, 0.3),
        0.02,
        (0.01, -0.005, 0.004),
        (1e-4, 0.0, -1e-4),
        (1e-4, 0.0, -1e-4),
        (1e-3, 1e-3, 0.0),
        25.0,
        40.0,
        0.0,
        1e-3,
        10.0,
        1e-3,
    )
    times_s = np.arange(400) / 200.0 + 0.01
    force_g = np.column_stack([np.sin(times_s * rate) for rate in (1.0, 2.0, 3.0)])
    rows = {t: (0.0, 0.0, 0.0, *force) for t, force in zip(times_s.tolist(), force_g.tolist(), strict=True)}
    warming = Warming(20.0, 30.0, 1.0)
    accelerometer = Accelerometer(rows.__getitem__, truth, 5, warming)
    one_by_one = np.array([accelerometer.read(time_s) for time_s in rows])
    np.testing.assert_allclose(accelerations(truth, times_s, G_M_S2 * force_g, 5, warming), one_by_one, atol=1e-12)


def test_a_reading_is_late_by_the_delay() -> None:
    late = Accelerometer(lambda time_s: (0.0, 0.0, 0.0, time_s, 0.0, 0.0), AccelerometerTruth(delay_s=0.003), 1)
    assert late.read(1.0)[0] == pytest.approx(0.997 * G_M_S2)


def test_noise_is_as_strong_as_configured() -> None:
    times_s = np.arange(3000) / 200.0
    noisy = accelerations(AccelerometerTruth(noise_m_s2=0.05), times_s, np.zeros((3000, 3)), 3)
    assert noisy.std(axis=0) == pytest.approx(0.05, rel=4 / np.sqrt(6000))

"""Vibrations are found in readings as lines, and what a part of the readings keeps of them is taken out."""

import numpy as np
import pytest

from rig.observation.statistics.spectral_lines import LineSearch, find_lines, fit_columns, running_median, waves

COUNT, RATE_HZ, NOISE = 1200, 200.0, 4.5e-4
STRICT = LineSearch(stands_out=30.0)


def residuals(seed: int, hertz: float = 0.0, size: float = 0.0, turns: float = 0.0, noise: float = NOISE) -> np.ndarray:
    """(n, 3) white noise and a vibration about one direction, of a sensor that meanwhile makes so many turns."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(COUNT) / RATE_HZ
    shaken = size * np.sqrt(2) * np.sin(2 * np.pi * hertz * time_s + rng.uniform(0, 6))
    turned = 2 * np.pi * turns * np.arange(COUNT) / COUNT
    felt = shaken[:, None] * np.column_stack([np.cos(turned), np.sin(turned), np.zeros(COUNT)])
    return np.asarray(felt + noise * rng.standard_normal((COUNT, 3)))


def test_white_noise_has_no_lines() -> None:
    assert all(find_lines(residuals(seed), STRICT).size == 0 for seed in range(50))


@pytest.mark.parametrize("turns", [0.0, 1.0])
def test_of_a_vibration_hardly_more_is_left_than_the_noise(turns: float) -> None:
    """Wherever its frequency lies between two bins, and though a sensor that turns feels it come and go."""
    share = np.arange(COUNT) / COUNT
    for seed, hertz in enumerate(np.linspace(8, 30, 12)):
        seen = residuals(seed, float(hertz), 0.004, turns)
        cycles = find_lines(seen, STRICT)
        columns = waves(cycles, share)
        left = seen - columns @ fit_columns(columns, seen)
        assert turns or np.abs(cycles - hertz * COUNT / RATE_HZ).min() < 0.05
        assert left.std(axis=0).max() < 1.5 * NOISE  # of nine times the noise


@pytest.mark.slow
def test_two_vibrations_that_are_near_each_other_are_told_apart() -> None:
    """Less than three cycles apart, of a quiet sensor that feels one of them come and go."""
    share, quiet = np.arange(COUNT) / COUNT, NOISE / 8
    for seed, apart_hz in enumerate(np.linspace(0.27, 0.47, 12)):
        seen = residuals(seed, 23.0, 0.001, 1.0, quiet) + residuals(100 + seed, 23.0 + float(apart_hz), 0.001, 0.0, 0.0)
        columns = waves(find_lines(seen, STRICT), share)
        left = seen - columns @ fit_columns(columns, seen)
        assert left.std(axis=0).max() < 1.3 * quiet


def test_readings_too_few_to_tell_a_line_have_none() -> None:
    assert find_lines(residuals(1, 20.0, 0.1)[:40], STRICT).size == 0


@pytest.mark.slow
@pytest.mark.parametrize("bins", [6, 16, 26, 27, 200])
def test_the_noise_around_a_line_is_the_median_of_its_neighbours(bins: int) -> None:
    """Also where the spectrum, mirrored, is shorter than the median's window: SciPy's filter read other memory then."""
    rng = np.random.default_rng(bins)
    half = min(80, 3 * bins)
    for powers in rng.exponential(size=(60, 1, bins)):
        mirrored = np.pad(powers[0], half, mode="symmetric")
        around = [np.median(mirrored[first : first + 2 * half + 1]) for first in range(bins)]
        np.testing.assert_array_equal(running_median(powers), [around])

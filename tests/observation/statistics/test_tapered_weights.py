"""Means of rests in which the arm vibrates: what is left of the vibration, and whether the stated variance is right."""

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.statistics.mean import average_tapered
from rig.observation.statistics.tapered_weights import flank_s, noise_at_zero, vibrates, weights
from rig.observation.windows import Window

RATE_HZ, NOISE_RAD_S = 250.0, 5.5e-5  # a KVH 1775's
VIBRATION_RAD_S = 2e-3
DEG_H = np.pi / 180 / 3600
RESTS = 40


def readings(duration_s: float, vibration_hz: float, seed: int) -> tuple[Array, Array]:
    """(n,) times and (n, 3) mean rates between them of a sensor whose true mean is zero, each axis in its own phase."""
    rng = np.random.default_rng(seed)
    edges = np.arange(round(duration_s * RATE_HZ) + 1) / RATE_HZ
    turn = 2 * np.pi * vibration_hz
    angle = np.sqrt(2) * VIBRATION_RAD_S / turn * np.sin(turn * edges[:, None] + rng.uniform(0, 2 * np.pi, 3))
    noise = NOISE_RAD_S * rng.normal(size=(len(edges) - 1, 3))
    return (edges[1:] + edges[:-1]) / 2, np.diff(angle, axis=0) * RATE_HZ + noise


@pytest.mark.slow
@pytest.mark.parametrize("vibration_hz", [14.0, 9.3])
def test_nothing_is_left_of_a_vibration_and_the_variance_is_that_of_the_noise(vibration_hz: float) -> None:
    off = []
    stated = []
    plain = []
    for seed in range(RESTS):
        duration_s = 9.6 + 0.01 * seed
        time_s, rates = readings(duration_s, vibration_hz, seed)
        assert vibrates(rates)
        found = average_tapered(rates, time_s, Window(0.0, duration_s), Steps(1e-12))
        off.append(found.mean)
        stated.append(found.variance)
        plain.append(rates.mean(axis=0))
    noise = NOISE_RAD_S / np.sqrt(9.8 * RATE_HZ)
    assert np.sqrt(np.mean(np.square(plain))) > 2.5 * noise, "what a plain mean keeps"
    assert np.sqrt(np.mean(np.square(off))) < 1.15 * noise
    assert 0.85 < np.sqrt(np.mean(np.square(off)) / np.mean(stated)) < 1.15


@pytest.mark.slow
def test_white_noise_does_not_vibrate_nor_does_a_bias_that_wanders() -> None:
    rng = np.random.default_rng(1)
    white = rng.normal(size=(20, 2500, 3))
    assert not any(map(vibrates, white))
    assert not any(map(vibrates, white + 0.1 * np.cumsum(rng.normal(size=white.shape), axis=1)))
    assert not vibrates(white[0, :20]), "too short to say"


def test_lines_do_not_count_for_noise() -> None:
    _, rates = readings(10.0, 14.0, 3)
    assert noise_at_zero(rates) == pytest.approx(np.full(3, NOISE_RAD_S**2), rel=0.4)
    assert np.var(rates, axis=0).min() > 1000 * NOISE_RAD_S**2


@pytest.mark.parametrize("duration_s", [0.6, 2.6, 9.6, 360.0])
def test_a_bias_that_walks_sees_an_even_mean_from_half_way_to_half_way(duration_s: float) -> None:
    """Var of the mean of a walk from 0 on: the integral of the squared share that is still to come."""
    time_s = (np.arange(20_000) + 0.5) * duration_s / 20_000
    to_come = 1 - np.cumsum(weights(time_s, 0.0, duration_s))
    half = flank_s(duration_s) / 2
    even = half + (duration_s - 2 * half) / 3
    assert np.mean(to_come**2) * duration_s == pytest.approx(even, rel=5e-3)

"""A bias that wanders: how fast, and what that costs, from simulated averages whose truth is known."""

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import VectorSolution, design_matrix, solve_vector_model
from rig.estimation.statistics.bias_process import (
    BiasProcess,
    bias_process,
    flicker_harmonic_covariance,
    walk_covariance,
)

STEP_S = 0.02
AXES = np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]
SPEED_RAD_S = np.radians(60)


def session() -> tuple[Array, Array]:
    """Windows (12, 2) of six sweeps and the rests after them, and the rates (12, 3): sweeps first."""
    begins = 10.0 * np.arange(6, dtype=np.float64)
    sweeps, rests = np.column_stack([begins, begins + 6]), np.column_stack([begins + 6.5, begins + 9.1])
    return np.concatenate([sweeps, rests]), np.concatenate([SPEED_RAD_S * AXES, np.zeros((6, 3))])


def draw_walk(windows_s: Array, rate: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Means (12, 3) of a random walk over the windows, and its mean (3,) over the whole time."""
    times_s = np.arange(windows_s.min(), windows_s.max(), STEP_S)
    walk = np.cumsum(rate * np.sqrt(STEP_S) * rng.standard_normal((len(times_s), 3)), axis=0)
    inside = (times_s >= windows_s[:, :1]) & (times_s < windows_s[:, 1:])
    return np.array([walk[each].mean(axis=0) for each in inside]), walk.mean(axis=0)


@pytest.mark.slow
def test_the_covariance_of_a_walk_is_that_of_many_walks() -> None:
    windows_s, _ = session()
    rng = np.random.default_rng(1)
    means = []
    for _ in range(1500):
        seen, whole = draw_walk(windows_s, 1.0, rng)
        means.append((seen - whole).T)
    found = np.cov(np.concatenate(means).T)
    expected = walk_covariance(windows_s)
    assert np.abs(found - expected).max() < 0.06 * expected.diagonal().max()


@pytest.mark.slow
@pytest.mark.kernels
def test_flicker_changes_the_harmonics_of_revolutions_as_drawn_flicker_does() -> None:
    samples, revolution = 2**18, 1024
    rng = np.random.default_rng(5)
    spectrum = np.fft.rfft(rng.standard_normal((20, samples)))[:, 1:] / np.sqrt(np.arange(1, samples // 2 + 1))
    flicker = np.fft.irfft(np.insert(spectrum, 0, 0, axis=1)).reshape(-1, revolution)
    allan_variance = np.mean(np.diff(flicker.mean(axis=1).reshape(20, -1)) ** 2) / 2
    angle_rad = 2 * np.pi * (np.arange(revolution) + 0.5) / revolution
    waves = np.stack([np.ones(revolution), 2 * np.cos(angle_rad), 2 * np.sin(angle_rad)], axis=1) / revolution
    drawn = np.cov((flicker @ waves).T) / allan_variance
    drawn[0, 0] = 0.0  # depends on the time between the revolutions
    print(drawn)
    assert np.abs(drawn - flicker_harmonic_covariance()).max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(  # of a sample, at 200 Hz: ADIS16465, LSM9DS1
    "noise_rad_s", [pytest.param(0.00045, marks=[pytest.mark.proof, pytest.mark.thorough]), 0.002]
)
def test_a_bias_that_walks_is_as_uncertain_as_it_has_to_be(noise_rad_s: float) -> None:
    windows_s, rates = session()
    variances = noise_rad_s**2 / (200 * (windows_s[:, 1:] - windows_s[:, :1])) * np.ones(3)
    rng = np.random.default_rng(2)
    errors = []
    widths = []
    known = BiasProcess(3e-5, 0.0, 0)
    best = solve(rates + 1e-9 * rng.standard_normal((12, 3)), rates, variances, known, windows_s)
    for _ in range(150):
        wandered, whole = draw_walk(windows_s, 3e-5, rng)
        means = rates + wandered + np.sqrt(variances) * rng.standard_normal((12, 3))
        process = bias_process(design_matrix(rates, None), means, variances, windows_s)
        found = solve(means, rates, variances, process, windows_s)
        std = np.sqrt(np.diag(found.covariance))[3:]
        errors.append((found.bias_rad_s + whole) / std)
        widths.append(std / np.sqrt(np.diag(best.covariance))[3:])
    rms = np.sqrt(np.mean(np.square(errors)))
    print(f"RMS of error over std {rms:.2f}, std over that with the walk known {np.mean(widths):.2f}")
    assert 0.8 < rms < 1.2
    assert np.mean(widths) < 1.4


def solve(means: Array, rates: Array, variances: Array, process: BiasProcess, windows_s: Array) -> VectorSolution:
    shared = None if process.steady else process.covariance(windows_s)
    return solve_vector_model(means, rates, variances, shared_covariance_rad2_s2=shared)


@pytest.mark.slow
@pytest.mark.proof
def test_a_steady_bias_is_stated_hardly_less_well_than_if_it_were_known_to_be(thorough: bool) -> None:
    windows_s, rates = session()
    variances = np.full((12, 3), 1e-10)
    rng = np.random.default_rng(3)
    widths = []
    errors = []
    for _ in range(200 if thorough else 80):
        means = rates + np.sqrt(variances) * rng.standard_normal((12, 3))
        process = bias_process(design_matrix(rates, None), means, variances, windows_s)
        found = solve(means, rates, variances, process, windows_s)
        best = solve(means, rates, variances, BiasProcess(dof=24), windows_s)
        std = np.sqrt(np.diag(found.covariance))[3:]
        widths.append(std / np.sqrt(np.diag(best.covariance))[3:])
        errors.append(found.bias_rad_s / std)
    rms = np.sqrt(np.mean(np.square(errors)))
    print(f"std over that of a steady bias {np.mean(widths):.3f}, RMS of error over std {rms:.2f}")
    assert np.mean(widths) < 1.1
    assert 0.85 < rms < 1.1


def test_what_the_sweeps_turn_is_nothing_to_the_walk_that_is_found() -> None:
    """Of a sensor so quiet that its means lie a million standard deviations from zero."""
    windows_s, rates = session()
    variances, rng = np.full((12, 3), 1e-12), np.random.default_rng(4)
    wandered = draw_walk(windows_s, 3e-6, rng)[0] + 1e-6 * rng.standard_normal((12, 3))
    design = design_matrix(rates, None)
    still = bias_process(design, wandered, variances, windows_s)
    turned = bias_process(design, rates + wandered, variances, windows_s)
    assert turned.walk_rad_s_sqrt_s == pytest.approx(still.walk_rad_s_sqrt_s, rel=1e-7)
    assert turned.scatter_rad_s == pytest.approx(still.scatter_rad_s, rel=1e-7)

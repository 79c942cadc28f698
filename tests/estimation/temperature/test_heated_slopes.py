"""Slopes over temperature that a run with the simulated board's heater finds, with all that its world has."""

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.estimation.temperature.over_temperature import fit_over_temperature
from rig.estimation.temperature.temperature_polynomials import powers_at
from support.motions.heated_course import BIAS_RAD_S, HYSTERESIS_RAD_S, REFERENCE_C, SCALE, repeat_means, warm_board

pytestmark = pytest.mark.slow

COLD_C, WARM_C = 26.0, 44.0
GRADIENT_K = 0.1  # uncertainty.thermometer_gradient_k as it usually is


def errors(sensors: int) -> tuple[Array, Array]:
    """(n, 2, 6) errors over u of what k and c change by, over the range and about its middle; (n, 3) the loop's."""
    of = warm_board()
    slopes = []
    loops = []
    for seed in range(sensors):
        found = fit_over_temperature(repeat_means(of, seed), REFERENCE_C, GRADIENT_K)
        assert found.hysteresis is not None
        pairs = ((COLD_C, WARM_C), (REFERENCE_C - 1, REFERENCE_C + 1))
        slopes.append([changed(found.coefficients, found.covariance, *pair) for pair in pairs])
        loops.append((found.hysteresis[0][3:] + HYSTERESIS_RAD_S) / found.hysteresis[1][3:])
    return np.array(slopes), np.array(loops)


def changed(coefficients: Array, covariance: Array, from_c: float, to_c: float) -> Array:
    """(6,) error over u of what changes between two temperatures; k in the size that was found."""
    powers = np.array([(to_c - REFERENCE_C) ** n - (from_c - REFERENCE_C) ** n for n in (1, 2)])
    true = np.concatenate([coefficients[:3] * (powers @ SCALE[1:]), -powers @ BIAS_RAD_S[1:]])
    rows = powers_at(to_c - REFERENCE_C) - powers_at(from_c - REFERENCE_C)
    error: Array = (rows @ coefficients - true) / np.sqrt(np.diag(rows @ covariance @ rows.T))
    return error


def test_slopes_of_a_heated_run_lie_within_u() -> None:
    slopes, loops = errors(3)

    assert np.mean(np.abs(slopes) < 1.97) > 0.85
    assert np.sqrt(np.mean(slopes**2)) < 1.3 and np.sqrt(np.mean(loops**2)) < 1.6


@pytest.mark.thorough
@pytest.mark.proof
def test_slopes_of_forty_heated_runs_lie_within_u() -> None:
    slopes, loops = errors(40)
    within, rms, of_loops = np.mean(np.abs(slopes) < 1.97), np.sqrt(np.mean(slopes**2, axis=(0, 1))), np.std(loops)
    print(
        f"within U {within:.3f}; RMS over u of kx ky kz bx by bz {np.round(rms, 2)}; of the hysteresis {of_loops:.2f}"
    )

    assert 0.93 <= within <= 0.995, "the gradient that is assumed is up to twice what this board's heater makes"
    assert of_loops < 1.2

"""What readings are corrected by."""

import numpy as np
import pytest

from rig.analysis.gyroscope.correction import diagonal_correction, matrix_correction
from rig.estimation.gyroscope.vector_model import solve_vector_model
from rig.estimation.sensor_axes import nearest_rotation

SCALE, BIAS_RAD_S = np.array([1.1771, 1.1554, 1.1440]), np.array([0.0077, -0.0100, -0.0051])
AXES = np.array([[1.0, 0.02, -0.01], [0.08, 1.0, 0.03], [-0.05, 0.015, 1.0]])
AXES /= np.linalg.norm(AXES, axis=1)[:, None]
RATES_RAD_S = np.array([*np.eye(3), *-np.eye(3)])
READINGS_RAD_S = RATES_RAD_S @ AXES.T / SCALE - BIAS_RAD_S
SOLUTION = solve_vector_model(READINGS_RAD_S, RATES_RAD_S, np.full((6, 3), 1e-6))


def test_the_whole_matrix_gives_the_rates_in_the_right_angled_frame_nearest_to_the_axes() -> None:
    found = matrix_correction(SOLUTION)
    rates = (READINGS_RAD_S + SOLUTION.bias_rad_s) @ found.matrix.T
    assert found.kind == "matrix"
    assert rates == pytest.approx(RATES_RAD_S @ nearest_rotation(AXES).T, abs=1e-12)


def test_beside_the_scale_factors_it_turns_nothing() -> None:
    skew = matrix_correction(SOLUTION).matrix / SOLUTION.scale
    assert skew == pytest.approx(skew.T, abs=1e-12)
    assert np.all(np.linalg.eigvalsh(skew) > 0)


def test_at_right_angles_it_is_the_diagonal() -> None:
    readings = RATES_RAD_S / SCALE - BIAS_RAD_S
    straight = solve_vector_model(readings, RATES_RAD_S, np.full((6, 3), 1e-6))
    assert matrix_correction(straight).matrix == pytest.approx(diagonal_correction(SCALE).matrix, abs=1e-12)

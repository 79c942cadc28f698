"""What a solve expects its residuals to scatter by is what they do."""

import numpy as np
import pytest

from rig.estimation.gyroscope.vector_fit import VectorFit, VectorInputs, explain
from rig.estimation.residuals import dwell_residual_std_m_s2, residual_std_rad_s
from support.recordings import drawn_accelerations

pytestmark = pytest.mark.slow

SPEED_RAD_S, NOISE_RAD_S, SPEED_STD_RAD_S = 1.0, 2e-4, 1.5e-4
MATRIX = np.array([[1.1, 0.02, 0.0], [0.0, 0.9, 0.01], [0.01, 0.0, 1.05]])


def session(rng: np.random.Generator, walk_rad_s_sqrt_s: float = 0.0) -> VectorFit:
    """Six sweeps, some noisier than others and of a speed that is not exact, and six rests; a bias that walks."""
    turns = SPEED_RAD_S * np.concatenate([np.eye(3), -np.eye(3), np.zeros((6, 3))])
    std = NOISE_RAD_S * np.linspace(0.5, 1.5, 12)[:, None] * np.ones((1, 3))
    windows_s = 10.0 * np.arange(12, dtype=np.float64)[:, None] + [0.0, 6.0]
    speed_std = np.where(turns.any(axis=1), SPEED_STD_RAD_S, 0.0)
    swept = turns * (1 + speed_std * rng.normal(size=12) / SPEED_RAD_S)[:, None]
    bias = walk_rad_s_sqrt_s * np.sqrt(10.0) * np.cumsum(rng.normal(size=(12, 3)), axis=0)
    attitudes = np.array([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(12)])
    return explain(
        VectorInputs(
            means_rad_s=swept @ MATRIX.T + 0.01 + bias + std * rng.normal(size=std.shape),
            variances_rad2_s2=std**2,
            turns_rad_s=turns,
            earth_rate_rad_s=np.zeros(3),
            speed_std_rad_s=speed_std,
            attitudes=attitudes,
            gravity_m_s2=attitudes @ [0.0, 0.0, -9.81],
            windows_s=windows_s,
            joints=(*["wrist_1"] * 6, *[None] * 6),
        ),
        np.eye(3),
    )


@pytest.mark.proof
@pytest.mark.parametrize(("walk_rad_s_sqrt_s", "within"), [(0.0, 0.08), (2e-4, 0.2)])
def test_residuals_scatter_by_what_is_expected_of_them(walk_rad_s_sqrt_s: float, within: float, thorough: bool) -> None:
    rng = np.random.default_rng(4)
    sessions = [session(rng, walk_rad_s_sqrt_s) for _ in range(120 if thorough else 40)]
    ratio = np.array([each.solution.residuals_rad_s / residual_std_rad_s(each) for each in sessions])
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=within if thorough else 1.5 * within)
    assert 0.92 < np.mean(np.abs(ratio) < 2) < (0.99 if thorough else 0.995)


@pytest.mark.thorough
@pytest.mark.one_in(2)
@pytest.mark.parametrize("part", ["lsm9ds1", "mpu9250", "adis16465", "kvh1775"])
def test_sensors_within_their_data_sheets_leave_what_the_solve_expects_of_them(part: str) -> None:
    """Two standard deviations hold nine tenths and more; noise and attitudes alone would make it two to six."""
    within = []
    for seed in range(8):
        session = drawn_accelerations.drawn(part, seed)
        solution, _, _ = drawn_accelerations.solve_session(session)
        expected = dwell_residual_std_m_s2(solution, session.movement)
        within.append(np.abs(solution.dwell_residuals_m_s2) <= 2 * expected)
    assert 0.9 < np.mean(within) < 0.99

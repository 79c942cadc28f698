"""One axis a stage: how the item sits nobody tells, and the square of that is in the budget of the scale."""

import numpy as np
import pytest

from rig.analysis.gyroscope.vector_inputs import list_mount_rotations
from rig.config.procedures.stage_section import rotation_by
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import REMOUNTING, Budget, UnknownErrors, budget
from rig.estimation.gyroscope.vector_fit import VectorInputs, explain

MOUNT_DEG, SPEED_RAD_S, NOISE_RAD_S = 1.0, 1.0, 1e-7
UNKNOWN = UnknownErrors(
    clock_std=0.0, clock_source="", state_jitter_s=0.0, axis_rad=0.0, sensor_offset_m=0.0,
    g_sensitivity_rad_s_per_g=0.0, earth_rate=False, mount_rad=float(np.radians(MOUNT_DEG)),
)  # fmt: skip


def solved(off_rad: Array, axes: Array, matrix: Array) -> tuple[Array, Budget]:
    """Errors of the scale (3,) and the budget, of stages turned about `axes` (S, n, 3) there and back, a rest after.

    In a stage the item is turned by `off_rad` (S, 3) against its mount.
    """
    stages = np.repeat(np.arange(len(axes)), 2 * axes.shape[1])
    turns = SPEED_RAD_S * np.concatenate([axes, -axes], axis=1).reshape(-1, 3)
    felt = np.array([rotation_by(off_rad[stage]) @ turn for stage, turn in zip(stages, turns, strict=True)])
    rest, count = np.zeros((1, 3)), len(turns) + 1
    windows = 10.0 * np.arange(count, dtype=np.float64)[:, None] + [0.0, 6.0]
    noise = NOISE_RAD_S * np.random.default_rng(1).standard_normal((count, 3))
    seen = VectorInputs(
        means_rad_s=np.concatenate([felt, rest]) @ matrix.T + 0.01 + noise,
        variances_rad2_s2=np.full((count, 3), NOISE_RAD_S**2),
        turns_rad_s=np.concatenate([turns, rest]),
        earth_rate_rad_s=np.zeros(3),
        speed_std_rad_s=np.zeros(count),
        attitudes=np.tile(np.eye(3), (count, 1, 1)),
        gravity_m_s2=np.tile([0.0, 0.0, -9.8], (count, 1)),
        windows_s=windows,
        joints=(*["wrist_3"] * len(turns), None),
        axis_errors_rad_s=np.zeros((0, count, 3)),
        mount_turns_rad=list_mount_rotations(stages.tolist(), 1, MOUNT_DEG),
    )
    found = explain(seen, np.eye(3))
    return found.solution.scale - 1 / np.linalg.norm(matrix, axis=1), budget(found, UNKNOWN)


def drawn(axes: Array, matrix: Array, count: int) -> tuple[float, float, float]:
    """Errors of the scale by their standard uncertainty, root mean square and largest; and the errors in ppm."""
    rng = np.random.default_rng(7)
    ratios = []
    errors = []
    for _ in range(count):
        error, found = solved(np.radians(MOUNT_DEG) * rng.uniform(-1, 1, (len(axes), 3)), axes, matrix)
        ratios.append(error / found.std_of(REMOUNTING)[:3])
        errors.append(error)
    rms, off_ppm = (float(np.sqrt(np.mean(np.square(each)))) for each in (ratios, errors))
    return rms, float(np.abs(ratios).max()), 1e6 * off_ppm


@pytest.mark.slow
@pytest.mark.proof
def test_of_a_sensor_along_the_axes_the_square_is_all_there_is(thorough: bool) -> None:
    """What the first order says of one whose axes seem square is nothing: errors were eight times their uncertainty."""
    rms, largest, off_ppm = drawn(np.eye(3)[:, None], np.eye(3), 60 if thorough else 40)
    assert off_ppm > 60
    assert 0.3 < rms < 1.2  # what could be is not told from what is
    assert largest < 3


@pytest.mark.slow
@pytest.mark.proof
def test_of_a_sensor_askew_both_orders_count(thorough: bool) -> None:
    askew = np.diag([0.95, 1.0, 1.05]) @ rotation_by(np.radians([3.0, -2.0, 4.0]))
    rms, largest, _ = drawn(np.eye(3)[:, None], askew, 60 if thorough else 24)
    assert 0.8 < rms < 1.2
    assert largest < 4  # a square has a longer tail than what is linear


def test_mounts_that_the_sweeps_tell_leave_no_square() -> None:
    _, found = solved(np.radians([[0.0, 0.0, 0.0], [1.0, -0.5, 0.8]]), np.tile(np.eye(3), (2, 1, 1)), np.eye(3))
    assert found.std_of(REMOUNTING)[:3] == pytest.approx(np.zeros(3), abs=2e-6)

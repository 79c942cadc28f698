"""What more axes and more speeds tell: the sensor's own angles, and how nonlinear it is."""

from dataclasses import replace
from functools import cache
from math import pi

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.gyroscope.calibration import SensorResult
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import NOMINAL
from support.recordings.synthetic_run import Setup, synthetic_run, truth

pytestmark = pytest.mark.slow


def made(*errors_rad: float) -> DenavitHartenberg:
    """An arm whose twists of wrists 1 and 2 and zeros of wrists 2 and 3 are off by so much."""
    twist_1, twist_2, zero_2, zero_3 = errors_rad
    return replace(
        NOMINAL,
        theta_rad=(0, 0, 0, 0, zero_2, zero_3),
        alpha_rad=(pi / 2, 0, 0, pi / 2 + twist_1, -pi / 2 + twist_2, 0),
    )


# As noisy as an MPU-9250: 0.01 °/s/√Hz.
THREE = Setup(noise_rad_s=0.0019, kinematics=made(1e-3, -1e-3, 1e-3, 1e-3))
SIX = replace(THREE, procedure=(("axes", "6"),))
CURVED = Setup(
    noise_rad_s=0.0019, odd_per_rad_s=5e-4, even_per_rad_s=-3e-4, procedure=(("speeds_deg_s", "[30, 60, 120]"),)
)


@cache
def solved(setup: Setup) -> SensorResult:
    return calibrate([synthetic_run(setup)]).results["gyro"]


def skew_deg(result: SensorResult) -> tuple[float, float]:
    """The largest non-orthogonality found, and the largest standard deviation stated; the sensor's is zero."""
    solution = result.vector_model
    assert isinstance(solution, VectorSolution)
    std = np.sqrt(np.diag(solution.angles_covariance_rad2))[:3]
    return float(np.degrees(np.abs(solution.non_orthogonality_rad).max())), float(np.degrees(std.max()))


def off(setup: Setup) -> Array:
    """(6,) error of scale and bias in standard deviations."""
    result = solved(setup)
    error: Array = np.array([*result.scale, *result.bias_rad_s]) - truth(setup)
    return error / np.sqrt(np.diag(result.solution.covariance))


def test_three_axes_do_not_tell_the_sensors_angles_from_the_arms_and_say_so() -> None:
    found, std = skew_deg(solved(THREE))
    assert found > 0.04
    assert found < 3 * std


def test_six_axes_tell_them_apart() -> None:
    found, std = skew_deg(solved(SIX))
    assert found < 0.01
    assert std < 0.01


def test_six_axes_leave_scale_and_bias_as_well_known() -> None:
    assert np.abs(off(SIX)).max() < 4


def test_several_speeds_tell_the_nonlinearity_and_the_scale_without_it() -> None:
    explained = solved(CURVED).explained
    assert explained is not None
    found = explained.nonlinearity
    assert found is not None
    assert (np.abs(found.odd_per_rad_s - 5e-4) < 4 * found.odd_std_per_rad_s).all()
    assert (np.abs(found.even_per_rad_s + 3e-4) < 4 * found.even_std_per_rad_s).all()
    assert found.odd_std_per_rad_s.max() < 1e-4
    assert np.abs(off(CURVED)).max() < 4


def test_one_speed_tells_no_nonlinearity_and_is_named() -> None:
    explained = solved(THREE).explained
    assert explained is not None
    assert explained.nonlinearity is None
    assert explained.inputs.speeds_rad_s == pytest.approx((pi / 3,), rel=1e-3)

"""Which arm a recording is read by shows in how the sensor's axes lie."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from rig.analysis.environment import find_environment
from rig.analysis.gyroscope.calibration import observe_recordings, solve_observed
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.motion.geometry import NOMINAL
from support.recordings.synthetic_run import Setup, synthetic_run

pytestmark = pytest.mark.slow

# The twists of a real arm's wrists (ur_calibration, doc/algorithm.rst), and joint zeros of the same size.
MADE = replace(NOMINAL, theta_rad=(0, 0, 0, 0, 6e-4, 0), alpha_rad=(pi / 2, 0, 0, pi / 2 - 8.1e-4, -pi / 2 + 4.1e-4, 0))


def non_orthogonality(setup: Setup) -> Array:
    run = synthetic_run(setup)
    recordings = observe_recordings([run])
    solved = solve_observed(run.sensors, recordings, find_environment(recordings, run.settings))
    solution = solved["gyro"].vector_model
    assert isinstance(solution, VectorSolution)
    return solution.non_orthogonality_rad


def test_the_sensors_axes_are_found_on_an_arm_whose_controller_knows_it() -> None:
    setup = Setup(kinematics=MADE, noise_rad_s=0.001)
    known, unknown = (np.abs(non_orthogonality(replace(setup, stated_kinematics=told))).max() for told in (MADE, None))
    assert known < 1e-4
    assert unknown > 5e-4

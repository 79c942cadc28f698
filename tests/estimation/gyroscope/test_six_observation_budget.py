"""The response of the six-observation solution, by which its budget is made."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.environment import find_environment
from rig.analysis.gyroscope.calibration import observe_recordings, solve_six_observation
from rig.analysis.gyroscope.vector_inputs import collect_inputs
from rig.estimation.gyroscope.accumulator import Solution
from rig.estimation.gyroscope.six_observation_budget import response_of
from rig.estimation.gyroscope.vector_fit import VectorInputs
from rig.observation.observe import Observation
from support.recordings.synthetic_run import Setup, synthetic_run

pytestmark = pytest.mark.slow

Turns = tuple[tuple[Observation, ...], Solution, VectorInputs]


@pytest.fixture(scope="module")
def turns() -> Turns:
    recordings = observe_recordings([synthetic_run(Setup(repeats=2))])
    observations = recordings[0].sensors["gyro"].revolutions
    environment = find_environment(recordings, recordings[0].run.settings)
    assert environment is not None
    return observations, solve_six_observation(observations, "newton"), collect_inputs(recordings, "gyro", environment)


def test_it_is_the_derivative_of_the_solution(turns: Turns) -> None:
    observations, found, seen = turns
    response = response_of(found, seen)
    step = 1e-6
    for place in (0, 5, 11):
        for axis in range(3):
            moved = list(observations)
            mean = moved[place].average.mean_rad_s + step * np.eye(3)[axis]
            moved[place] = replace(moved[place], average=replace(moved[place].average, mean_rad_s=mean))
            other = solve_six_observation(moved, "newton")
            change = np.concatenate([other.scale - found.scale, other.bias_rad_s - found.bias_rad_s]) / step
            assert response[:, place, axis] == pytest.approx(change, abs=2e-4, rel=1e-2)

"""What a recording tells of its sensors at rest: within rests, never across, and not where readings are missing."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.rest_noise import AtRest, at_rest
from rig.data.quantity import RATE
from rig.data.recording.run_file import RunData
from rig.errors import Fault
from rig.estimation.statistics.allan import AllanReading
from support.recordings.synthetic_run import SENSITIVITY, Setup, synthetic_run

NOISE_RAD_S = 0.01
SETUP = Setup(rest_s=20.0, speed_deg_s=150, noise_rad_s=NOISE_RAD_S)
RANDOM_WALK = np.hypot(NOISE_RAD_S, SENSITIVITY / np.sqrt(12)) / np.sqrt(SETUP.sample_rate_hz)


@pytest.fixture(scope="module")
def run() -> RunData:
    return synthetic_run(SETUP)


def rates(run: RunData) -> AtRest:
    return at_rest([run])["gyro"].quantities.results[RATE]


@pytest.mark.slow
def test_random_walk_is_found_in_the_rests_between_sweeps(run: RunData) -> None:
    found = rates(run)
    assert found.stretches == 6 and found.total_s == pytest.approx(6 * 19.6, abs=0.1)
    assert found.longest_s == pytest.approx(19.6, abs=0.02) and found.temperature_c == (22.0, 22.0)
    for axis in found.axes:
        assert isinstance(axis.random_walk, AllanReading)
        assert axis.random_walk.value == pytest.approx(RANDOM_WALK, abs=4 * axis.random_walk.std)
        assert isinstance(axis.bias_instability, Fault), "seconds tell nothing of it"


@pytest.mark.slow
def test_a_missing_reading_parts_a_rest_in_two(run: RunData) -> None:
    whole = rates(run)
    samples = run.samples["gyro"]
    middle = int(np.searchsorted(np.arange(len(samples)), 0.5 * len(samples)))
    inside = [index for index in (middle, middle + 238 * 10, middle + 238 * 20) if index < len(samples)]
    found = rates(replace(run, samples={"gyro": np.delete(samples, inside)}))
    assert whole.stretches < found.stretches <= whole.stretches + 3


@pytest.mark.slow
def test_a_rest_in_which_the_arm_moved_is_left_out(run: RunData) -> None:
    arm = run.states.copy()
    arm["q_rad"][(arm["time_s"] > run.states["time_s"][-1] - 15.0), 5] += 0.01
    assert rates(replace(run, states=arm)).stretches == 5

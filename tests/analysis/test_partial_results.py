"""What is told of a run that goes on is what the recording holds by then, and the result's own once it is whole."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.partial_results import so_far
from rig.data.recording.recorded_events import SweepFinished
from rig.data.recording.run_data import RunData
from rig.errors.attempts import Attempts
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.observation.average import synchronize_stream
from rig.observation.motion.arm_motion import motion_of
from rig.observation.windows import swept
from support.recordings.synthetic_run import BIAS_RAD_S, SCALE, Setup, synthetic_run

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run() -> RunData:
    return synthetic_run(Setup(noise_rad_s=0.005))


def until(run: RunData, sweeps: int) -> RunData:
    """The recording as it was when so many sweeps were done."""
    ends = [place for place, event in enumerate(run.events) if isinstance(event.event, SweepFinished)]
    return replace(run, events=run.events[: ends[sweeps - 1] + 1])


def test_parameters_come_when_the_sweeps_tell_them(run: RunData) -> None:
    for sweeps in range(1, 7):
        found = so_far([until(run, sweeps)]).gyroscopes["gyro"]
        assert sorted(found.sweeps.results) == list(range(sweeps)) and not found.sweeps.faults
        assert isinstance(found.solution, VectorSolution) == (sweeps >= 5)
        if sweeps >= 2:  # with a rest before it
            assert found.bias_rad_s is not None
            bias, std = found.bias_rad_s
            assert np.all(np.abs(bias - BIAS_RAD_S) < 5 * std)
    assert isinstance(found.solution, VectorSolution)  # pyrefly: ignore[unbound-name]  # of six sweeps
    assert np.allclose(found.solution.scale, SCALE, rtol=1e-3)


def test_a_refused_sweep_says_why_and_the_others_count(run: RunData) -> None:
    samples = run.samples["gyro"].copy()
    third = list(swept(run))[2].window
    times_s = synchronize_stream(samples, run.sensors["gyro"], motion_of(run)).time_s
    samples["counts"][np.searchsorted(times_s, (third.start_s + third.end_s) / 2), 0] = 32767
    found = so_far([replace(run, samples={"gyro": samples})]).gyroscopes["gyro"]
    assert {sweep: fault.name for sweep, fault in found.sweeps.faults.items()} == {2: "saturation"}
    assert sorted(found.sweeps.results) == [0, 1, 3, 4, 5]
    assert isinstance(found.solution, VectorSolution)


def test_nothing_is_told_of_a_recording_that_has_only_begun(run: RunData) -> None:
    assert so_far([replace(run, states=run.states[:2], events=())]).gyroscopes == {}
    assert so_far([replace(run, events=())]).gyroscopes["gyro"].sweeps == Attempts()

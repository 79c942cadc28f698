"""What the averages of a run's recordings are to the bias that wanders: one after the other in time."""

from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from support.recordings.synthetic_run import Setup, synthetic_run, truth

pytestmark = pytest.mark.slow

SETUP = Setup(noise_rad_s=0.005)


@pytest.mark.one_in(2)  # earlier than the first, and while it was recorded
@pytest.mark.parametrize("later_s", [-3600, 0, 20, 7200])
def test_a_resumed_recording_begins_after_the_last_one_ended_for_any_time_of_the_computer(later_s: int) -> None:
    """The clock may have been set, and an accelerated laboratory's minutes are a computer's seconds."""
    first, again = synthetic_run(SETUP), synthetic_run(replace(SETUP, seed=2))
    started = datetime.fromisoformat(first.provenance.started_utc) + timedelta(seconds=later_s)
    again = replace(again, provenance=replace(again.provenance, started_utc=started.isoformat()))
    result = calibrate([first, again]).results["gyro"]
    assert result.explained is not None and result.uncertainty is not None
    windows = result.explained.inputs.windows_s
    windows = windows[np.argsort(windows[:, 0])]
    assert (windows[1:, 0] > windows[:-1, 1]).all()
    off = np.array([*result.scale, *result.bias_rad_s]) - truth(SETUP)
    assert (np.abs(off) < 4 * np.sqrt(np.diag(result.uncertainty.covariance))).all()


def test_the_noise_of_an_arm_s_states_counts_in_each_sweep_by_its_weights() -> None:
    result = calibrate([synthetic_run(SETUP)]).results["gyro"]
    assert result.explained is not None
    gains = [turn.state_gain for turn in result.observations]
    np.testing.assert_array_equal(result.explained.inputs.state_gains, [*gains, *np.ones(6)])
    assert min(gains) > 0.5 and max(gains) < 1

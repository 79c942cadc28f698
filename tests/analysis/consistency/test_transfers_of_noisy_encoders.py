"""Transfers are found on an arm whose encoders have the noise of real ones: standing joints seem to turn a little."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.observation.consistency.transfers import average_transfers
from support.recordings.drawn_recording import KINDS, drawn

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", [900, 904])
def test_noise_of_encoders_hides_no_transfer_and_makes_none_longer(seed: int) -> None:
    """Without a look at the rate over a while, one of the four was left out, and two took 0.6 s longer."""
    recordings = observe_recordings([drawn(seed, KINDS["noisy LSM9DS1"]).run])
    site = recordings[0].run.settings.site
    transfers = average_transfers("gyro", recordings, np.eye(3), site, extension_m=np.zeros(3))
    lengths_s = [transfer.interval.end_s - transfer.interval.start_s for transfer in transfers]
    assert lengths_s == pytest.approx([2.08, 2.08, 2.17, 2.17], abs=0.03)


def test_no_angle_of_a_transfer_is_extrapolated() -> None:
    """The last transfer ended half a sample behind the last state: a good gyroscope was refused by `loose_mounting`."""
    run = drawn(900, KINDS["noisy LSM9DS1"]).run
    (recording,) = observe_recordings([run])
    arguments = (np.eye(3), run.settings.site, np.zeros(3))
    last = average_transfers("gyro", [recording], *arguments)[-1].interval
    states = run.states[run.states["time_s"] < last.end_s - 3e-3]
    (recording,) = observe_recordings([replace(run, states=states)])
    cut = average_transfers("gyro", [recording], *arguments)[-1].interval
    assert cut.start_s == pytest.approx(last.start_s, abs=1e-4) and cut.end_s <= states["time_s"][-1] < last.end_s

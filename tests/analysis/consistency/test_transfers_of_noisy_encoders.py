"""Transfers are found on an arm whose encoders have the noise of real ones: standing joints seem to turn a little."""

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

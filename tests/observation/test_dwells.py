"""What is stated of an accelerometer's mean in a dwell, while something shakes the arm that stands."""

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.statistics.mean import Mean
from rig.observation.statistics.vibration_noise import average_standstill
from rig.observation.windows import Window

pytestmark = pytest.mark.slow

NOISE_M_S2, SHAKEN_M_S2, LASTING_S = 0.004, 0.02, 3.0


def dwelt(seed: int) -> tuple[Mean, Array]:
    """What 300 readings of a dwell tell of their mean, and what is true of it."""
    rng, time_s = np.random.default_rng(seed), LASTING_S / 300 * np.arange(300, dtype=np.float64)
    true = rng.normal(size=3)
    shaken = np.sin(2 * np.pi * rng.uniform(10, 18) * time_s[:, None] + rng.uniform(0, 6, 3))
    readings = true + NOISE_M_S2 * rng.normal(size=(300, 3)) + SHAKEN_M_S2 * shaken
    return average_standstill(readings, time_s, Window(0.0, LASTING_S), Steps(1e-5))[0], true


def test_a_shaken_dwell_s_noise_is_that_of_all_its_readings() -> None:
    """Were it that of few low frequencies, one dwell would weigh three times as much as another like it."""
    found = [dwelt(seed) for seed in range(60)]
    stds = np.sqrt([mean.variance for mean, _ in found])
    over_u = np.array([mean.mean - true for mean, true in found]) / stds
    assert np.std(np.log(stds)) < 0.06
    assert 0.85 < np.sqrt(np.mean(over_u**2)) < 1.2
    assert np.median(stds) == pytest.approx(NOISE_M_S2 / np.sqrt(300), rel=0.1)

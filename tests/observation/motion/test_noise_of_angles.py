"""The noise of the angles that an arm reports, in the mean rates that are computed from them."""

import numpy as np
import pytest

from rig.observation.motion.arm_motion import ArmMotion
from support.recordings.synthetic_run import Setup, synthetic_run

NOISE_RAD = 1e-4


@pytest.mark.one_in(2)  # rates on both sides of that of the states
@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 238.0, 952.0])
def test_the_noise_of_the_arms_angles_in_a_weighted_mean_rate_is_predicted(rate_hz: float) -> None:
    """With weights as they are without a slow line, for sensors slower and faster than the arm's states."""
    states = synthetic_run(Setup(noise_rad_s=0.0, encoder_noise_rad=0.0, state_rate_hz=250.0)).states[500:2500]
    span_s = float(np.ptp(states["time_s"])) - 0.2
    time_s = states["time_s"][0] + 0.1 + np.arange(round(span_s * rate_hz)) / rate_hz
    weights = 1 + 2 * np.cos(2 * np.pi * 5.3 * np.arange(len(time_s)) / len(time_s))
    weights /= weights.sum()
    rng = np.random.default_rng(5)
    means = []
    for _ in range(60):
        noisy = states.copy()
        noisy["q_rad"] += NOISE_RAD * rng.standard_normal((len(states), 1)) * (np.arange(6) == 5)
        means.append(weights @ ArmMotion(noisy).rates_at_samples(time_s)[:, 2])
    predicted = ArmMotion(states).state_gain(time_s, weights) * NOISE_RAD * np.sqrt(2) / span_s
    assert np.std(means) / predicted == pytest.approx(1, abs=0.3)


def test_an_arm_at_rest_does_not_turn_at_any_sample() -> None:
    """The noise of its angles is no motion: between two sweeps there may be nothing but noise."""
    states = synthetic_run(Setup()).states
    resting = states[states["time_s"] - states["time_s"][0] < 0.9]
    assert np.ptp(resting["q_rad"], axis=0).max() > 0
    motion = ArmMotion(states)
    rates = motion.rates_at_samples(resting["time_s"][0] + 0.1 + np.arange(50) / 100)
    assert rates.shape == (50, 3) and not rates.any()

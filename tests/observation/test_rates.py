"""The arm's rates are those of what its joints did, not of when their encoders were looked at."""

import numpy as np
import pytest

from rig.arm.kinematics import NOMINAL, flange_rate
from rig.data.run_file import ARM_STATE_DTYPE
from rig.observation.timebase import ArmMotion

SPEED_RAD_S = 1.0
RIPPLE_RAD_S = 0.05
JITTER_S = 1e-4


@pytest.mark.parametrize(("ripple_hz", "steps_s"), [(8.0, 0.002), (16.0, 0.002), (8.0, 0.008)])
def test_a_ripple_passes_and_the_times_states_scatter_by_do_not(ripple_hz: float, steps_s: float) -> None:
    """Of wrist 3, which turns; seen at 500 and at 125 states a second."""
    rng = np.random.default_rng(1)
    time_s = np.arange(0.0, 8.0, steps_s)
    phase = 2 * np.pi * ripple_hz

    def angle(at_s: np.ndarray) -> np.ndarray:
        return SPEED_RAD_S * at_s - RIPPLE_RAD_S / phase * np.cos(phase * at_s)

    states = np.zeros(len(time_s), dtype=ARM_STATE_DTYPE)
    states["time_s"] = time_s
    states["q_rad"][:, 5] = angle(time_s + JITTER_S * rng.standard_normal(len(time_s)))
    seen_s = np.arange(0.5, 7.5, 1 / 238)
    turned = np.zeros((len(seen_s), 6))
    speed = turned.copy()
    speed[:, 5] = SPEED_RAD_S + RIPPLE_RAD_S * np.sin(phase * seen_s)
    true = flange_rate(turned, speed, NOMINAL)
    now, before = (
        float(np.std(np.linalg.norm(ArmMotion(states, as_before=as_before).rate(seen_s), axis=1) - np.abs(true).max(1)))
        for as_before in (False, True)
    )
    limit = 4e-3 if steps_s < 0.005 else 1.2e-2
    assert now < limit and now < 0.6 * before

"""The clock of a recording of hours: found in its beginning, and followed from there to its end."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.observation.clocks.clock_estimate import estimate_time_base

pytestmark = pytest.mark.slow

HOURS_S = 3 * 3600.0
TURN_S, EVERY_S = 4.0, 300.0  # how long a turn lasts, and how often there is one


@dataclass(frozen=True)
class Turns:
    """A body that turns now and then, about another axis each time, first at `first_s`."""

    first_s: float
    time_s: Array = field(default_factory=lambda: np.array([0.0, HOURS_S]))

    def rate(self, time_s: Array, derivative: int = 0) -> Array:
        middles_s = np.arange(self.first_s, HOURS_S, EVERY_S)
        axes = np.random.default_rng(3).standard_normal((len(middles_s), 3))
        near = np.clip(np.round((time_s - self.first_s) / EVERY_S).astype(int), 0, len(middles_s) - 1)
        since = (time_s - middles_s[near]) / TURN_S
        size = np.exp(-(since**2))
        if derivative:
            size = -2 * since * size / TURN_S
        turned: Array = size[:, None] * axes[near]
        return turned

    def covered(self, time_s: Array) -> NDArray[np.bool_]:
        inside: NDArray[np.bool_] = (time_s >= 0) & (time_s <= HOURS_S)
        return inside


@pytest.mark.thorough
@pytest.mark.parametrize("first_s", [100.0, 2500.0], ids=["from the beginning", "after forty minutes at rest"])
def test_a_clock_of_hours_may_be_off_as_far_as_one_of_minutes(first_s: float) -> None:
    motion, drift, offset_s = Turns(first_s), 2e-3, 1.7
    board_s = np.arange(30.0, HOURS_S - 60.0, 0.5)
    true_s = offset_s + (1 + drift) * board_s
    noise = 0.01 * np.random.default_rng(1).standard_normal((len(board_s), 3))
    clock = estimate_time_base(board_s, motion.rate(true_s) @ np.diag([1.1, 0.9, 1.0]) + 0.05 + noise, motion)
    error_s = clock.controller_time_s(board_s) - true_s
    assert np.abs(error_s).max() < 4 * (clock.offset_std_s + clock.drift_std * HOURS_S / 2) < 0.02

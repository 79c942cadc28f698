"""Numbers in a log that are no readings: a frozen axis, the end of a range, of sound and of coarse sensors."""

import numpy as np
import pytest

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.false_readings import check_frozen, check_unclipped
from rig.observation.windows import Window

TIME_S = np.arange(6000) / 100
TURNS = 1.5 * np.array([np.clip(np.sin(0.2 * np.pi * TIME_S + phase), -0.8, 0.8) for phase in (0.0, 2.1, 4.2)]).T
SWEEPS = [Window(1.5, 3.5), Window(11.5, 13.5)]  # x turns evenly, at 1.2 rad/s


def readings(step: float = 0.0, noise: float = 1e-3) -> Array:
    values = TURNS + noise * np.random.default_rng(1).normal(size=TURNS.shape)
    return values if not step else step * np.rint(values / step)


@pytest.mark.parametrize("step", [0.0, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.02])
def test_a_healthy_sensor_is_neither_frozen_nor_clipped_however_coarse(step: float) -> None:
    check_frozen(TIME_S, readings(step))
    check_unclipped(TIME_S, readings(step), SWEEPS)


def test_an_axis_that_freezes_is_named_with_its_time() -> None:
    frozen = readings()
    frozen[3000:, 1] = frozen[3000, 1]
    with pytest.raises(Fault, match=r"stuck_sensor: from 30 to 59.99 s the gyroscope reads .* rad/s on y always"):
        check_frozen(TIME_S, frozen)


@pytest.mark.parametrize("limit_rad_s", [1.19, 1.2])
def test_a_sweep_at_the_end_of_the_range_is_named_with_its_row_and_axis(limit_rad_s: float) -> None:
    clipped = np.minimum(readings(), limit_rad_s)
    with pytest.raises(Fault, match=r"saturation: in row 1, from 1.5 to 3.5 s, \d+ readings .* on x, the end"):
        check_unclipped(TIME_S, clipped, SWEEPS)

"""Numbers in a log that are no readings: a frozen axis, the end of a range, of sound and of coarse sensors."""

import numpy as np
import pytest

from rig.data.quantity import ACCELERATION, RATE
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.observation.false_readings import check_frozen, check_unclipped, check_unwrapped
from rig.observation.windows import Window

TIME_S = np.arange(6000) / 100
ROWS = np.arange(6000)
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
    with pytest.raises(Fault, match=r"stuck_sensor: from 30 to 59.99 s the gyroscope always reads .* rad/s on y"):
        check_frozen(TIME_S, frozen)


@pytest.mark.parametrize("limit_rad_s", [1.19, 1.2])
def test_a_sweep_at_the_end_of_the_range_is_named_with_its_row_and_axis(limit_rad_s: float) -> None:
    clipped = np.minimum(readings(), limit_rad_s)
    with pytest.raises(Fault, match=r"saturation: in row 1, from 1.5 to 3.5 s, \d+ readings .* on x, the end"):
        check_unclipped(TIME_S, clipped, SWEEPS)


def overflowing(values: Array, span: float) -> Array:
    return np.asarray((values + span / 2) % span - span / 2)


@pytest.mark.parametrize("step", [0.0, 2.5 / 2**16])
def test_a_rate_beyond_the_numbers_of_its_file_overflows_by_name(step: float) -> None:
    values = 1.5 * np.sin(0.2 * np.pi * TIME_S)[:, None] * [0.3, 1.0, -0.5] + 1e-3 * noise_of(1.0)
    values = values if not step else step * np.rint(values / step)
    check_unwrapped(TIME_S, values, ROWS, RATE, "log.csv")
    what = r"readings_overflow: log.csv: y_rad_s jumps from 1\.2\d+ to -1\.2\d+ rad/s .* before sample \d+, at \d"
    with pytest.raises(Refused, match=what):
        check_unwrapped(TIME_S, overflowing(values, 2.5), ROWS, RATE, "log.csv")


def test_a_steady_rate_at_the_end_of_the_numbers_overflows_by_noise() -> None:
    values = np.where(TIME_S < 30, -1.0, 1.25)[:, None] + noise_of(1e-3)
    with pytest.raises(Refused, match="readings_overflow"):
        check_unwrapped(TIME_S, overflowing(values, 2.5), ROWS, RATE, "log.csv")


@pytest.mark.parametrize("other_way_s", [10.0, 25.0])
def test_a_table_that_turns_back_at_once_does_not_overflow(other_way_s: float) -> None:
    values = np.where(TIME_S % (2 * other_way_s) < other_way_s, 1.5, -1.5)[:, None] + noise_of(1e-3)
    check_unwrapped(TIME_S, values, ROWS, RATE, "log.csv")


def test_faces_that_follow_each_other_at_once_do_not_overflow() -> None:
    values = np.where(TIME_S < 30, 9.81, -9.81)[:, None] + noise_of(0.01)
    check_unwrapped(TIME_S, values, ROWS, ACCELERATION, "log.csv")


def noise_of(std: float) -> Array:
    return std * np.random.default_rng(2).normal(size=(len(TIME_S), 3))

"""Single readings that stand alone: found in motion and at rest, while knocks, steps and vibrations stay."""

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.observation.statistics.spikes import bridge_spikes, find_markers, find_spikes

TIME_S = np.arange(4000) / 100
AT = np.array([50, 700, 1503, 2222, 3900])


def turning(noise_rad_s: float = 2e-3) -> Array:
    """Rest for 10 s, then swing about all axes."""
    swings = np.where(TIME_S < 10, 0, np.sin(2 * np.pi * 0.4 * (TIME_S - 10)))[:, None] * [2.0, -1.0, 0.5]
    return np.asarray(swings + noise_rad_s * np.random.default_rng(1).normal(size=swings.shape))


@pytest.mark.parametrize("size_rad_s", [-0.5, 3.0, 35.0])
def test_spikes_are_found_at_rest_and_in_motion(size_rad_s: float) -> None:
    rates = turning()
    rates[AT, [0, 1, 2, 0, 1]] += size_rad_s
    assert find_spikes(TIME_S, rates).tolist() == AT.tolist()


def test_spikes_close_together_are_found() -> None:
    rates = turning()
    rates[[1000, 1004, 1012], 1] += [5.0, -7.0, 3.0]
    assert find_spikes(TIME_S, rates).tolist() == [1000, 1004, 1012]


def test_a_bridged_reading_is_that_of_its_neighbours() -> None:
    rates, true = turning(), turning()
    rates[AT, 0] += 10
    bridged = bridge_spikes(TIME_S, rates, AT)
    assert np.abs(bridged - true).max() < 0.02 and np.array_equal(np.delete(bridged, AT, 0), np.delete(true, AT, 0))


@pytest.mark.parametrize("noise_rad_s", [2e-3, 0.05, 0.5])
def test_noise_and_motion_have_no_spikes(noise_rad_s: float) -> None:
    assert not len(find_spikes(TIME_S, turning(noise_rad_s)))


@pytest.mark.parametrize("step_rad_s", [1e-9, 5e-4, 2e-3])
def test_a_number_that_comes_again_and_again_is_a_marker(step_rad_s: float) -> None:
    rates = step_rad_s * np.rint((turning() + 0.03) / step_rad_s)
    assert not len(find_markers(rates)), "coarse or not"
    rates[10::40, 1] = 0.0
    others = np.setdiff1d(find_markers(rates), np.arange(10, len(rates), 40))
    assert len(find_markers(rates)) == 100 + len(others) and len(others) < 3, "a few readings are really 0"


@pytest.mark.parametrize("step_rad_s", [0.01, 0.1])
def test_coarse_readings_and_a_stuck_or_saturated_axis_have_no_markers(step_rad_s: float) -> None:
    rates = np.clip(step_rad_s * np.rint(turning() / step_rad_s), -1.5, 1.5)
    rates[2000:2300, 2] = 0.0
    assert not len(find_markers(rates)) and not len(find_markers(rates[:0]))
    rates[rates == 0] += 1e-19 * np.random.default_rng(1).normal(size=np.count_nonzero(rates == 0))
    assert not len(find_markers(rates)), "where numbers that are equal differ by rounding"


def test_a_vibration_and_a_knock_that_rings_stay() -> None:
    rates = turning()
    rates[2000:] += (1.5 * np.sin(2 * np.pi * 43 * TIME_S[2000:]))[:, None]
    ringing = np.exp(-np.arange(20) / 4) * np.cos(np.pi * np.arange(20) / 1.7)
    rates[500:520, 0] += 3 * ringing
    assert not len(find_spikes(TIME_S, rates))


def test_a_step_is_no_spike() -> None:
    rates = turning()
    rates[600:] += [0.0, 1.0, 0.0]
    assert not len(find_spikes(TIME_S, rates))


def test_a_body_that_is_stopped_at_once_moves_about_its_other_axes() -> None:
    rates = turning()
    rates[700:800, 2] -= 5.0
    rates[800:803, 0] += [0.6, -0.1, 0.0]
    assert not len(find_spikes(TIME_S, rates))


def test_slow_readings_may_change_at_once() -> None:
    rates = turning()
    rates[AT, 0] += 10
    assert not len(find_spikes(10 * TIME_S, rates))

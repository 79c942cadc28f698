"""The bias by repeat with F held, and the repeat at which it moved. Truth is hidden from what finds it."""

import numpy as np
import pytest

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.temperature.bias_by_repeat import FALSE_ALARM_PROBABILITY, BiasByRepeat, bias_by_repeat
from rig.estimation.temperature.bias_over_temperature import bias_over_temperature

REPEATS, ATTITUDES, STD = 10, 10, 1.0
NOISE = STD * np.sqrt(ATTITUDES)  # of a mean in one attitude, so that a repeat's bias is known to STD


def found(bias: Array, seed: int, arm: float = 0.0) -> BiasByRepeat:
    """From readings of biases (R, 3); `arm` is the size of errors that every attitude makes again and again."""
    rng = np.random.default_rng(seed)
    modelled = 50 * rng.normal(size=(1, ATTITUDES, 3)) + np.zeros((len(bias), 1, 1))
    again = arm * rng.normal(size=(1, ATTITUDES, 3))
    readings = modelled + again + bias[:, None] + NOISE * rng.normal(size=modelled.shape)
    return bias_by_repeat(readings, np.full(modelled.shape, NOISE**2), modelled)


def jumped(repeat: int, axis: int, size: float) -> Array:
    bias = np.zeros((REPEATS, 3))
    bias[repeat:, axis] = size
    return bias


@pytest.mark.slow
def test_every_bias_is_found_within_its_uncertainty() -> None:
    truth = np.random.default_rng(1).normal(size=(REPEATS, 3)) * 20
    errors = np.array([found(truth, seed).bias - truth for seed in range(40)])
    stated = np.mean([found(truth, seed).std for seed in range(10)])
    assert np.sqrt(np.mean(errors**2)) / STD < 1.05
    assert 0.9 < np.sqrt(np.mean(errors**2)) / stated < 1.05


@pytest.mark.slow
def test_a_jump_is_named_at_its_repeat() -> None:
    """Of five standard deviations of one repeat, on one axis: in 95 % and more, wherever it is."""
    named = [
        [move.repeat for move in found(jumped(1 + seed % 9, seed % 3, 5 * STD), seed).moves] == [1 + seed % 9]
        for seed in range(450)
    ]
    assert np.mean(named) >= 0.95


@pytest.mark.slow
def test_a_steady_bias_is_hardly_ever_said_to_have_moved() -> None:
    moved = [bool(found(np.zeros((REPEATS, 3)), 1000 + seed).moves) for seed in range(450)]
    assert np.mean(moved) <= FALSE_ALARM_PROBABILITY


def test_what_the_arm_is_wrong_by_in_every_repeat_moves_nothing() -> None:
    """Ten times the noise; and the jump is seen through it."""
    assert not found(np.zeros((REPEATS, 3)), 5, arm=10 * NOISE).moves
    (move,) = found(jumped(4, 2, 12 * STD), 6, arm=10 * NOISE).moves
    assert (move.repeat, move.axis) == (4, 2) and move.change[2] == pytest.approx(12 * STD, abs=3.5 * move.std[2])


def test_an_arm_that_comes_back_differently_widens_what_is_stated() -> None:
    """Three times the noise: nothing else tells of it than the scatter in each attitude."""
    rng = np.random.default_rng(7)
    readings = 3 * NOISE * rng.normal(size=(REPEATS, ATTITUDES, 3))
    seen = bias_by_repeat(readings, np.full(readings.shape, NOISE**2), np.zeros(readings.shape))
    assert np.all((seen.excess > 2.3) & (seen.excess < 3.7)) and not seen.moves


def test_two_jumps_are_both_named() -> None:
    bias = jumped(3, 0, 10 * STD) + jumped(7, 1, -10 * STD)
    assert [(move.repeat, move.axis) for move in found(bias, 8).moves] == [(3, 0), (7, 1)]


def warmed(temperature_c: Array, slope: float, rate: float) -> tuple[Array, Array, Array, Array]:
    """Bias, its σ, temperature and time of so many hours."""
    time_s = 3600.0 * np.arange(len(temperature_c))
    bias = slope * (temperature_c - 25) + rate * time_s / 3600 + 0.1 * np.random.default_rng(9).normal(size=(3, 1))
    noise = 0.05 * np.random.default_rng(10).normal(size=(len(temperature_c), 3))
    std = np.full((len(temperature_c), 3), 0.05)
    return np.asarray(bias.T + noise, dtype=np.float64), std, temperature_c, np.asarray(time_s, dtype=np.float64)


def test_a_slope_over_temperature_is_told_apart_from_ageing() -> None:
    warming = 25 + 6 * (1 - np.exp(-np.arange(6) / 2))
    told = bias_over_temperature(*warmed(np.concatenate([warming, warming]), 0.4, 0.1))
    assert np.all(np.abs(told.slope - 0.4) < 4 * told.std) and told.range_c == pytest.approx((25, warming[-1]))


@pytest.mark.parametrize(
    ("temperature_c", "name"),
    [
        (25 + 2.9 * (-1.0) ** np.arange(8) / 2, "temperature_range_too_small"),
        (25 + 0.8 * np.arange(8), "temperature_and_time_confounded"),
        (np.array([25.0, 30.0, 26.0]), "too_few_observations"),
    ],
)
def test_what_temperature_cannot_tell_is_refused(temperature_c: Array, name: str) -> None:
    with pytest.raises(Fault) as refused:
        bias_over_temperature(*warmed(temperature_c, 0.4, 0.1))
    assert refused.value.name == name

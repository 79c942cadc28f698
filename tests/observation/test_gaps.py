"""What a gap hides: told by the readings next to it, against the rotation that was there."""

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.observation.time_stamps.gaps import find_hiding_gaps, hidden_angles_rad

RATE_HZ, NOISE_RAD_S = 100, 5e-4
TIME_S = np.arange(6000) / RATE_HZ


def hidden_and_true(rates: Array, lasts_s: float, at_s: float) -> tuple[float, float]:
    """What a gap is said to hide (1 σ), and the error of bridging it, rad."""
    read = rates[:, None] * [1.0, 0, 0] + NOISE_RAD_S * np.random.default_rng(1).normal(size=(len(rates), 3))
    kept = (at_s > TIME_S) | (at_s + lasts_s < TIME_S)
    time_s, read = TIME_S[kept], read[kept]
    gaps = np.flatnonzero(np.diff(time_s) > 1.5 / RATE_HZ)
    (hidden,) = hidden_angles_rad(time_s, read, gaps)
    begin, end = time_s[gaps[0]], time_s[gaps[0] + 1]
    there = (begin - 1e-9 <= TIME_S) & (end + 1e-9 >= TIME_S)
    bridged = (end - begin) * (read[gaps[0]] + read[gaps[0] + 1]) / 2
    return float(hidden), float(np.linalg.norm(np.trapezoid(rates[there], TIME_S[there]) - bridged[0]))


@pytest.mark.parametrize("rate_rad_s", [0.0, 7.0])
def test_of_an_even_motion_a_gap_hides_nothing_but_noise(rate_rad_s: float) -> None:
    hidden, true = hidden_and_true(np.full(len(TIME_S), rate_rad_s), 0.17, 30.0)
    assert true < 3 * hidden and hidden < 3e-4


@pytest.mark.parametrize("at_s", np.linspace(29, 31, 9))
@pytest.mark.parametrize("lasts_s", [0.05, 0.17])
def test_of_a_swinging_body_it_hides_what_bridging_errs_by(lasts_s: float, at_s: float) -> None:
    hidden, true = hidden_and_true(3 * np.sin(2 * np.pi * TIME_S), lasts_s, float(at_s))
    assert true < 2.5 * hidden, "a gap of the same length hides more where the body turns less evenly"
    assert hidden > 1e-3


@pytest.mark.parametrize("lasts_s", [0.05, 0.17])
def test_a_gap_about_the_fastest_moment_of_a_swing_hides_as_much_though_the_rates_next_to_it_agree(
    lasts_s: float,
) -> None:
    hidden, true = hidden_and_true(3 * np.sin(2 * np.pi * TIME_S), lasts_s, 29.25 - lasts_s / 2)
    assert 1e-3 < true < 2.5 * hidden


def test_a_long_gap_hides_all_and_a_short_one_in_a_swing_is_not_bridged() -> None:
    assert np.isinf(hidden_and_true(np.zeros(len(TIME_S)), 1.5, 30.0)[0])
    time_s = np.delete(TIME_S, np.s_[3000:3017])
    swing = np.delete(3 * np.sin(2 * np.pi * TIME_S)[:, None] * [0, 1, 0], np.s_[3000:3017], axis=0)
    assert find_hiding_gaps(time_s, swing, np.array([2999])).tolist() == [2999]
    assert find_hiding_gaps(time_s, 0 * swing, np.array([2999])).tolist() == []


@pytest.mark.parametrize("at_s", [29.9, 29.99, 30.0, 30.05])
def test_a_gap_that_holds_the_start_of_a_turn_hides_when_it_started(at_s: float) -> None:
    rates = np.clip(6 * (TIME_S - 30), 0, 1.6)
    hidden, true = hidden_and_true(rates, 0.3, at_s)
    assert hidden > 0.02 and true < 2.5 * hidden

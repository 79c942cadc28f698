"""Rests and moves by hand in coarse or damaged readings: what steps hide, and what is no end of a range."""

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.observation.by_hand.hand_segmentation import segment_session

STEP = float(np.radians(1))
BIAS = np.radians([0.4, -0.3, 0.2])


def read() -> tuple[Array, Array]:
    """Times and rates of three rests and two moves by a hand, with noise of a tenth of a degree a second."""
    time_s = np.arange(1600) / 200
    push = np.interp(time_s, [1.5, 2.1, 2.7, 4.5, 5.3, 6.1], [0.0, 2.3, 0.0, 0.0, -1.9, 0.0])
    smooth = np.sin(np.pi / 2 * push / 2.5)
    rates = smooth[:, None] * [1.0, 0.4, -0.3]
    return time_s, rates + BIAS + np.radians(0.1) * np.random.default_rng(1).normal(size=rates.shape)


def test_fine_readings_hide_nothing() -> None:
    session = segment_session(*read())
    assert len(session.rests) == 3
    assert all(not np.any(rest.rounding_rad_s) for rest in session.rests)


@pytest.mark.parametrize("how", ["rounded", "cut"])
def test_whole_degrees_hide_a_part_of_the_bias_and_end_at_no_range(how: str) -> None:
    time_s, rates = read()
    coarse = STEP * (np.round(rates / STEP) if how == "rounded" else np.trunc(rates / STEP))
    session = segment_session(time_s, coarse)
    assert len(session.rests) == 3 and not any(move.clipped for move in session.moves)
    for rest in session.rests:
        assert (np.abs(rest.mean_rad_s - BIAS) < 2 * np.asarray(rest.rounding_rad_s)).all()


def test_a_damaged_line_in_a_move_and_one_at_rest_are_interpolated() -> None:
    time_s, rates = read()
    damaged = rates.copy()
    damaged[100], damaged[400, 1], damaged[900, 2] = 3.0, 200.0, -0.9
    session = segment_session(time_s, damaged)
    assert session.spikes_s == tuple(time_s[[100, 400, 900]])
    assert len(session.rests) == 3 and max(move.peak_rad_s for move in session.moves) < 1.1
    np.testing.assert_allclose(session.rates, rates, atol=0.02)


def test_a_damaged_acceleration_is_not_in_the_mean_of_its_rest() -> None:
    time_s, rates = read()
    forces = np.tile([0.0, 0.1, 9.8], (len(time_s), 1)) + 0.02 * np.random.default_rng(2).normal(size=rates.shape)
    forces[120, 1] = 9800.0
    rest = segment_session(time_s, rates, forces).rests[0]
    assert rest.acceleration_m_s2 is not None and rest.acceleration_noise_m_s2 is not None
    np.testing.assert_allclose(rest.acceleration_m_s2, [0.0, 0.1, 9.8], atol=0.01)
    assert rest.acceleration_noise_m_s2.max() < 0.03


def test_zeros_in_place_of_small_rates_hide_what_is_smaller_than_the_other_readings() -> None:
    time_s, rates = read()
    limit = np.radians(2)
    session = segment_session(time_s, np.where(np.abs(rates) < limit, 0.0, rates))
    for rest in session.rests:
        np.testing.assert_allclose(rest.rounding_rad_s, limit / np.sqrt(3), rtol=0.2)


@pytest.mark.parametrize("range_rad_s", [None, 4.0])
def test_a_range_that_ends_is_seen_in_coarse_readings_too_and_where_a_wider_one_is_stated(
    range_rad_s: float | None,
) -> None:
    time_s, rates = read()
    clipped = STEP * np.round(np.clip(rates, -0.6, 0.6) / STEP)
    session = segment_session(time_s, clipped, range_rad_s=range_rad_s)
    assert session.moves[0].clipped and session.moves[1].clipped

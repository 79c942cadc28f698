"""Rests, found in what a gyroscope or an accelerometer read."""

from pathlib import Path

import numpy as np
import pytest

from rig.data.quantity import ACCELERATION, RATE
from rig.observation.by_hand.rests import find_rests
from rig.observation.external.csv_samples import read_samples
from rig.observation.windows import Window
from support.external.real import unpack
from support.external.turned_body import Hand, turn
from support.paths import DOCS


@pytest.mark.slow
def test_a_hands_rests_are_found_as_they_are_known_of_a_real_recording(tmp_path: Path) -> None:
    """Thirteen, say those who looked at it."""
    samples = read_samples(unpack("imucal", "samples.csv", tmp_path))
    rests = find_rests(samples.time_s, samples.readings)
    assert len(rests) == 13
    assert (rests[1].start_s, rests[1].end_s) == pytest.approx((3.8, 13.4), abs=0.3)


@pytest.mark.parametrize("noise_rad_s", [0.0, 1e-3, 0.035])
def test_between_two_turns_there_is_one_rest(noise_rad_s: float) -> None:
    session = turn(Hand(np.vstack([np.eye(3), -np.eye(3)]), noise_rad_s=noise_rad_s), 1)
    rests = find_rests(session.time_s, {RATE: session.readings})
    turns = session.rows[session.rows[:, 5] > 0]
    assert len(rests) == len(turns) + 1
    for rest, begins_s in zip(rests, turns[:, 0], strict=False):
        assert rest.end_s <= begins_s + 0.1  # a push begins gently
    for rest, ended_s in zip(rests[1:], turns[:, 1], strict=True):
        assert rest.start_s >= ended_s - 0.25


def test_a_steady_turn_is_no_rest() -> None:
    """A turntable's sweeps are as quiet as its stops."""
    samples = read_samples(DOCS / "examples" / "samples.csv")
    rests = find_rests(samples.time_s, samples.readings)
    assert len(rests) == 7 and sum(rest.end_s - rest.start_s for rest in rests) < 30


def test_a_gap_ends_a_rest() -> None:
    time_s = np.arange(1000) / 100
    readings = np.random.default_rng(1).normal(size=(1000, 3)) * 1e-3
    time_s[500:] += 3.0
    before, after = find_rests(time_s, {RATE: readings})
    assert before.end_s <= 5 and after.start_s >= 8


def test_a_knock_ends_no_rest_of_an_accelerometer_in_any_attitude() -> None:
    time_s = np.arange(1500) / 100
    readings = 9.81 * np.repeat(np.eye(3), 500, axis=0) + 0.01 * np.random.default_rng(2).normal(size=(1500, 3))
    for knocked in (250, 750, 1250):
        readings[knocked : knocked + 2] += 3.0
    rests = find_rests(time_s, {ACCELERATION: readings})
    assert [round(rest.start_s) for rest in rests] == [0, 5, 10] and [round(rest.end_s) for rest in rests] == [
        5,
        10,
        15,
    ]


def test_a_short_turn_against_the_bias_is_no_rest_though_it_reads_zero() -> None:
    time_s = np.arange(1800) / 100
    readings = 1e-3 * np.random.default_rng(3).normal(size=(1800, 3))
    readings[:800, 2] += 0.05
    readings[1000:, 2] += 0.05
    rests = find_rests(time_s, {RATE: readings})
    assert [(round(rest.start_s), round(rest.end_s)) for rest in rests] == [(0, 8), (10, 18)]


def test_of_a_turn_that_lasts_longer_than_the_rests_a_declared_rest_is_told() -> None:
    time_s = np.arange(2800) / 100
    readings = 1e-3 * np.random.default_rng(4).normal(size=(2800, 3))
    readings[400:2400, 2] += 0.5
    rests = find_rests(time_s, {RATE: readings}, lying=[Window(0.5, 3.5)])
    assert [(round(rest.start_s), round(rest.end_s)) for rest in rests] == [(0, 4), (24, 28)]


def test_noise_that_grows_far_below_what_counts_as_steady_ends_no_rest() -> None:
    time_s = np.arange(1000) / 100
    noise_rad_s = np.where(time_s < 2, 1e-6, 1e-5)[:, None]
    (rest,) = find_rests(time_s, {RATE: noise_rad_s * np.random.default_rng(5).normal(size=(1000, 3))})
    assert (round(rest.start_s), round(rest.end_s)) == (0, 10)

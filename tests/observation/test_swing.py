"""A standing arm that swings, and one that is moved: angles of joints and readings at rest tell them apart."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.observation.oscillation import MAX_TRAVEL_AT_REST_RAD, remove_oscillation
from support.recordings.synthetic_run import Setup, synthetic_run

TIME_S = 0.008 * np.arange(370)
MOVED_RAD = 3.5e-3


def left_rad(angle: Array) -> float:
    return float(np.ptp(remove_oscillation(np.column_stack([angle, 0.3 * angle])), axis=0).max())


@pytest.mark.parametrize("hertz", [0.3, 0.37, 0.81, 2.6])
@pytest.mark.parametrize("phase", [0.0, 1.0, 2.5])
def test_a_swing_about_where_it_stands_moves_no_joint(hertz: float, phase: float) -> None:
    assert left_rad(2.2e-3 * np.sin(2 * np.pi * hertz * TIME_S + phase)) < MAX_TRAVEL_AT_REST_RAD / 4


MOVES: dict[str, Callable[[Array], Any]] = {
    "a step": lambda share: np.where(share > 0.4, 1.0, 0.0),
    "a step at the end": lambda share: np.where(share > 0.9, 1.0, 0.0),
    "half a second's push": lambda share: np.interp(share, [0.3, 0.47], [0.0, 1.0]),
    "there and back": lambda share: np.where(np.abs(share - 0.5) < 0.1, 1.0, 0.0),
    "a creep": lambda share: share,
}


@pytest.mark.parametrize("name", MOVES)
def test_what_moves_a_joint_is_no_swing(name: str) -> None:
    assert left_rad(MOVED_RAD * MOVES[name](TIME_S / TIME_S[-1])) > MAX_TRAVEL_AT_REST_RAD


def rests_rad_s(run: RunData) -> Array:
    """(N, 3) the means of the rests."""
    return np.array([rest.mean_rad_s for rest in observe_recordings([run])[0].sensors["gyro"].rests])


@pytest.mark.slow
def test_the_mean_of_a_rest_is_that_of_an_arm_that_does_not_swing() -> None:
    """Half a hertz of 1 mrad/s would turn a rest of three seconds by as much as thirty times what noise does."""
    still = Setup(noise_rad_s=3e-4, vibration=0.0, state_rate_hz=500.0, sample_rate_hz=200.0)
    swings = replace(still, seen_vibration_rad_s=1e-3, seen_vibration_hz=0.5)
    quiet, swung = (rests_rad_s(synthetic_run(each)) for each in (still, swings))
    assert len(quiet) == len(swung) > 4
    assert np.abs(swung - quiet).max() < 2e-5

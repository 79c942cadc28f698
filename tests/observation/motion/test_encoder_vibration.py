"""A vibration that encoders see and no turn locks: as much is in the arm's speed as is left in the readings' mean."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.observation.observe import Observation
from support.recordings.synthetic_run import BIAS_RAD_S, SCALE, SENSITIVITY, Setup, synthetic_run

pytestmark = pytest.mark.slow

QUIET = Setup(
    noise_rad_s=4.5e-4, vibration=0.0, mounting_error_rad=(0.0, 0.0, 0.0), state_rate_hz=500.0, sample_rate_hz=200.0
)
HERTZ = 8.58


def revolutions(run: RunData) -> tuple[Observation, ...]:
    return observe_recordings([run])[0].sensors["gyro"].revolutions


def shaken(run: RunData, size_rad_s: float, seed: int) -> RunData:
    """With a vibration of that RMS, about all axes, which the encoders do not see."""
    samples, phases = run.samples["gyro"].copy(), np.random.default_rng(100 + seed).uniform(0, 6, 3)
    phase = 2 * np.pi * HERTZ * 1e-6 * samples["board_time_us"][:, None] + phases
    samples["counts"] += np.round(np.sqrt(2) * size_rad_s * np.sin(phase) / SENSITIVITY).astype(np.int32)
    return replace(run, samples={"gyro": samples})


def errors(seen: Observation) -> Array:
    """(3,) what scale and bias leave between a sweep's reading and the arm's rate, over what is stated of it."""
    found = seen.average.mean_rad_s + BIAS_RAD_S - seen.speed_rad_s * seen.axis_flange / SCALE
    return found / np.hypot(seen.average.mean_std_rad_s, seen.speed_std_rad_s)


@pytest.mark.thorough
@pytest.mark.parametrize(("seen_rad_s", "unseen_rad_s"), [(0.004, 0.0), (0.010, 0.0), (0.010, 0.004)])
def test_the_scale_is_as_well_known_as_stated_whatever_the_encoders_see_of_a_vibration(
    seen_rad_s: float, unseen_rad_s: float
) -> None:
    """Where the speed is 2π/T beside a mean without the lines, the scale is off by 4 of what is stated at 10 mrad/s."""
    found = []
    for seed in range(3):
        setup = replace(QUIET, seed=seed, seen_vibration_rad_s=seen_rad_s, seen_vibration_hz=HERTZ)
        found.extend(
            (errors(revolution), revolution)
            for revolution in revolutions(shaken(synthetic_run(setup), unseen_rad_s, seed))
        )
    along = [error["xyz".index(each.axis)] for error, each in found]
    assert all(len(each.average.lines_hz) for _, each in found)
    assert 0.5 < np.sqrt(np.mean(np.square(along))) < 1.35  # a line of 8 cycles is hard to tell from what is smooth
    assert 0.6 < np.sqrt(np.mean([error**2 for error, _ in found])) < 1.25


def test_of_an_arm_that_turns_evenly_the_speed_is_that_of_a_turn_whatever_was_taken_out() -> None:
    """2π/T, but for the steps of the encoders and for where samples meet its ends: a tenth of the best that is stated.

    The even steps of an angle are lines in the rate too.
    """
    for revolution in revolutions(synthetic_run(replace(QUIET, encoder_noise_rad=0.0))):
        assert revolution.speed_rad_s == pytest.approx(2 * np.pi / revolution.average.duration_s, rel=2e-6)


@pytest.mark.parametrize("sample_rate_hz", [25.0, 50.0])
def test_noise_of_the_encoders_between_samples_that_are_far_apart_is_in_no_speed(sample_rate_hz: float) -> None:
    """It makes no more than what is stated of a turn, where the rates at the samples' times would be off by 4e-4."""
    setup = replace(QUIET, vibration=0.05, sample_rate_hz=sample_rate_hz, state_rate_hz=125.0, encoder_step_rad=1e-4)
    for revolution in revolutions(synthetic_run(setup)):
        off = revolution.speed_rad_s * revolution.average.duration_s / (2 * np.pi) - 1
        assert abs(off) < 4 * max(revolution.speed_std_rad_s / revolution.speed_rad_s, 2e-5)

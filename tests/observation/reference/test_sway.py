"""What joints that sway in a sweep do to an accelerometer on the flange, by their encoders."""

from dataclasses import replace

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import flange_attitude, flange_pose
from rig.observation.motion.arm_motion import motion_of
from rig.observation.reference.sway import sway_acceleration
from rig.observation.windows import swept
from support.recordings.synthetic_run import Motion, Setup, synthetic_run

EXTENSION_M = np.array([0.0, 0.0, 0.08])
STEADY = Setup(vibration=0.0, state_rate_hz=500.0)
STEP_S = 1e-3


@pytest.mark.parametrize("hertz", [0.25, 0.4, 0.6])  # 1.5 to 3.6 periods a turn
def test_the_first_harmonic_is_free_of_the_acceleration_by_wrists_that_sway(hertz: float) -> None:
    setup = replace(STEADY, seen_vibration_rad_s=2.8e-3, seen_vibration_hz=hertz)
    truth, run = Motion(setup, np.random.default_rng(setup.seed)), synthetic_run(setup)
    motion = motion_of(run)
    for finished in swept(run):
        turn = motion.turn(finished.sweep, finished.window, run.settings.observation)
        time_s = np.arange(turn.start_s, turn.end_s, 0.01)
        found = sway_acceleration(motion, finished.sweep.joint, time_s, (turn.start_s, turn.end_s), EXTENSION_M)
        expected = _differentiate(truth, motion.kinematics, finished.sweep.joint, time_s)
        angle_rad = motion.angle(finished.sweep, time_s)
        waves = np.column_stack([np.ones(len(time_s)), np.cos(angle_rad), np.sin(angle_rad)])
        kept, removed = (np.linalg.lstsq(waves, values, rcond=None)[0] for values in (expected - found, expected))
        assert np.abs(removed).max() > 1e-4, "m/s², more than a good accelerometer's noise in a turn"
        assert np.abs(kept).max() < 0.1 * np.abs(removed).max() + 1e-5


def test_encoders_that_show_noise_only_change_nothing() -> None:
    run = synthetic_run(STEADY)
    motion, finished = motion_of(run), next(swept(run))
    turn = motion.turn(finished.sweep, finished.window, run.settings.observation)
    times_s = np.linspace(turn.start_s, turn.end_s, 50)
    found = sway_acceleration(motion, finished.sweep.joint, times_s, (turn.start_s, turn.end_s), EXTENSION_M)
    assert not found.any()


def _differentiate(truth: Motion, kinematics: DenavitHartenberg, joint: int, time_s: Array) -> Array:
    """Return the acceleration (n, 3), in the flange's frame, by differences of exact positions."""

    def deviation_m(times_s: Array) -> Array:
        q_rad = truth.joints(times_s)[0]
        steady_rad = np.tile(truth.joints(time_s)[0].mean(axis=0), (len(q_rad), 1))
        steady_rad[:, joint] = q_rad[:, joint]
        poses = [flange_pose(angles_rad, kinematics) for angles_rad in (q_rad, steady_rad)]
        swayed, steady = (pose[:, :3, 3] + pose[:, :3, :3] @ EXTENSION_M for pose in poses)
        return swayed - steady

    before, now, after = (deviation_m(time_s + shift * STEP_S) for shift in (-1, 0, 1))
    attitudes = flange_attitude(truth.joints(time_s)[0], kinematics)
    acceleration: Array = np.einsum("nij,nj->ni", attitudes, (after - 2 * now + before) / STEP_S**2)
    return acceleration

"""What joints that sway in a sweep do to an accelerometer on the flange, by their encoders."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.reference.accelerometer import stack_sweeps
from rig.data.quantity import ACCELERATION
from rig.data.recording.settings import Site
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import LEVER, NO_DWELLS, PARAMETERS, Movement, predicted
from rig.estimation.reference.reference_model import REFERENCE
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import flange_attitude, flange_pose
from rig.observation.average import Stream
from rig.observation.clocks.time_base import TimeBase
from rig.observation.motion.arm_motion import motion_of
from rig.observation.reference.sway import sway_acceleration
from rig.observation.reference.swept_acceleration import swept_acceleration
from rig.observation.windows import swept
from support.recordings.damaged_accelerations import load_recording
from support.recordings.synthetic_run import Motion, Setup, synthetic_run

EXTENSION_M = np.array([0.0, 0.0, 0.08])
STEADY = Setup(vibration=0.0, state_rate_hz=500.0)
STEP_S = 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("hertz", [0.25, 0.4, 0.6])  # 1.5 to 3.6 periods a turn
def test_the_first_harmonic_is_free_of_the_acceleration_by_wrists_that_sway(hertz: float) -> None:
    setup = replace(STEADY, seen_vibration_rad_s=2.8e-3, seen_vibration_hz=hertz)
    truth, run = Motion(setup, np.random.default_rng(setup.seed)), synthetic_run(setup)
    motion = motion_of(run)
    for finished in swept(run):
        turn = motion.turn(finished.sweep, finished.window, run.settings.observation)
        time_s = np.arange(turn.start_s, turn.end_s, 0.01)
        pose_rad, window_s = motion.angles(time_s).mean(axis=0), (turn.start_s, turn.end_s)
        found = sway_acceleration(
            motion, finished.sweep.joint, pose_rad, time_s, window_s=window_s, extension_m=EXTENSION_M
        )
        expected = _differentiate(truth, motion.kinematics, finished.sweep.joint, time_s)
        angle_rad = motion.angle(finished.sweep, time_s)
        waves = np.column_stack([np.ones(len(time_s)), np.cos(angle_rad), np.sin(angle_rad)])
        kept, removed = (np.linalg.lstsq(waves, values, rcond=None)[0] for values in (expected - found, expected))
        assert np.abs(removed).max() > 1e-4, "m/s², more than a good accelerometer's noise in a turn"
        assert np.abs(kept).max() < 0.1 * np.abs(removed).max() + 1e-5


@pytest.mark.slow
def test_an_acceleration_at_the_end_of_the_range_in_a_turn_is_refused() -> None:
    run, sensor = synthetic_run(Setup(speed_deg_s=120)), load_recording("imu").sensors["gyro"]
    motion, finished = motion_of(run), next(swept(run))
    time_s = np.arange(motion.time_s[0] + 0.1, motion.time_s[-1] - 0.1, 0.02)
    raw = np.zeros(len(time_s), dtype=[("acceleration_counts", "i4", 3)])
    turn = motion.turn(finished.sweep, finished.window, run.settings.observation)
    middle = np.searchsorted(time_s, (turn.start_s + turn.end_s) / 2)
    raw["acceleration_counts"][middle] = sensor.channel(ACCELERATION).full_scale_counts
    clock = TimeBase(0.0, 0.0, 0.0, np.zeros((2, 2)), np.zeros(3))
    stream = Stream(sensor, clock, time_s, time_s, np.zeros((len(time_s), 3)), raw)
    with pytest.raises(Fault, match=r"saturation: in .* 1 accelerations are at the end"):
        swept_acceleration(stream, motion, finished.sweep, turn, run.settings)


@pytest.mark.slow
def test_gravity_axis_and_lever_arm_of_a_turn_belong_to_the_pose_about_which_wrists_sway() -> None:
    """A sway by 2 mrad when a turn begins moves the flange by 0.5 mm: at 60°/s a mean wrong by 0.5 mm/s²."""
    setup = replace(STEADY, seen_vibration_rad_s=2.8e-3, seen_vibration_hz=0.24)
    truth, run = Motion(setup, np.random.default_rng(setup.seed)), synthetic_run(setup)
    motion, sensor = motion_of(run), load_recording("imu").sensors["gyro"]
    settings = replace(run.settings, extension_m=tuple(EXTENSION_M))
    time_s = np.arange(motion.time_s[0] + 0.1, motion.time_s[-1] - 0.1, 0.005)
    readings_m_s2 = _specific_force(truth, motion.kinematics, time_s, settings.site) @ np.array(sensor.mounting).T
    raw = np.zeros(len(time_s), dtype=[("acceleration_counts", "i4", 3)])
    step_m_s2 = sensor.channel(ACCELERATION).unit_per_count
    assert step_m_s2 is not None
    raw["acceleration_counts"] = np.round(readings_m_s2 / step_m_s2)
    stream = Stream(
        sensor, TimeBase(0.0, 0.0, 0.0, np.zeros((2, 2)), np.zeros(3)), time_s, time_s, np.zeros((len(time_s), 3)), raw
    )
    turns = [
        swept_acceleration(
            stream, motion, finished.sweep, motion.turn(finished.sweep, finished.window, settings.observation), settings
        )
        for finished in swept(run)
    ]
    movement = Movement(NO_DWELLS, stack_sweeps(turns, np.array(sensor.mounting)))
    ideal = np.zeros(PARAMETERS)
    ideal[:9], ideal[REFERENCE] = np.eye(3).ravel(), -np.array(settings.site.down_m_s2)
    ideal[LEVER] = np.array(sensor.mounting) @ EXTENSION_M
    off_m_s2 = movement.readings() - predicted(ideal, movement)
    assert np.abs(off_m_s2).max() < 2e-4


@pytest.mark.slow
def test_encoders_that_show_noise_only_change_nothing() -> None:
    run = synthetic_run(STEADY)
    motion, finished = motion_of(run), next(swept(run))
    turn = motion.turn(finished.sweep, finished.window, run.settings.observation)
    times_s = np.linspace(turn.start_s, turn.end_s, 50)
    pose_rad, window_s = motion.angles(times_s).mean(axis=0), (turn.start_s, turn.end_s)
    found = sway_acceleration(
        motion, finished.sweep.joint, pose_rad, times_s, window_s=window_s, extension_m=EXTENSION_M
    )
    assert not found.any()


def _specific_force(truth: Motion, kinematics: DenavitHartenberg, time_s: Array, site: Site) -> Array:
    """Return the specific force (n, 3) at the extension's end, in the flange's frame, by differences of positions."""
    before_m, now_m, after_m = (
        pose[:, :3, 3] + pose[:, :3, :3] @ EXTENSION_M
        for pose in (flange_pose(truth.joints(time_s + shift * STEP_S)[0], kinematics) for shift in (-1, 0, 1))
    )
    attitudes = flange_attitude(truth.joints(time_s)[0], kinematics)
    in_base = (after_m - 2 * now_m + before_m) / STEP_S**2 - site.down_m_s2
    force: Array = np.einsum("nij,nj->ni", attitudes, in_base)
    return force


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

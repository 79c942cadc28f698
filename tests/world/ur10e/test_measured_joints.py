"""The simulated arm's joints are those of real arms: read from its RTDE states as the public logs of real ones are.

docs/simulated-arm.md has the figures of the real ones beside these.
"""

import math

import numpy as np
import pytest

from support.motions.arm_states import LoggedArm
from support.motions.joint_figures import following_lag_s, rest_noise, settling, speed_ripple

pytestmark = pytest.mark.slow

SPEED_RAD_S = math.radians(60)
RAMP_RAD_S2 = 4.0
PLAIN = ["world.arm.state_jitter_s=0"]


def sweep(arm: LoggedArm, joint: int) -> dict[str, np.ndarray]:
    """One turn of a joint at 60 °/s, with its ramps and what comes after it."""
    q = list(arm.robot.motion.now.target_q_rad)
    start = q[joint]
    q[joint] = start + (6.8 if start <= 0 else -6.8)
    arm.log_move(f"movej([{','.join(map(repr, q))}], a={RAMP_RAD_S2}, v={SPEED_RAD_S})")
    return arm.take()


@pytest.fixture(scope="module")
def sweeps() -> list[dict[str, np.ndarray]]:
    """A sweep of each joint."""
    arm = LoggedArm([*PLAIN, "arm.home_deg=[-180, -180, -180, -180, -180, -180]"])
    return [sweep(arm, joint) for joint in range(6)]


def cruise(log: dict[str, np.ndarray], joint: int) -> np.ndarray:
    """Where the joint turns at its constant speed, from half a second after the ramp on."""
    moving = np.flatnonzero(np.isclose(np.abs(log["target_qd"][:, joint]), SPEED_RAD_S))
    return moving[50:]


def test_encoders_at_rest_show_white_noise_in_steps() -> None:
    arm = LoggedArm()
    arm.log(5000)
    log = arm.take()
    for joint in range(6):
        noise = rest_noise(log["actual_q"][:, joint])
        assert 15e-6 < noise.std_rad < 35e-6
        assert abs(noise.correlation) < 0.2
        assert noise.step_rad == pytest.approx(2 * math.pi / 2**20, rel=1e-3)
    assert not log["actual_qd"].any()


def test_a_cb3_shows_the_steps_of_its_encoders() -> None:
    arm = LoggedArm(["arm.model=ur10_cb3"])
    arm.log(500)
    assert rest_noise(arm.take()["actual_q"][:, 2]).step_rad == pytest.approx(11.98e-6, abs=1e-8)


@pytest.mark.parametrize("joint", range(6))
def test_the_rate_ripples_by_the_orders_of_the_harmonic_drive(sweeps: list[dict[str, np.ndarray]], joint: int) -> None:
    log, at = sweeps[joint], cruise(sweeps[joint], joint)
    columns = (log[name][at, joint] for name in ("actual_q", "actual_qd", "target_qd"))
    ripple = speed_ripple(*columns)
    assert 0.002 < ripple.fraction < 0.008
    assert all(95 <= order <= 105 or 195 <= order <= 210 for order in ripple.peaks(2))


def test_the_ripple_is_as_large_at_a_third_of_the_speed() -> None:
    arm = LoggedArm([*PLAIN, "world.arm.encoder_speed_noise_rad_s=0"])
    sizes = []
    for speed in (SPEED_RAD_S, SPEED_RAD_S / 3):
        q = list(arm.robot.motion.now.target_q_rad)
        q[5] += 1.0
        arm.log_move(f"movej([{','.join(map(repr, q))}], a={RAMP_RAD_S2}, v={speed})")
        log = arm.take()
        steady = np.isclose(log["target_qd"][:, 5], speed)
        sizes.append(float((log["actual_qd"] - log["target_qd"])[steady, 5][30:].std()))
    assert sizes[1] == pytest.approx(sizes[0], rel=0.15)


def test_a_joint_is_late_and_yields_to_acceleration(sweeps: list[dict[str, np.ndarray]]) -> None:
    for joint, log in enumerate(sweeps):
        columns = (log[name][:, joint] for name in ("actual_q", "target_q", "target_qd", "target_qdd"))
        assert following_lag_s(*columns) == pytest.approx(0.47e-3, abs=0.06e-3)


@pytest.mark.parametrize("joint", range(6))
def test_a_joint_settles_within_40_ms_of_the_end_of_its_move(sweeps: list[dict[str, np.ndarray]], joint: int) -> None:
    log = sweeps[joint]
    end = settling(log["timestamp"], log["target_qd"][:, joint], log["actual_qd"][:, joint], rest_rad_s=3e-3)
    assert 0.012 < end.duration_s < 0.040
    assert end.back_rad_s < -10e-3


def test_a_move_that_ends_with_one_radian_per_second_squared_comes_back_as_the_logged_ones() -> None:
    arm = LoggedArm([*PLAIN, "world.arm.encoder_speed_noise_rad_s=0"])
    q = list(arm.robot.motion.now.target_q_rad)
    q[0] += 1.0
    arm.log_move(f"movej([{','.join(map(repr, q))}], a=1.0, v=0.8)")
    log = arm.take()
    end = settling(log["timestamp"], log["target_qd"][:, 0], log["actual_qd"][:, 0], rest_rad_s=2e-3)
    assert -13e-3 < end.back_rad_s < -10e-3
    assert 0.018 < end.duration_s < 0.034


def test_while_wrist_1_turns_the_elbow_is_shaken_and_joints_with_other_axes_are_not(
    sweeps: list[dict[str, np.ndarray]],
) -> None:
    at = cruise(sweeps[3], 3)
    shaken = sweeps[3]["actual_qd"][at].std(axis=0)
    assert 0.1e-3 < shaken[2] < 0.3e-3
    assert not shaken[[0, 1, 4, 5]].any()


def test_the_flange_feels_what_the_joints_do_but_not_the_encoders_noise() -> None:
    """The true rates of a noisy arm are those of one whose encoders have no noise, and ripple as the joints do."""
    rates = []
    for overrides in ((), ("world.arm.encoder_noise_rad=0", "world.arm.encoder_speed_noise_rad_s=0")):
        arm = LoggedArm([*PLAIN, "world.arm.vibration_rms_rad_s=0", "world.site.latitude_deg=null", *overrides])
        q = list(arm.robot.motion.now.target_q_rad)
        q[5] += 3.0
        arm.run(f"movej([{','.join(map(repr, q))}], a={RAMP_RAD_S2}, v={SPEED_RAD_S})")
        felt = []
        for _ in range(1000):
            arm.source.step()
            felt.append(arm.source.motion_at(arm.source.time_s)[0][2])
        rates.append(np.array(felt[300:]))
    assert rates[0] == pytest.approx(rates[1], abs=1e-15)
    assert 0.0015 < (rates[0] - SPEED_RAD_S).std() / SPEED_RAD_S < 0.008


def test_rates_and_accelerations_are_the_derivatives_of_the_angles() -> None:
    """Through ramps, a change of the slider, a stop in mid-move and the settling after it."""
    arm = LoggedArm(["world.arm.vibration_rms_rad_s=0"])
    motion = arm.robot.motion
    motion.move((*motion.now.target_q_rad[:3], -0.5, -0.2, 2.0), 1.0, 3.0)
    step_s, largest = 1e-6, [0.0, 0.0]
    for tick in range(1200):
        if tick == 200:
            motion.fraction_wanted = 0.6
        if tick == 500:
            motion.stop(8.0)
        arm.source.step()
        middle_s = arm.robot.time_s - 0.001
        if abs((middle_s - motion._drive.lag_s) % 0.002 - 0.0) < 1e-5:
            continue
        before, here, after = (motion.state_at(middle_s + shift) for shift in (-step_s, 0.0, step_s))
        for order in range(2):
            slope = np.subtract(after[order], before[order]) / (2 * step_s)
            error = float(np.abs(slope - here[order + 1]).max())
            largest[order] = max(largest[order], error)
    assert largest[0] < 1e-6
    assert largest[1] < 5e-2


def test_rough_joints_are_what_they_were() -> None:
    arm = LoggedArm([*PLAIN, "world.arm.joints=rough"])
    q = list(arm.robot.motion.now.target_q_rad)
    q[5] += 6.0
    arm.log(100)
    assert not np.ptp(arm.take()["actual_q"], axis=0).any()
    arm.log_move(f"movej([{','.join(map(repr, q))}], a={RAMP_RAD_S2}, v={SPEED_RAD_S})")
    log = arm.take()
    at = cruise(log, 5)
    ripple = speed_ripple(*(log[name][at, 5] for name in ("actual_q", "actual_qd", "target_qd")))
    assert 0.04 < ripple.fraction < 0.06
    assert set(ripple.peaks(2)) <= {31, 50}
    ended = log["actual_qd"][np.flatnonzero(log["target_qd"][:, 5])[-1] + 1 :, 5]
    assert not ended.any()

"""The simulated arm moves as a UR10e does: real ramps, time scaling, stops, and a vibration that integrates exactly."""

import math
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.motion import geometry as rig_kinematics
from rig.world.clock import TICK_S, WorldClock
from rig.world.ur10e.motion import forward_kinematics
from rig.world.ur10e.motion.encoders import Encoders
from rig.world.ur10e.motion.joint_motion import JointMotion
from rig.world.ur10e.motion.ripple import Ripple, draw_ripple
from rig.world.ur10e.motion.trajectory import Joints

HOME: Joints = (0.0, -math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, 0.0)
CYCLES = (18, 31, 50)
angles = st.floats(-2 * math.pi, 2 * math.pi)


class Player:
    """A motion and its virtual time."""

    def __init__(self, fraction: float = 0.0, start: Joints = HOME) -> None:
        random = Random(7)
        self.motion = JointMotion(start, [draw_ripple(fraction, CYCLES, random) for _ in range(6)])
        self.ticks = 0

    def tick(self) -> None:
        self.ticks += 1
        self.motion.step(self.ticks * TICK_S)

    def until_standing(self, limit_s: float = 60.0) -> float:
        """Play to the end; the virtual time it took."""
        start = self.ticks
        while not self.motion.standing:
            assert (self.ticks - start) * TICK_S < limit_s
            self.tick()
        return (self.ticks - start) * TICK_S


def turned(start: Joints, joint: int, angle: float) -> Joints:
    return (*start[:joint], start[joint] + angle, *start[joint + 1 :])


def test_a_move_ramps_up_cruises_and_ramps_down_as_asked() -> None:
    player, target = Player(), turned(HOME, 5, math.pi)
    player.motion.move(target, math.radians(60), math.radians(80))
    speeds = []
    while not player.motion.standing:
        player.tick()
        speeds.append(math.degrees(player.motion.qd_rad_s[5]))
    assert len(speeds) * TICK_S == pytest.approx(180 / 60 + 60 / 80, abs=TICK_S)  # way over speed, plus one ramp
    assert speeds[100] == pytest.approx(80 * 101 * TICK_S)  # on the ramp up
    assert speeds[375:1499] == pytest.approx([60.0] * 1124)  # constant between the ramps
    assert speeds[1599] == pytest.approx(60 - 80 * (3.2 - 3.0))  # on the ramp down
    assert player.motion.q_rad == pytest.approx(target, abs=1e-12)


def test_a_short_move_is_a_triangle() -> None:
    player = Player()
    player.motion.move(turned(HOME, 0, 0.1), 1.05, 1.4)
    assert player.until_standing() == pytest.approx(2 * math.sqrt(0.1 / 1.4), abs=TICK_S)


def test_no_joint_exceeds_its_limit_and_all_arrive_together() -> None:
    player = Player()
    target = (HOME[0] + 2.0, HOME[1] + 1.0, HOME[2], HOME[3] - 0.5, HOME[4], HOME[5])
    player.motion.move(target, 3.14, 10.0)
    way = np.subtract(target, HOME)
    while not player.motion.standing:
        player.tick()
        assert abs(player.motion.qd_rad_s[0]) <= math.radians(120) + 1e-9  # the base is a slow joint
        gone = np.subtract(player.motion.q_rad, HOME)
        assert gone == pytest.approx(way * gone[0] / way[0], abs=1e-9)


@pytest.mark.thorough
@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.tuples(*[angles] * 6), st.floats(0.5, 3.1), st.floats(0.5, 20.0), st.sampled_from([0.0, 0.05, 0.2]))
def test_any_move_ends_exactly_on_target_without_a_jump(
    target: Joints, speed: float, ramp: float, vibration: float
) -> None:
    player = Player(vibration)
    player.motion.move(target, speed, ramp)
    before, gain = player.motion.now.target_qd_rad_s, 1e-9 + ramp * TICK_S * 1.0001
    while not player.motion.standing:
        player.tick()
        assert max(abs(b - a) for a, b in zip(before, player.motion.now.target_qd_rad_s, strict=True)) <= gain
        before = player.motion.now.target_qd_rad_s
    assert player.motion.q_rad == pytest.approx(target, abs=1e-9)
    assert not any(player.motion.qd_rad_s)


def test_the_vibration_has_the_asked_rms_and_adds_nothing_over_a_turn() -> None:
    shape = draw_ripple(0.05, CYCLES, Random(3))
    smooth = np.linspace(0.3, 0.3 + 2 * math.pi, 20001)[:-1]
    gains = np.array([shape.gain(u) for u in smooth])
    assert gains.mean() == pytest.approx(1.0, abs=1e-12)
    assert math.sqrt(np.mean((gains - 1.0) ** 2)) == pytest.approx(0.05, rel=1e-9)
    assert shape.angle(1.7 + 2 * math.pi) - shape.angle(1.7) == pytest.approx(2 * math.pi, abs=1e-12)


def test_the_rate_is_the_derivative_of_the_angle_at_any_instant_of_a_tick() -> None:
    player = Player(0.05)
    player.motion.move(turned(HOME, 4, 5.0), 1.0, 1.4)
    for fraction_wanted in (1.0, 0.4):
        player.motion.fraction_wanted = fraction_wanted
        for _ in range(150):
            player.tick()
            end = player.ticks * TICK_S
            for inside in (0.0002, 0.001, 0.0018):
                before = player.motion.joints_at(end - inside - 1e-6)[0][4]
                after = player.motion.joints_at(end - inside + 1e-6)[0][4]
                assert (after - before) / 2e-6 == pytest.approx(player.motion.joints_at(end - inside)[1][4], abs=1e-5)


@pytest.mark.slow
def test_the_measured_turn_takes_the_time_of_the_smooth_speed() -> None:
    """Two passes of the joint, a whole turn apart, give the commanded speed whatever the vibration."""
    player = Player(0.08, start=turned(HOME, 5, -3.6))
    player.motion.move(turned(HOME, 5, 3.6), 1.0, 2.0)
    times = []
    angles_seen = []
    while not player.motion.standing:
        player.tick()
        times.append(player.ticks * TICK_S)
        angles_seen.append(player.motion.q_rad[5])
    first, last = np.interp([-math.pi, math.pi], angles_seen, times)
    assert 2 * math.pi / (last - first) == pytest.approx(1.0, rel=1e-3)


def test_half_the_slider_takes_twice_the_time() -> None:
    full, half = Player(), Player()
    for player, fraction in ((full, 1.0), (half, 0.5)):
        player.motion.fraction_wanted = fraction
        for _ in range(200):  # let the slider take effect
            player.tick()
        player.motion.move(turned(HOME, 3, 2.0), 1.0, 1.4)
    assert half.until_standing() == pytest.approx(2 * full.until_standing(), abs=3 * TICK_S)


def test_a_pause_stops_softly_and_the_move_goes_on_after_it() -> None:
    player, target = Player(), turned(HOME, 5, 3.0)
    player.motion.move(target, 1.0, 1.4)
    for _ in range(600):
        player.tick()
    player.motion.fraction_wanted = 0.0
    speeds = []
    for _ in range(200):
        player.tick()
        speeds.append(player.motion.qd_rad_s[5])
    assert max(-np.diff([1.0, *speeds])) <= 4.0 * TICK_S + 1e-9
    assert speeds[-1] == 0.0 and not player.motion.standing
    player.motion.fraction_wanted = 1.0
    player.until_standing()
    assert player.motion.q_rad == pytest.approx(target, abs=1e-12)


@pytest.mark.parametrize("deceleration", [1.0, 4.0, 15.0])
def test_a_stop_decelerates_evenly(deceleration: float) -> None:
    player = Player()
    player.motion.move(turned(HOME, 5, 5.0), 1.0, 4.0)
    for _ in range(500):
        player.tick()
    player.motion.stop(deceleration)
    at = player.motion.q_rad[5]
    assert player.until_standing() == pytest.approx(1.0 / deceleration, abs=TICK_S)
    assert player.motion.q_rad[5] - at == pytest.approx(0.5 / deceleration, abs=1e-9)


def test_a_speed_command_holds_its_speed() -> None:
    player = Player()
    player.motion.speed((0.0, 0.0, 0.0, 0.0, 0.0, 0.5), 1.0)
    for _ in range(1000):
        player.tick()
    assert player.motion.qd_rad_s[5] == pytest.approx(0.5)
    assert player.motion.q_rad[5] == pytest.approx(0.5 * (2.0 - 0.25), abs=1e-9)


def test_encoders_report_whole_steps() -> None:
    motion = JointMotion(HOME, [Ripple()] * 6, Encoders(step_rad=1e-3))
    motion.move(turned(HOME, 5, 1.0), 1.0, 1.4)
    for tick in range(1, 300):
        motion.step(tick * TICK_S)
        assert motion.actual_q_rad[5] / 1e-3 == pytest.approx(round(motion.actual_q_rad[5] / 1e-3), abs=1e-9)
        assert abs(motion.actual_q_rad[5] - motion.q_rad[5]) <= 0.5e-3 + 1e-12


@pytest.mark.slow
@settings(max_examples=50, deadline=None)
@given(st.tuples(*[angles] * 6), st.tuples(*[st.floats(-3, 3)] * 6))
def test_the_worlds_kinematics_agree_with_the_rigs(q: Joints, qd: Joints) -> None:
    assert forward_kinematics.flange_rate(q, qd) == pytest.approx(rig_kinematics.flange_rate(q, qd), abs=1e-9)
    pose, matrix = forward_kinematics.flange_pose(q), rig_kinematics.flange_pose(q)
    assert pose[:3] == pytest.approx(matrix[:3, 3], abs=1e-9)
    assert np.array(forward_kinematics.rotation_from_vector(pose[3:])) == pytest.approx(matrix[:3, :3], abs=1e-6)


def test_wrist_axes_in_the_flange_frame() -> None:
    """The makers' geometry: at wrist 2 = −90°, wrist 3 = 0 the three wrists turn about −x, −y and z of the flange."""
    for joint, axis in ((3, (-1, 0, 0)), (4, (0, -1, 0)), (5, (0, 0, 1))):
        assert forward_kinematics.flange_rate(HOME, turned((0.0,) * 6, joint, 1.0)) == pytest.approx(axis, abs=1e-12)


class Wall:
    """A wall clock that stands still until told otherwise."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_virtual_time_never_runs_faster_than_asked_and_never_jumps() -> None:
    wall = Wall()
    clock = WorldClock(10.0, wall)

    def play(duration_s: float) -> int:
        """Ticks made in so much wall time, looking every microsecond or so."""
        start, end = clock.tick, wall.now_s + duration_s
        while wall.now_s < end:
            wait_s = clock.wait_s()
            if wait_s <= 0.0:
                clock.count()
            wall.now_s += max(wait_s, 1e-6)
        return clock.tick - start

    assert play(0.1) == pytest.approx(500, abs=2)
    wall.now_s += 0.01  # a little late: it catches up
    assert play(0.1) == pytest.approx(500 + 50, abs=2)
    wall.now_s += 30.0  # the machine was busy: virtual time has waited
    assert play(0.1) <= 502


def test_a_held_clock_stands_until_advanced() -> None:
    wall = Wall()
    clock = WorldClock(1.0, wall)
    clock.hold()
    wall.now_s += 5.0
    assert clock.wait_s() == math.inf
    assert clock.advance(0.01) == 5
    for _ in range(5):
        wall.now_s += TICK_S * 1.001
        assert clock.wait_s() <= 1e-9
        clock.count()
    assert clock.is_held
    clock.run()
    wall.now_s += TICK_S
    assert clock.wait_s() <= 1e-9

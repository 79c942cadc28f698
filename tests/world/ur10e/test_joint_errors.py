"""What the joints do beside what their encoders say has the asked size, and adds nothing where it must not."""

import math
from random import Random

import numpy as np
import pytest

from rig.world.clock import TICK_S
from rig.world.ur10e.motion.encoders import Encoders
from rig.world.ur10e.motion.joint_errors import Errors, JointErrors
from rig.world.ur10e.motion.joint_motion import JointMotion
from rig.world.ur10e.motion.ripple import draw_ripple
from rig.world.ur10e.motion.trajectory import Joints

STILL: Joints = (0.0,) * 6
ALL = Errors((1e-3,) * 6, 2e-4, 1e-4, 1e-4, (2 * math.pi * 13,), 0.002, 1e-4, 2 * math.pi * 9, 0.2)


class Player:
    """Joints that move with a ripple, their errors, and the controller's time."""

    def __init__(self, errors: Errors = ALL, memory_s: float = 0.0) -> None:
        random = Random(7)
        ripples = [draw_ripple(0.05, (18, 31, 50), random) for _ in range(6)]
        self.motion = JointMotion(STILL, ripples, memory_s=memory_s)
        self.errors = JointErrors(errors, random)
        self.time_s = 0.0

    def ticks(self, count: int) -> None:
        for _ in range(count):
            self.time_s += TICK_S
            self.motion.step(self.time_s)
            self.errors.step(self.time_s, self.motion.smooth_qd_rad_s, lambda: self.motion.q_rad)

    def turn(self, angle_rad: float, wait_s: float = 0.0) -> None:
        """Wrist 3 to an angle."""
        self.motion.move((*STILL[:5], angle_rad), 1.0, 4.0)
        self.ticks(1)
        while not self.motion.standing:
            self.ticks(1)
        self.ticks(round(wait_s / TICK_S))

    def true(self, time_s: float) -> tuple[Joints, Joints, Joints]:
        return self.errors.true_state(time_s, *self.motion.state_at(time_s))


@pytest.mark.slow
def test_rates_and_accelerations_are_the_derivatives_of_the_true_angles() -> None:
    """Through ramps, a change of the slider and a stop, with every error there is."""
    player = Player()
    player.turn(1.0, 1.0)
    player.motion.move((0.5, 0.1, -0.3, 0.2, 1.0, -2.0), 1.0, 4.0)
    step = 1e-4
    for turn in range(400):
        player.ticks(1)
        if turn == 100:
            player.motion.fraction_wanted = 0.4
        if turn == 250:
            player.motion.stop(4.0)
        middle = player.time_s - TICK_S / 2
        before, here, after = (player.true(middle + offset) for offset in (-step, 0.0, step))
        for joint in range(6):
            angles = [at[0][joint] for at in (before, here, after)]
            assert (angles[2] - angles[0]) / (2 * step) == pytest.approx(here[1][joint], abs=2e-4)
            assert (after[1][joint] - before[1][joint]) / (2 * step) == pytest.approx(here[2][joint], abs=0.02)


def test_a_whole_turn_of_the_encoder_is_one_of_the_joint() -> None:
    errors = JointErrors(Errors(encoder_once_rad=2e-4, encoder_twice_rad=1e-4), Random(1))
    seen = np.linspace(0.0, 2 * math.pi, 721)
    true = np.array([errors.true_state(0.0, (e,) * 6, STILL, STILL)[0][3] for e in seen])
    deviation = (true - seen)[:-1]
    assert deviation[0] == pytest.approx(true[-1] - 2 * math.pi, abs=1e-12)
    spectrum = 2 * np.abs(np.fft.rfft(deviation)) / len(deviation)
    assert spectrum[:4] == pytest.approx([0, 2e-4, 1e-4, 0], abs=1e-9)


def test_zero_errors_shift_the_joints() -> None:
    zero_rad = (1e-3, 0.0, -2e-3, 0.0, 0.0, 5e-4)
    assert JointErrors(Errors(zero_rad), Random(1)).true_state(0.0, STILL, STILL, STILL)[0] == pytest.approx(zero_rad)


def test_a_joint_stands_elsewhere_when_it_comes_from_the_other_side() -> None:
    player = Player(Errors(hysteresis_rad=1e-4))
    player.turn(-1.0)
    player.turn(0.3)
    from_below = player.true(player.time_s)[0][5]
    player.turn(1.0)
    player.turn(0.3)
    assert player.true(player.time_s)[0][5] - from_below == pytest.approx(1e-4, rel=1e-6)
    player.turn(0.3 - 0.001)  # a tenth of the way that a reversal takes: most of it is kept
    assert player.true(player.time_s)[0][5] + 0.001 - from_below == pytest.approx(1e-4, rel=1e-6)


def test_the_wrists_vibrate_with_the_asked_rms_and_frequency_and_unlocked() -> None:
    errors = JointErrors(Errors(vibration_rad_s=(2 * math.pi * 13,), vibration_rms_rad_s=0.002), Random(1))
    times_s = np.arange(0.0, 10.0, 1 / 500)
    rates = np.array([errors.true_state(t, STILL, STILL, STILL)[1] for t in times_s])
    assert np.sqrt(np.mean(rates**2, axis=0)) == pytest.approx([0, 0, 0, 0.002, 0.002, 0.002], rel=1e-3)
    assert np.abs(np.fft.rfft(rates[:, 4])).argmax() == 130
    assert not errors.is_quiet(0.0)


def test_a_joint_that_stopped_swings_out_and_the_others_do_not() -> None:
    player = Player(Errors(settling_rad=1e-4, settling_rad_s=2 * math.pi * 9, settling_decay_s=0.2))
    player.turn(1.0)
    stop_s = player.time_s
    times_s = stop_s + np.arange(0.0, 1.0, 1 / 500)
    swing = np.array([player.errors.true_state(t, player.motion.q_rad, STILL, STILL)[0] for t in times_s])
    expected = 1e-4 * np.exp(-(times_s - stop_s) / 0.2) * np.sin(2 * math.pi * 9 * (times_s - stop_s))
    assert swing[:, 5] - 1.0 == pytest.approx(expected, abs=1e-12)
    assert not swing[:, :5].any()
    assert not player.errors.is_quiet(stop_s + 1.0) and player.errors.is_quiet(stop_s + 3.0)


def test_the_motion_of_a_while_ago_is_remembered() -> None:
    now, later = Player(), Player(memory_s=0.03)
    for player in (now, later):
        player.motion.move((*STILL[:5], 3.0), 1.0, 4.0)
    seen = []
    for _ in range(200):
        now.ticks(1)
        seen.append(now.motion.state_at(now.time_s - 0.0007))
    later.ticks(15)
    for tick in range(185):
        later.ticks(1)
        at_s = later.time_s - 0.03 - 0.0007
        for was, remembered in zip(seen[tick], later.motion.state_at(at_s), strict=True):
            assert remembered == pytest.approx(was, abs=1e-9)


def test_the_encoders_are_read_early_or_late_by_what_is_asked() -> None:
    rng = Random(3)
    late_s: list[float] = []

    def lateness_s() -> float:
        late_s.append(rng.gauss(0.0, 1e-4))
        return late_s[-1]

    motion = JointMotion(STILL, [draw_ripple(0.0, (), rng)] * 6, Encoders(lateness_s=lateness_s))
    motion.speed((0.0, 0.0, 0.0, 0.0, 0.0, 1.0), 100.0)
    for tick in range(1, 200):
        motion.step(tick * TICK_S)
        if tick > 20:
            assert motion.actual_q_rad[5] - motion.q_rad[5] == pytest.approx(late_s[-1], abs=1e-12)

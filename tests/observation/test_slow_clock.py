"""The clock of a board whose fit settles slowly, goes to and fro, or only seems to have settled.

`slow_clock.npz` has the readings of an MPU-9250 on an arm that vibrates, in a slow axis' sweep, and the arm's states,
as a simulated world recorded them: after 400 steps the fit had not settled, each being 0.985 of the one before, and a
sound run was refused. `cycling_clock.npz` has those of an LSM9DS1 in three sweeps, of which the last seconds had not
come yet: after 400 steps the fit went to and fro.
"""

import numpy as np
import pytest

from rig.data.quantity import RATE
from rig.estimation.arrays import Array
from rig.motion.chain import DenavitHartenberg
from rig.motion.state_rows import ARM_STATE_DTYPE
from rig.observation.clocks.clock_estimate import estimate_time_base
from rig.observation.clocks.time_base import TimeBase
from rig.observation.motion.arm_motion import ArmMotion
from support.paths import ROOT
from support.recordings.synthetic_run import Setup, synthetic_run

SWEPT_S, STATE_S = 5.0, 0.008


def sweep(since_s: Array) -> Array:
    """Rate of a joint at times (n,) since the start of its sweep."""
    return np.interp(since_s, [0, 0.3, SWEPT_S - 0.3, SWEPT_S], [0, 1.2, 1.2, 0])


def wrist(time_s: Array, rate: Array) -> ArmMotion:
    """The motion of an arm whose last joint turns at a rate (n,)."""
    states = np.zeros(len(time_s), ARM_STATE_DTYPE)
    states["time_s"], states["q_rad"][:, 5] = time_s, (np.cumsum(rate) - rate / 2) * STATE_S
    return ArmMotion(states)


def read(board_s: Array, time_s: Array, rate: Array) -> Array:
    """The readings (n, 3) of a sensor on that flange."""
    noise = 0.002 * np.random.default_rng(3).standard_normal((len(board_s), 3))
    readings: Array = np.outer(np.interp(board_s, time_s, rate), [0.1, 0.0, 1.0]) + noise
    return readings


def clock_of(name: str) -> TimeBase:
    recorded = np.load(ROOT / "tests" / "fixtures" / f"{name}.npz")
    arm = np.zeros(len(recorded["arm_s"]), ARM_STATE_DTYPE)
    arm["time_s"], arm["q_rad"] = recorded["arm_s"], recorded["q_rad"]
    motion = ArmMotion(arm, DenavitHartenberg(*map(tuple, recorded["geometry"].tolist())))
    return estimate_time_base(recorded["time_us"] * 1e-6, recorded["counts"] * float(recorded["per_count"]), motion)


def test_a_clock_whose_fit_takes_ever_smaller_steps_is_found() -> None:
    clock = clock_of("slow_clock")
    assert clock.offset_s == pytest.approx(1.75766, abs=clock.offset_std_s)  # where a thousand plain steps end
    assert clock.offset_std_s < 1e-4


def test_a_clock_whose_noise_seems_correlated_at_every_other_step_is_found() -> None:
    """Its weights went to and fro with it, and it with them, by a tenth of its standard deviation."""
    clock = clock_of("cycling_clock")
    assert clock.offset_std_s < 1e-4 and clock.drift == pytest.approx(580e-6, abs=10e-6)  # the whole run's


@pytest.mark.slow
def test_a_clock_whose_offset_begins_right_is_not_found_before_its_drift() -> None:
    """The first reading's time chooses where the fit begins: its first step moves the drift by 368 ppm of 1000 here,
    and the offset by less than a thousandth of its standard deviation."""
    setup = Setup(speed_deg_s=150.0, rest_s=0.5, repeats=2, noise_rad_s=0.004, sample_rate_hz=59.5, drift=1e-3)
    run = synthetic_run(setup)
    board_s = run.samples["gyro"]["board_time_us"] * 1e-6
    board_s[0] -= 4.316e-3
    readings_rad_s = run.samples["gyro"]["counts"] * run.sensors["gyro"].channel(RATE).unit_per_count
    clock = estimate_time_base(board_s, readings_rad_s, ArmMotion(run.states))
    assert abs(clock.drift - setup.drift) < 4 * clock.drift_std < 10e-6


@pytest.mark.parametrize("first_s", [2.0, 5.0])
def test_equal_sweeps_to_and_fro_are_not_taken_for_each_other(first_s: float) -> None:
    """With another offset, and another sign, each of three sweeps explains the next, so two of them are explained."""
    time_s = np.arange(0.0, first_s + 2 * 12.0 + SWEPT_S, STATE_S)
    first, second, third = (sweep(time_s - first_s - number * 12.0) for number in range(3))
    rate = first - second + third
    board_s = np.arange(0.0, time_s[-1], 0.01)
    clock = estimate_time_base(board_s - 700.0, read(board_s, time_s, rate), wrist(time_s, rate))
    assert clock.controller_time_s(np.array([-690.0]))[0] == pytest.approx(10.0, abs=0.01)


@pytest.mark.slow
def test_vibrations_of_a_long_rest_do_not_move_the_clock_of_the_one_sweep_after_it() -> None:
    """The encoders show little of the vibrations, and with another phase than the sensor."""
    time_s = np.arange(0.0, 300.0, STATE_S)
    board_s = np.arange(0.0, 300.0, 0.01)
    rate = sweep(time_s - 292.0)
    readings = read(board_s, time_s, rate)
    for hertz, size in ((13.7, 4e-3), (1.57, 2e-3)):
        angle = 2 * np.pi * hertz * time_s
        readings += size * np.sin(2 * np.pi * hertz * board_s)[:, None]
        rate = rate + 0.3 * size * np.sin(angle + 1.0)
    clock = estimate_time_base(board_s - 700.0, readings, wrist(time_s, rate))
    assert clock.controller_time_s(np.array([294.5 - 700]))[0] == pytest.approx(294.5, abs=2e-3)

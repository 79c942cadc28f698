"""The clock of a board whose fit settles slowly, goes to and fro, or only seems to have settled.

`slow_clock.npz` has the readings of an MPU-9250 on an arm that vibrates, in a slow axis' sweep, and the arm's states,
as a simulated world recorded them: after 400 steps the fit had not settled, each being 0.985 of the one before, and a
sound run was refused. `cycling_clock.npz` has those of an LSM9DS1 in three sweeps, of which the last seconds had not
come yet: after 400 steps the fit went to and fro.
"""

import numpy as np
import pytest

from rig.data.quantity import RATE
from rig.motion.chain import DenavitHartenberg
from rig.motion.state_rows import ARM_STATE_DTYPE
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.timebase import TimeBase, estimate_time_base
from support.paths import ROOT
from support.recordings.synthetic_run import Setup, synthetic_run


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

"""The clock of a board whose fit takes ever smaller steps: an MPU-9250 on an arm that vibrates, in a slow axis' sweep.

`slow_clock.npz` has its readings and the arm's states as a simulated world recorded them: after 400 steps the fit had
not settled, each being 0.985 of the one before, and a sound run was refused.
"""

import numpy as np
import pytest

from rig.motion.geometry import DenavitHartenberg
from rig.motion.state import ARM_STATE_DTYPE
from rig.observation.arm_motion import ArmMotion
from rig.observation.timebase import estimate_time_base
from support.paths import ROOT


def test_a_clock_whose_fit_takes_ever_smaller_steps_is_found() -> None:
    recorded = np.load(ROOT / "tests" / "fixtures" / "slow_clock.npz")
    arm = np.zeros(len(recorded["arm_s"]), ARM_STATE_DTYPE)
    for name, column in (("time_s", "arm_s"), ("q_rad", "q_rad"), ("qd_rad_s", "qd_rad_s")):
        arm[name] = recorded[column]
    motion = ArmMotion(arm, DenavitHartenberg(*map(tuple, recorded["geometry"].tolist())))
    readings = recorded["counts"] * float(recorded["per_count"])
    clock = estimate_time_base(recorded["time_us"] * 1e-6, readings, motion)
    assert clock.offset_s == pytest.approx(1.75714, abs=clock.offset_std_s)  # where a thousand plain steps end
    assert clock.offset_std_s < 1e-4

"""Samples whose times are not well known: what lasts by them from standing to standing contradicts nothing."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.data.recording.run_file import read_run
from support.paths import RECORDINGS

pytestmark = pytest.mark.slow

WANDERS_S, IN_S = 3e-3, 7.0


def failed(stamp_std_s: float | None) -> set[str]:
    """The checks that fail where times of samples wander by 3 ms, and so much is stated of them."""
    run = read_run(RECORDINGS / "lines" / "run.h5")
    samples, sensor = run.samples["imu"].copy(), run.sensors["imu"]
    time_us = samples["board_time_us"].astype(np.float64)
    samples["board_time_us"] = np.rint(time_us + 1e6 * WANDERS_S * np.sin(2e-6 * np.pi * time_us / IN_S))
    late = replace(run, samples=run.samples | {"imu": samples})
    late = replace(late, sensors=run.sensors | {"imu": replace(sensor, stamp_std_s=stamp_std_s)})
    outcome = calibrate([late], "newton")
    np.testing.assert_allclose(outcome.results["imu"].scale, [1.011, 0.993, 1.006], atol=1e-4)
    return {check.name for check in outcome.checks if not check.passed}


def test_times_that_wander_as_is_stated_change_no_scale_factor() -> None:
    assert failed(None) == {"imu.scale_changed", "imu.loose_mounting", "imu.axis_changed"}
    assert not failed(WANDERS_S)

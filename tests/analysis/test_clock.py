"""The controller's clock is held against others that are in the recording."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.clock import NOMINAL_DRIFT, check_clock, state_jitter
from rig.data.run_file import RunData
from rig.data.settings import Uncertainty
from rig.observation.observed_run import ObservedRun, observe_runs
from support.synthetic_run import Setup, synthetic_run

PPM = 1e-6
KNOWN = Uncertainty(50.0, 1.0, 20.0, 0.06, 50.0, {}, "simple")


def observed(setup: Setup, host_slope: float) -> ObservedRun:
    """A recording whose states came at a computer that counts `host_slope` seconds for one of the controller's."""
    run: RunData = synthetic_run(setup)
    arm = run.arm.copy()
    late = np.random.default_rng(5).exponential(5e-4, len(arm))
    arm["host_time_s"] = 1000.0 + host_slope * (arm["time_s"] - arm["time_s"][0]) + late
    (seen,) = observe_runs([replace(run, arm=arm)])
    return seen


def test_a_clock_that_runs_too_fast_is_found_by_the_computers() -> None:
    seen = observed(Setup(speed_deg_s=120, noise_rad_s=0.002), 1 - 40 * PPM)
    check = check_clock(seen, KNOWN)
    assert [each.by for each in check.comparisons] == ["the computer's clock"]  # no crystal drives that board
    assert check.error == pytest.approx(40 * PPM, abs=2 * PPM)
    assert 0.5 * PPM < check.std < 1 * PPM


def test_where_the_computers_clock_says_nothing_the_crystal_does() -> None:
    drift = (1 + 40 * PPM) * (1 + NOMINAL_DRIFT) / (1 + 5 * PPM) - 1  # a crystal that is 5 ppm fast itself
    seen = observed(Setup(speed_deg_s=120, noise_rad_s=0.002, drift=drift), 0.2)
    check = check_clock(seen, KNOWN)
    assert [each.by for each in check.comparisons] == ["the board's crystal"]
    assert abs(check.error - 40 * PPM) < 2 * check.std
    assert check.std == pytest.approx(10.7 * PPM, rel=0.02)  # 20 ppm / √3, and that it is within 50 ppm anyway


def test_without_another_clock_nothing_is_corrected() -> None:
    check = check_clock(observed(Setup(speed_deg_s=120), 0.2), KNOWN)
    assert check.comparisons == () and check.error == 0.0
    assert check.std == pytest.approx(50 * PPM / np.sqrt(3))


def test_the_jitter_of_the_states_is_measured() -> None:
    run = synthetic_run(Setup(speed_deg_s=120))
    arm = run.arm.copy()
    motion = observe_runs([run])[0].motion
    jitter = np.random.default_rng(6).normal(0, 1e-4, len(arm))
    arm["q_rad"] = motion.angles(arm["time_s"] + jitter)
    (seen,) = observe_runs([replace(run, arm=arm)])
    assert state_jitter(seen).std_s == pytest.approx(1e-4, rel=0.1)
    assert state_jitter(observe_runs([run])[0]).std_s < 1e-5

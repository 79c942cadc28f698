"""The controller's clock is held against others that are in the recording, and all of them against each other."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.check import Check
from rig.analysis.clock_comparison import check_clock
from rig.analysis.verdict import clock_checks
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import Uncertainty
from rig.observation.clocks.time_base import NOMINAL_DRIFT
from rig.observation.consistency.arm_clock import find_encoder_noise_rad, state_jitter
from rig.observation.observed_run import ObservedRun, observe_runs
from support.recordings.synthetic_run import Setup, synthetic_run

pytestmark = pytest.mark.slow

PPM = 1e-6
SIMULATED, REAL = "URSoftware 5.14.0.0 (simulated)", "URSoftware 5.14.0.0"
FAST = Setup(speed_deg_s=120, noise_rad_s=0.002)


@cache
def find_stated() -> Uncertainty:
    """Return the uncertainty that a run states if its configuration does not: of clocks 50, 1 and 20 ppm."""
    return synthetic_run(Setup()).settings.stated_uncertainty


def recorded(setup: Setup, host_slope: float, software: str = SIMULATED) -> RunData:
    """A recording whose states came at a computer that counts `host_slope` seconds for one of the controller's."""
    run = synthetic_run(setup)
    arm = run.states.copy()
    late = np.random.default_rng(5).exponential(5e-4, len(arm))
    arm["host_time_s"] = 1000.0 + host_slope * (arm["time_s"] - arm["time_s"][0]) + late
    return replace(run, states=arm, provenance=replace(run.provenance, arm_software=software))


def observed(setup: Setup, host_slope: float, software: str = SIMULATED) -> ObservedRun:
    (seen,) = observe_runs([recorded(setup, host_slope, software)])
    return seen


def with_crystal(controller_ppm: float, crystal_ppm: float = 0.0) -> Setup:
    """A board whose counter a crystal holds, by its own word, and a controller: how much too fast each of them is."""
    drift = (1 + controller_ppm * PPM) * (1 + NOMINAL_DRIFT) / (1 + crystal_ppm * PPM) - 1
    return replace(FAST, drift=drift, follows_crystal=True)


def of_clocks(setup: Setup, host_slope: float = 0.2, software: str = SIMULATED) -> dict[str, Check]:
    """The checks of the clocks, by the two they name.

    A computer that counts a fifth of the controller's seconds is a simulated laboratory's.
    """
    return named(clock_checks([check_clock(observed(setup, host_slope, software), find_stated())]))


def in_two(whole: RunData) -> tuple[RunData, RunData]:
    """The recordings of a run that was resumed, an hour later and with a computer that is 200 ppm slow by then."""
    arm, half = whole.states.copy(), len(whole.events) // 2
    arm["host_time_s"] = 5000.0 + (1 - 200 * PPM) * (arm["host_time_s"] - arm["host_time_s"][0])
    later = replace(whole.provenance, started_utc="2026-11-21T01:00:00+00:00")
    return (
        replace(whole, events=whole.events[:half]),
        replace(whole, states=arm, provenance=later, events=whole.events[half:]),
    )


def named(checks: Sequence[Check]) -> dict[str, Check]:
    begins = "clocks_agree."
    return {check.name.removeprefix(begins): check for check in checks if check.name.startswith(begins)}


def test_a_clock_that_runs_too_fast_is_found_by_the_computers() -> None:
    seen = observed(FAST, 1 - 40 * PPM)
    check = check_clock(seen, find_stated())
    assert [comparison.by for comparison in check.comparisons] == [
        "the computer's clock"
    ]  # no crystal drives that board
    assert check.error == pytest.approx(40 * PPM, abs=2 * PPM)
    assert 0.5 * PPM < check.std < 1 * PPM


def test_where_the_computers_clock_says_nothing_the_crystal_does() -> None:
    seen = observed(with_crystal(40, crystal_ppm=5), 0.2)
    check = check_clock(seen, find_stated())
    assert [comparison.by for comparison in check.comparisons] == ["the board's crystal"]
    assert abs(check.error - 40 * PPM) < 2 * check.std
    assert check.std == pytest.approx(10.7 * PPM, rel=0.02)  # 20 ppm / √3, and that it is within 50 ppm anyway


def test_without_another_clock_nothing_is_corrected() -> None:
    check = check_clock(observed(Setup(speed_deg_s=120), 0.2), find_stated())
    assert check.comparisons == () and check.error == 0.0
    assert check.std == pytest.approx(50 * PPM / np.sqrt(3))


def test_the_jitter_of_the_states_is_measured() -> None:
    run = synthetic_run(Setup(speed_deg_s=120, encoder_noise_rad=0.0))  # which would count as jitter
    arm = run.states.copy()
    motion = observe_runs([run])[0].motion
    jitter = np.random.default_rng(6).normal(0, 1e-4, len(arm))
    arm["q_rad"] = motion.angles(arm["time_s"] + jitter)
    (seen,) = observe_runs([replace(run, states=arm)])
    exact = observe_runs([run])
    assert state_jitter([seen]).std_s == pytest.approx(1e-4, rel=0.1)
    assert state_jitter(exact).std_s < 1e-5
    assert state_jitter([seen, *exact]).std_s == pytest.approx(1e-4 / np.sqrt(2), rel=0.1)


@pytest.mark.parametrize("state_rate_hz", [125.0, 500.0])
def test_the_noise_of_the_encoders_is_measured_at_the_joints_that_stand(state_rate_hz: float) -> None:
    for noise_rad in (0.0, 2.4e-5):
        seen = observe_runs([synthetic_run(Setup(encoder_noise_rad=noise_rad, state_rate_hz=state_rate_hz))])
        assert find_encoder_noise_rad(seen) == pytest.approx(noise_rad, rel=0.05, abs=2e-6)


def test_clocks_that_agree_pass_and_are_named_in_pairs() -> None:
    checks = of_clocks(with_crystal(40, crystal_ppm=-15), 1 - 40 * PPM)
    assert set(checks) == {"controller_and_computer", "controller_and_crystal", "computer_and_crystal"}
    assert all(check.passed and check.unit == "ppm" for check in checks.values())


@pytest.mark.parametrize("controller_ppm", [-146, 500, 20_000])
def test_a_controllers_clock_beyond_what_is_stated_fails_by_how_far_it_is_off(controller_ppm: float) -> None:
    check = of_clocks(with_crystal(controller_ppm))["controller_and_crystal"]
    assert not check.passed
    assert check.value == pytest.approx(abs(controller_ppm), abs=5)
    assert check.limit == pytest.approx(70, abs=15)  # 50 of the controller's, 20 of the crystal's


@pytest.mark.parametrize("computer", [-9e-3, 1e-3])
def test_a_computers_clock_that_contradicts_both_fails_with_both(computer: float) -> None:
    checks = of_clocks(with_crystal(10), 1 + computer)
    failed = {name for name, check in checks.items() if not check.passed}
    assert failed == {"controller_and_computer", "computer_and_crystal"}


def test_two_others_that_agree_name_the_controller() -> None:
    checks = of_clocks(with_crystal(300), 1 - 300 * PPM)
    assert checks["computer_and_crystal"].passed
    assert not checks["controller_and_computer"].passed and not checks["controller_and_crystal"].passed


@pytest.mark.parametrize("pace", [0.98, 1.02, 8.0])
def test_a_laboratory_that_is_simulated_at_a_pace_of_its_own_is_held_against_no_computer(pace: float) -> None:
    checks = of_clocks(with_crystal(10), 1 / pace)
    assert set(checks) == {"controller_and_crystal"} and checks["controller_and_crystal"].passed


def test_the_computer_of_a_controller_that_is_real_is_a_clock_however_far_off_it_is() -> None:
    """Without a board, as of an instrument with a port of its own, nothing else tells."""
    checks = of_clocks(FAST, 1 / 1.02, REAL)
    assert set(checks) == {"controller_and_computer"} and not checks["controller_and_computer"].passed
    assert checks["controller_and_computer"].value == pytest.approx(2e4, rel=0.01)


def test_every_recording_of_a_run_is_compared_with_its_computer_and_the_worst_is_reported() -> None:
    whole = recorded(FAST, 1.0, REAL)
    assert named(calibrate([whole]).checks)["controller_and_computer"].passed
    both = calibrate(in_two(whole))
    check = named(both.checks)["controller_and_computer"]
    assert not check.passed and check.value == pytest.approx(200, abs=5)
    assert both.clock is not None and abs(both.clock.error) < 5 * PPM  # speeds go by the longest


def test_a_board_that_says_it_follows_no_crystal_is_compared_with_nothing_however_near_it_runs() -> None:
    assert of_clocks(replace(with_crystal(40), follows_crystal=False)) == {}
    assert set(of_clocks(replace(with_crystal(40), follows_crystal=None))) == {"controller_and_crystal"}


def test_clocks_are_in_the_verdict() -> None:
    found = calibrate([recorded(with_crystal(500), 0.2)])
    checks = named(found.checks)
    assert {name for name, check in checks.items() if not check.passed} == {"controller_and_crystal"}
    assert found.clock is not None and len(found.clock.comparisons) == 1

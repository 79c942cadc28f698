"""A gyroscope that feels gravity feels the flange's circling as well: the arm knows how far out it sits."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rig.analysis.environment import find_environment
from rig.analysis.gyroscope.calibration import SensorResult, solve_observed
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import UnknownErrors, budget
from rig.observation.observed_run import observe_runs
from support.recordings.synthetic_run import Setup, synthetic_run, truth

pytestmark = pytest.mark.slow

SENSITIVE = ((5.1e-3, -1.5e-3, 1.2e-3), (1.8e-3, -4.5e-3, 1.5e-3), (-0.9e-3, 2.1e-3, 3.6e-3))  # rad/s/g, 0.3 °/s/g
FAST = Setup(speed_deg_s=120, noise_rad_s=3e-4, g_sensitivity_rad_s_per_g=SENSITIVE)
WITHOUT_RESTS = replace(FAST, rest_s=0)
AT_THE_END_OF_300_MM = replace(FAST, offset_m=(0.0, 0.0, 0.3))
KNOWN = UnknownErrors(
    clock_std=1e-6,
    clock_source="",
    state_jitter_s=0.0,
    axis_rad=0.0,
    sensor_offset_m=0.0,
    g_sensitivity_rad_s_per_g=float(np.radians(0.1)),
    earth_rate=False,
)
G_RAD_S = np.radians(0.1)  # for 1 g: of one standard deviation, as of usual parts


@cache
def solved(setup: Setup, extension_m: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> SensorResult:
    made = synthetic_run(setup)
    settings = replace(made.settings, extension_m=extension_m)
    recordings = observe_runs([replace(made, settings=settings)])
    return solve_observed(made.sensors, recordings, find_environment(recordings, settings))["gyro"]


def bias_off(setup: Setup, result: SensorResult) -> Array:
    """(3,) rad/s."""
    error: Array = result.bias_rad_s - truth(setup)[3:]
    return error


def std(result: SensorResult) -> Array:
    """(3,) rad/s, of the bias, all in all."""
    assert result.uncertainty is not None
    return result.uncertainty.std[3:]


def test_the_bias_is_free_of_what_the_flanges_circling_makes_the_sensor_feel() -> None:
    assert np.abs(bias_off(FAST, solved(FAST))).max() < 1e-5


def test_at_the_end_of_an_extension_it_circles_farther_out() -> None:
    there = solved(AT_THE_END_OF_300_MM, extension_m=(0.0, 0.0, 0.3))
    assert np.abs(bias_off(AT_THE_END_OF_300_MM, there)).max() < 1e-5
    assert np.abs(bias_off(AT_THE_END_OF_300_MM, solved(AT_THE_END_OF_300_MM))).max() > 3e-5


def test_where_attitudes_do_not_tell_the_sensitivity_the_circling_does_not_either_but_is_in_its_uncertainty() -> None:
    explained = solved(WITHOUT_RESTS).explained
    assert explained is not None and explained.solution.g_sensitivity is None
    standing_still = replace(explained, inputs=replace(explained.inputs, arms_m=None))
    more = [budget(each, KNOWN).std_of("g-sensitivity")[3:] ** 2 for each in (explained, standing_still)]
    assert (more[0] > more[1]).all()


@pytest.mark.thorough
@pytest.mark.proof
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("speed_deg_s", [60, 90, 120])
def test_the_bias_of_a_quiet_sensor_anywhere_on_the_flange_errs_by_what_is_stated(
    speed_deg_s: float, thorough: bool
) -> None:
    errors = np.array([_one(seed, speed_deg_s) for seed in range(1, 61 if thorough else 5)])
    rms, within = np.sqrt(np.mean(errors**2)), np.mean(np.abs(errors) < 2)
    print(f"{speed_deg_s}°/s: RMS {rms:.2f} u, {within:.1%} within U, largest {np.abs(errors).max():.1f} u")
    low, high = (0.8, 1.15) if thorough else (0.4, 1.6)
    assert low < rms < high
    assert within >= (0.92 if thorough else 0.7)


def _one(seed: int, speed_deg_s: float) -> Array:
    """(3,) errors of the bias over their standard uncertainties."""
    rng = np.random.default_rng([seed, round(speed_deg_s)])
    setup = Setup(
        seed=seed,
        speed_deg_s=speed_deg_s,
        noise_rad_s=0.002,
        g_sensitivity_rad_s_per_g=tuple(map(tuple, rng.normal(0, G_RAD_S, (3, 3)).tolist())),
        offset_m=tuple(rng.uniform(-0.05, 0.05, 3).tolist()),
    )
    result = solved(setup)
    return bias_off(setup, result) / std(result)

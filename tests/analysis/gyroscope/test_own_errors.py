"""What a data sheet says a gyroscope may do, a single speed does not tell: it puts neither scale nor bias beyond U."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.gyroscope.calibration import SensorResult
from rig.config.sensors.sensor_catalogue import PARTS
from rig.data.quantity import RATE, TEMPERATURE
from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.gyroscope.nonlinearity import SQUARE_DEVIATION
from rig.estimation.gyroscope.own_errors import SensorProperties, list_own_errors
from support.recordings.synthetic_run import Setup, synthetic_run

pytestmark = pytest.mark.slow

PER_RAD_S = PARTS["lsm9ds1"].nonlinearity_percent / 100 / np.radians(245)
SIX_AXES = (("axes", "6"),)
ODD = Setup(noise_rad_s=3e-4, odd_per_rad_s=PER_RAD_S, procedure=SIX_AXES)
EVEN = Setup(noise_rad_s=3e-4, even_per_rad_s=PER_RAD_S / SQUARE_DEVIATION)
SPEED_RAD_S = np.pi / 3


@cache
def solved(setup: Setup) -> SensorResult:
    return calibrate([synthetic_run(setup)]).results["gyro"]


def stated(result: SensorResult) -> Budget:
    assert result.uncertainty is not None
    return result.uncertainty


def scale_off(setup: Setup) -> Array:
    """(3,) over U, from what reads right at the speed of the sweeps."""
    result = solved(setup)
    truth = np.array(setup.scale) / (1 + setup.odd_per_rad_s * SPEED_RAD_S)
    off: Array = np.abs(result.scale - truth) / stated(result).expanded[:3]
    return off


def bias_off(setup: Setup) -> tuple[Array, Array]:
    """(3,) rad/s, and U."""
    result = solved(setup)
    return np.abs(result.bias_rad_s - setup.bias_rad_s), stated(result).expanded[3:]


@pytest.mark.thorough
def test_a_scale_found_about_oblique_axes_is_that_at_the_speed_of_the_sweeps() -> None:
    assert scale_off(ODD).max() < 1


def test_a_bias_is_that_at_rest_whatever_is_even_in_the_sensors_curve_which_is_no_wandering() -> None:
    (off, expanded), (_, expanded_straight) = bias_off(EVEN), bias_off(replace(EVEN, even_per_rad_s=0.0))
    assert (off < expanded).all()
    assert (expanded < 1.1 * expanded_straight).all()


def test_the_budget_names_what_the_data_sheet_states() -> None:
    known = [contributor for contributor in stated(solved(EVEN)).contributors if contributor.half_width is not None]
    lines = {each.name: f"{each.half_width:.4g} {each.unit}" for each in known}
    assert lines["nonlinearity"] == "0.1 % of full scale"
    assert lines["scale over temperature"] == "615.4 ppm/K"


@pytest.mark.thorough
def test_several_speeds_determine_the_nonlinearity_for_any_data_sheet() -> None:
    several = replace(ODD, procedure=(("speeds_deg_s", "[30, 60, 120]"),))
    assert "nonlinearity" not in {contributor.name for contributor in stated(solved(several)).contributors}


def test_a_bias_that_follows_the_recorded_temperature_is_that_at_the_mean_one() -> None:
    """So far from a ramp in time that a walk of the bias would not make much of it."""
    setup = Setup(noise_rad_s=3e-4)
    warmed = _warmed(synthetic_run(setup), 40, bias_rad_s_per_k=2e-3)
    found = stated(calibrate([warmed]).results["gyro"])
    unseen = stated(calibrate([_thermometer_broken(warmed)]).results["gyro"])
    assert found.std_of("bias instability")[3:].max() < 0.3 * unseen.std_of("bias instability")[3:].max()


@pytest.mark.parametrize("steps", [0, 1, 2, 3])
def test_a_bias_follows_a_temperature_of_few_steps_and_one_that_its_steps_hide(steps: int) -> None:
    """A pattern of each axis by what was recorded, and by half a step either way in the course of the run."""
    step_k, per_k, windows_s = 0.1, 6e-5, 10.0 * np.arange(8, dtype=np.float64)[:, None] + [0.0, 6.0]
    recorded_c = 22 + step_k * np.round(np.linspace(0, steps, 8))
    known = SensorProperties(0.0, 1.0, per_k, 0.0, 0.0, recorded_c, step_k)
    errors = list_own_errors(known, np.eye(3), np.ones((8, 3)), windows_s, ())
    (line,) = (error for error in errors if error.name == "bias over temperature")
    seen, hidden = line.patterns[:3], line.patterns[3:]
    for axis in range(3):
        np.testing.assert_allclose(seen[axis, :, axis], per_k * (recorded_c - recorded_c.mean()), atol=1e-15)
        np.testing.assert_allclose(hidden[axis, :, axis], per_k * step_k * np.linspace(-0.5, 0.5, 8), atol=1e-15)


def test_a_ramp_that_a_step_of_the_thermometer_hides_is_no_walk_of_the_bias() -> None:
    """By half a step either way, while the thermometer shows none."""
    setup = Setup(noise_rad_s=3e-4)
    per_k, part = 4e-3, "lsm9ds1"
    ramp = _ramping(synthetic_run(setup), per_k / 16)
    known = ramp.settings.uncertainty
    assert known is not None
    said_of = (known.model_copy(update={"bias_deg_s_k": {"gyro": said}}) for said in (PARTS[part].bias_deg_s_k, 0.0))
    found, without = (
        calibrate([replace(ramp, settings=replace(ramp.settings, uncertainty=each))]).results["gyro"]
        for each in said_of
    )
    assert (np.abs(found.bias_rad_s - setup.bias_rad_s) < stated(found).expanded[3:]).all()
    assert stated(found).std_of("bias over temperature")[3:].max() > 0
    instability = [stated(each).std_of("bias instability")[3:].max() for each in (found, without)]
    assert instability[0] < 0.8 * instability[1]


def _ramping(run: RunData, change_rad_s: float) -> RunData:
    """With a bias that changes evenly by so much from the first sample to the last."""
    samples = run.samples["gyro"].copy()
    count = run.sensors["gyro"].channel(RATE).unit_per_count
    samples["counts"] += np.round(change_rad_s / count * np.linspace(-0.5, 0.5, len(samples)))[:, None].astype(np.int16)
    return replace(run, samples={"gyro": samples})


def _warmed(run: RunData, steps: int, bias_rad_s_per_k: float) -> RunData:
    """By so many steps of its thermometer, up and down again, and what that does to the readings."""
    sensor, samples = run.sensors["gyro"], run.samples["gyro"].copy()
    wave = np.sin(2 * np.pi * np.linspace(0, 1.5, len(samples)))
    samples["temperature_counts"] += np.round(steps * (1 + wave) / 2).astype(np.int16)
    kelvin = steps * wave / 2 * sensor.channel(TEMPERATURE).unit_per_count
    samples["counts"] += np.round(bias_rad_s_per_k * kelvin / sensor.channel(RATE).unit_per_count).astype(np.int32)[
        :, None
    ]
    return replace(run, samples={"gyro": samples})


def _thermometer_broken(run: RunData) -> RunData:
    samples = run.samples["gyro"].copy()
    samples["temperature_counts"] = 0
    return replace(run, samples={"gyro": samples})

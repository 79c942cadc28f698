"""What a plan's attitudes are said to tell of the sensors in a file."""

from math import radians, sqrt

import pytest

from rig.analysis.design.attitude_information import AttitudeAccount, attitude_account
from rig.config.load import load
from rig.config.sensors.sensor_catalogue import PARTS
from rig.plans.phase import first_phase
from rig.plans.procedure_registry import load_procedures
from rig.world.world_section import read_world_section
from support.paths import CONFIGS, DEMO


def account(*overrides: str) -> AttitudeAccount:
    config = load(CONFIGS / "attitudes.yaml", overrides).config
    plan = first_phase(load_procedures()[config.procedure.name], config, load_procedures()).plan()
    found = attitude_account(config, plan)
    assert found is not None
    return found


@pytest.mark.slow
def test_repeats_average_the_noise_and_not_the_arms_error() -> None:
    judged = "limits.acceleration_verification_m_s2=1"
    exact = [account(f"procedure.repeats={n}", judged, "uncertainty.axis_deg=0").sensors["mpu9250"] for n in (1, 4)]
    assert exact[0].scale_std == pytest.approx(2 * exact[1].scale_std)
    assert exact[0].non_orthogonality_std_rad == pytest.approx(2 * exact[1].non_orthogonality_std_rad)
    faces = [judged, "procedure.attitudes=faces", "uncertainty.axis_deg=0.06"]
    real = [account(f"procedure.repeats={n}", *faces).sensors["adis16465"] for n in (1, 4)]
    assert real[0].scale_std == pytest.approx(2 * real[1].scale_std)
    assert real[0].non_orthogonality_std_rad == pytest.approx(real[1].non_orthogonality_std_rad, rel=0.01)


@pytest.mark.parametrize("name", ["imu.yaml", "icm42688p.yaml", "lsm6dsv16x.yaml", "own_port/kvh1775_drift.yaml"])
def test_the_noise_of_a_mean_is_that_of_the_simulated_samples(name: str) -> None:
    """White samples of a part as in its data sheet, averaged over a second."""
    loaded = load(CONFIGS / name)
    world = read_world_section(loaded)
    for sensor, section in loaded.config.to_calibrate.items():
        simulated = world.sensors[sensor].accelerometer
        walk_m_s2 = PARTS[section.part].velocity_random_walk_ug_sqrt_s * 9.80665e-6
        assert simulated.noise_m_s2 / sqrt(section.rate_hz) == pytest.approx(walk_m_s2, rel=0.03)


@pytest.mark.slow
def test_each_part_has_its_own_noise_and_a_longer_dwell_less_of_it() -> None:
    found = account("uncertainty.axis_deg=0").sensors
    longer = account("uncertainty.axis_deg=0", "procedure.dwell_s=12").sensors
    for name, density in (("lsm9ds1", 150), ("mpu9250", 300), ("adis16465", 23)):
        bias_ug = found[name].bias_std_m_s2 / 9.80665e-6
        assert bias_ug == pytest.approx(density / sqrt(2 * 3 * 18), rel=0.01)  # one-sided: a band of 1/(2 T)
        assert longer[name].bias_std_m_s2 == pytest.approx(found[name].bias_std_m_s2 / 2)


@pytest.mark.slow
def test_under_a_ceiling_the_attitudes_tell_as_much() -> None:
    floor, ceiling = account(), account("site.base_up=[0,0,-1]")
    assert ceiling.first.condition == pytest.approx(floor.first.condition)
    assert ceiling.sensors["mpu9250"].bias_std_m_s2 == pytest.approx(floor.sensors["mpu9250"].bias_std_m_s2)


@pytest.mark.slow
def test_what_the_configuration_states_of_the_arm_is_a_half_width() -> None:
    assert account("uncertainty.axis_deg=0.3").attitude_std_rad == pytest.approx(radians(0.3) / sqrt(3))


def test_sweeps_alone_have_none() -> None:
    config = load(DEMO).config
    plan = first_phase(load_procedures()["six_observation"], config, load_procedures()).plan()
    assert attitude_account(config, plan) is None

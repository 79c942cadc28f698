"""What stages and arcs do not calibrate is refused with its reason before anything is connected."""

import pytest

from rig.config.load import load
from rig.errors import Refused
from support.paths import CONFIGS

STAGES = "stages=[{instruction: as it is}, {instruction: turned, mount: {x: +y, y: -x, z: +z}}]"


def refused(*overrides: str) -> str:
    with pytest.raises(Refused) as found:
        load(CONFIGS / "demo.yaml", overrides)
    return str(found.value)


MAGNETOMETER = "magnetometers={compass: {part: lsm9ds1_magnetometer, serial_number: LSM9DS1-003}}"


def test_a_verification_has_one_mounting() -> None:
    assert "procedure.verify repeats one movement with one mounting, but stages have several" in refused(
        "procedure.verify=true", f"procedure.{STAGES}"
    )
    assert "stages belong to six_observation and servo_six_observation" in refused(
        "procedure.name=verify", f"procedure.{STAGES}"
    )


@pytest.mark.parametrize("name", ["imu", "static_attitudes", "bias_drift"])
def test_accelerometers_are_calibrated_in_one_mounting(name: str) -> None:
    said = refused(f"procedure={{name: {name}}}", f"procedure.{STAGES}")
    assert "accelerometers and magnetometers are turned against gravity and field in one mounting" in said
    assert "unknown key" not in said


@pytest.mark.parametrize("beyond", [STAGES, "arc_deg=180"])
def test_a_magnetometer_needs_attitudes_in_one_mounting(beyond: str) -> None:
    said = refused("uncertainty.angle_std_deg=0.02", MAGNETOMETER, f"procedure.{beyond}")
    assert "magnetometers.compass cannot be calibrated with procedure." in said


def test_an_accelerometer_that_only_looks_where_up_is_goes_with_stages_and_arcs() -> None:
    found = load(CONFIGS / "demo.yaml", [f"procedure.{STAGES}", "sensors.gyro.acceleration={}"])
    assert found.config.sensors["gyro"].acceleration is not None
    arcs = ["uncertainty.angle_std_deg=0.02", "procedure.arc_deg=180", "sensors.gyro.acceleration={}"]
    assert load(CONFIGS / "demo.yaml", arcs).config.procedure.name == "six_observation"


def test_an_accelerometer_cannot_be_calibrated_from_arcs() -> None:
    assert "cannot be used with imu" in refused(
        "procedure={name: imu, arc_deg: 180}", "uncertainty.angle_std_deg=0.02", "sensors.gyro.acceleration={}"
    )

"""The `magnetometers:` section: what the part has, what fits together, and what is wrong is told by its place."""

import pytest

from rig.config.load import ConfigurationRefused, Loaded, parse
from support.paths import CONFIGS

DEMO = (CONFIGS / "demo.yaml").read_text(encoding="utf-8")
COMPASS = "magnetometers={compass: {part: lsm9ds1_magnetometer, serial_number: M1}}"
TRUTH = "world.magnetometers={compass: {}}"


def loaded(*overrides: str) -> Loaded:
    return parse(DEMO, "demo.yaml", overrides)


def problems_of(*overrides: str) -> tuple[str, ...]:
    with pytest.raises(ConfigurationRefused) as caught:
        loaded(*overrides)
    return caught.value.problems


def test_left_out_it_converts_as_fast_as_it_can_in_its_narrowest_range() -> None:
    (compass,) = loaded(COMPASS, TRUTH).config.magnetometers.values()
    assert (compass.rate_hz, compass.range_gauss) == (80, 4)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("rate_hz", "100", "not available; the nearest is 80; allowed: 5, 10, 20, 40, 80"),
        ("range_gauss", "5", "not available; the nearest is 4; allowed: 4, 8, 12, 16"),
        ("part", "lsm9ds1", "allowed: lsm9ds1_magnetometer"),
        ("serial_number", "''", "1 to 24 plain ASCII characters"),
        ("range_deg_s", "245", "unknown key"),
        ("mounting", "{x: +x, y: +y, z: -z}", "right-handed"),
    ],
)
def test_what_the_part_does_not_have_is_refused_by_its_key(key: str, value: str, said: str) -> None:
    (problem,) = problems_of(COMPASS, TRUTH, f"magnetometers.compass.{key}={value}")
    assert problem.startswith(f"magnetometers.compass.{key}" if key != "mounting" else "magnetometers.compass.mounting")
    assert said in problem


def test_a_name_is_one_sensors() -> None:
    (problem,) = problems_of(COMPASS.replace("compass", "gyro"), TRUTH.replace("compass", "gyro"))
    assert problem.startswith("magnetometers") and "gyro is the name of one of the sensors already" in problem


def test_the_magnetometer_of_a_kvh_has_a_name_too() -> None:
    kvh = (CONFIGS / "own_port" / "kvh1775.yaml").read_text(encoding="utf-8")
    taken = "sensors.kvh_field={part: adis16465, serial_number: A1}"
    told = "world.sensors.kvh_field={scale: [1, 1, 1], bias_rad_s: [0, 0, 0]}"
    board = "board.port=socket://127.0.0.8:7321"
    parse(kvh, "kvh.yaml", [taken, told, board])
    with pytest.raises(
        ConfigurationRefused, match="kvh_field is already the name of a sensor at another sensor's port"
    ):
        parse(kvh, "kvh.yaml", [taken, told, board, "sensors.kvh.serial.message=C"])


def test_the_link_has_to_carry_it_too() -> None:
    """A gyroscope's rate that just fits alone."""
    fast = (
        "board.baud=230400",
        "sensors.gyro={part: adis16465, serial_number: A, rate_hz: 1000, range_deg_s: 500}",
    )
    loaded(*fast)
    (problem,) = problems_of(*fast, COMPASS, TRUTH)
    assert problem.startswith("magnetometers (--set): the serial link cannot carry")
    assert "compass 80 Hz × 13." in problem


def test_it_stands_in_the_world_as_well() -> None:
    (problem,) = problems_of(COMPASS)
    assert problem == (
        "world.magnetometers.compass: missing; every sensor has a section both in magnetometers and in "
        "world.magnetometers"
    )


def test_a_rig_needs_a_gyroscope() -> None:
    problems = problems_of(COMPASS, TRUTH, "sensors={}", "world.sensors={}")
    assert problems[0].startswith("sensors")

"""Configuration files: what is accepted, and how everything wrong is said at once."""

from pathlib import Path

import pytest
import yaml

from rig.config import ranges
from rig.config.load import ConfigurationRefused, load, parse
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.config.sensors.sensor_sections import SensorSection
from rig.turners.turner_registry import sections
from rig.world.world_section import read_world_section
from support.paths import CONFIGS


def problems_of(text: str, *overrides: str) -> tuple[str, ...]:
    with pytest.raises(ConfigurationRefused) as caught:
        parse(text, "test.yaml", overrides)
    assert caught.value.exit_status == 2
    return caught.value.problems


def demo_text(**changes: object) -> str:
    document = yaml.safe_load((CONFIGS / "demo.yaml").read_text(encoding="utf-8"))
    return yaml.safe_dump(document | changes, sort_keys=False)


@pytest.mark.parametrize("path", sorted(CONFIGS.rglob("*.yaml")), ids=lambda path: path.name)
def test_every_shipped_configuration_is_valid(path: Path) -> None:
    load(path)


def test_hardware_differs_from_the_demonstration_in_two_lines_and_the_world() -> None:
    demo = yaml.safe_load((CONFIGS / "demo.yaml").read_text(encoding="utf-8"))
    hardware = yaml.safe_load(load(CONFIGS / "ur10e_lsm9ds1.yaml").text)
    del demo["world"]
    hardware["arm"]["host"] = demo["arm"]["host"]
    hardware["board"]["port"] = demo["board"]["port"]
    assert hardware == demo


def test_all_errors_are_reported_at_once_with_path_line_and_remedy() -> None:
    text = """\
arm: {host: 127.0.0.2, payload_kg: 40}
board:
  port: socket://127.0.0.2:7321
  baud: 9600
sensors:
  gyro: {part: lsm9ds1, serial_number: a, rate_hz: 200, rnge_deg_s: 3}
procedure: {sped_deg_s: 60, order: [wirst_3, wrist_1, wrist_2]}
limits: {scale_std: .nan, scale_deviation: 1, bias_rad_s: 1, condition: 9}
wrold: {}
"""
    found = problems_of(text)
    expected = [
        "arm.payload_kg (line 1): 40: input should be less than or equal to 30",
        "board.baud (line 4): 9600 is not allowed, did you mean 921600?; allowed: 115200, 230400, 460800, 921600",
        "sensors.gyro.rate_hz (line 6): 200: not available; the nearest is 238; allowed: 14.9, 59.5,",
        "sensors.gyro.rnge_deg_s (line 6): unknown key, did you mean range_deg_s?",
        "procedure.order.0: 'wirst_3' is not allowed, did you mean wrist_3?; allowed: wrist_1, wrist_2, wrist_3",
        "procedure.sped_deg_s (line 7): unknown key, did you mean speed_deg_s?",
        "limits.scale_std (line 8): nan: input should be a finite number",
        "limits.bias_std_rad_s: missing",
        "wrold (line 9): unknown key, did you mean world?",
    ]
    for wanted in expected:
        assert any(problem.startswith(wanted) for problem in found), f"{wanted!r} is not among {found}"
    assert len(found) == len(expected)


def test_a_key_given_twice_is_refused() -> None:
    assert "rest_s: given twice, on lines 1 and 2" in problems_of("rest_s: 1\nrest_s: 2\n")[0]


def sensors(**sections: str) -> list[str]:
    """Overrides that give the demonstration these sensors, in the rig and in its world."""
    truth = "{scale: [1, 1, 1], bias_rad_s: [0, 0, 0]}"
    return [
        f"sensors={{{', '.join(f'{name}: {{{numbered(section)}}}' for name, section in sections.items())}}}",
        f"world.sensors={{{', '.join(f'{name}: {truth}' for name in sections)}}}",
    ]


def numbered(section: str) -> str:
    return section if "serial_number" in section else f"serial_number: a, {section}"


@pytest.mark.parametrize(
    ("part", "rate_hz", "range_deg_s"), [("lsm9ds1", 238, 245), ("mpu9250", 200, 250), ("adis16465", 200, 500)]
)
def test_a_part_has_its_usual_rate_and_range_unless_the_file_says_otherwise(
    part: str, rate_hz: float, range_deg_s: float
) -> None:
    sensor = parse(demo_text(), overrides=sensors(gyro=f"part: {part}")).config.sensors["gyro"]
    assert (sensor.rate_hz, sensor.range_deg_s) == (rate_hz, range_deg_s)


def test_a_rate_may_be_rounded_as_people_write_it() -> None:
    config = parse(demo_text(), overrides=sensors(gyro="part: mpu9250, rate_hz: 333.33, range_deg_s: 1000")).config
    assert config.sensors["gyro"].rate_hz == 1000 / 3


@pytest.mark.parametrize(
    ("section", "problem"),
    [
        ("part: lsm9ds1, rate_hz: 200", "sensors.gyro.rate_hz: 200: not available; the nearest is 238; allowed: 14.9,"),
        (
            "part: mpu9250, rate_hz: 300",
            "sensors.gyro.rate_hz: 300: not available; the nearest is 333.333; allowed: 10",
        ),
        (
            "part: adis16465, rate_hz: 238",
            "sensors.gyro.rate_hz: 238: not available; the nearest is 250; allowed: 2000/",
        ),
        ("part: mpu9250, rate_hz: 8000", "sensors.gyro.rate_hz: 8000: not available; the nearest is 1000;"),
        ("part: adis16465, range_deg_s: 245", "sensors.gyro.range_deg_s: 245: not available; the nearest is 125;"),
        ("part: mpu9250, range_deg_s: 245", "sensors.gyro.range_deg_s: 245: not available; the nearest is 250;"),
        ("part: mpu6050, rate_hz: 7", "sensors.gyro.part: 'mpu6050' is not allowed, did you mean mpu9250?"),
        (
            "part: lsm9ds1, turntable: {}",
            "sensors.gyro.turntable: only a sensor with role: reference has a calibration",
        ),
        ("part: lsm9ds1, serial_number: Größe", "sensors.gyro.serial_number: 'Größe': must be 1 to 24 plain ASCII"),
        ("part: lsm9ds1, role: reference", "sensors: at least one sensor must have role: calibrate"),
    ],
)
def test_what_a_part_cannot_do_is_refused_with_the_nearest_it_can(section: str, problem: str) -> None:
    (found,) = problems_of(demo_text(), *sensors(gyro=section))
    assert found.replace(" (--set)", "").startswith(problem)


def test_a_reference_brings_its_own_calibration() -> None:
    config = parse(
        demo_text(),
        overrides=sensors(
            gyro="part: mpu9250", reference="part: adis16465, role: reference, turntable: {scale: [1.003, 0.997, 1]}"
        ),
    ).config
    assert list(config.to_calibrate) == ["gyro"] and config.reference is not None
    name, reference = config.reference
    assert name == "reference" and reference.turntable.scale == (1.003, 0.997, 1)
    assert reference.turntable.bias_rad_s == (0, 0, 0)
    assert parse(demo_text()).config.reference is None


@pytest.mark.parametrize(
    ("sections", "problem"),
    [
        (
            {"a": "part: mpu9250", "b": "part: mpu9250"},
            "a and b are both mpu9250; the board has one place for each part",
        ),
        (
            {f"r{part}": f"part: {part}, role: reference" for part in ("adis16465", "mpu9250")}
            | {"g": "part: lsm9ds1"},
            "radis16465 and rmpu9250 have role: reference; at most one sensor can",
        ),
    ],
)
def test_sensors_that_do_not_fit_together_are_refused(sections: dict[str, str], problem: str) -> None:
    (found,) = problems_of(demo_text(), *sensors(**sections))
    assert found.startswith("sensors (--set)") and found.endswith(problem), found


ALL_AT_FULL_RATE = {
    "one": "part: lsm9ds1, rate_hz: 952",
    "two": "part: mpu9250, rate_hz: 1000",
    "three": "part: adis16465, rate_hz: 1000, role: reference",
}


def test_rates_the_serial_link_cannot_carry_are_refused_with_the_arithmetic() -> None:
    (found,) = problems_of(demo_text(), *sensors(**ALL_AT_FULL_RATE), "board.baud=460800")
    # Of a frame's 27 bytes around its samples, 12 calibrated ones of 18 bytes each have a share, or 18 raw ones of 12.
    assert "one 952 Hz × 20.2 bytes + two 1000 Hz × 20.2 bytes + three 1000 Hz × 13.5 bytes = 53028 bytes/s" in found
    assert "board.baud 460800 / 10 bits a byte less 10% kept free = 41472 bytes/s" in found
    assert "lower rate_hz or raise board.baud" in found


def test_the_usual_link_carries_all_three_sensors_at_full_rate() -> None:
    assert len(parse(demo_text(), overrides=sensors(**ALL_AT_FULL_RATE)).config.sensors) == 3


def test_a_verification_needs_a_reference() -> None:
    (found,) = problems_of(demo_text(), "procedure.verify=true")
    assert "role: reference" in found


@pytest.mark.parametrize("text", ["", "- a\n", "a: [1\n", "{a: 1", "a: !!python/object:os.system 1\n"])
def test_text_that_is_no_configuration_is_refused_without_a_traceback(text: str) -> None:
    assert problems_of(text)


def test_a_missing_file_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationRefused, match=r"nothing\.yaml"):
        load(tmp_path / "nothing.yaml")


def test_overrides_change_values_and_the_text_that_is_kept() -> None:
    loaded = parse(demo_text(), overrides=["procedure.rest_s=1.5", "world.seed=9"])
    assert isinstance(loaded.config.procedure, SixObservationSection) and loaded.config.procedure.rest_s == 1.5
    assert read_world_section(loaded).seed == 9
    assert parse(loaded.text).config == loaded.config


def test_overrides_that_cannot_be_applied_are_named() -> None:
    found = problems_of(demo_text(), "procedure", "arm.host.name=3", "procedure.rest_z=3")
    assert found[0].startswith("--set procedure: must be path=value")
    assert found[1].startswith("--set arm.host.name=3: host is not a section")
    assert found[2].startswith("procedure.rest_z (--set): unknown key, did you mean rest_s?")


def test_the_recorded_text_holds_no_simulated_truth() -> None:
    loaded = load(CONFIGS / "demo.yaml")
    assert "world" not in yaml.safe_load(loaded.rig_text)
    assert parse(loaded.rig_text).config == loaded.config


def test_a_world_never_drives_a_real_robot() -> None:
    found = problems_of(demo_text(), "arm.host=192.168.1.102", "board.port=/dev/ttyACM0")
    assert found[0].startswith("arm.host: '192.168.1.102' must be a loopback address")
    assert found[1].startswith("board.port: '/dev/ttyACM0' must be socket://")


def test_a_sensor_must_stand_in_the_world_too() -> None:
    found = problems_of(demo_text(), "world.sensors={other: {scale: [1, 1, 1], bias_rad_s: [0, 0, 0]}}")
    assert [problem.split(":")[0] for problem in found] == ["world.sensors.gyro", "sensors.other"]


@pytest.mark.parametrize(
    ("override", "path"),
    [
        ("procedure.order=[wrist_3, wrist_3, wrist_2]", "procedure"),
        ("procedure.directions=[cw]", "procedure"),
        ("sensors.gyro.mounting.x=-x", "sensors.gyro.mounting"),
        ("procedure.speed_deg_s=170", "procedure.speed_deg_s 170 is too fast"),
        ("procedure.speed_deg_s=0.2", "procedure.speed_deg_s"),
        ("arm.host=[]", "arm.host"),
    ],
)
def test_values_that_cannot_calibrate_are_refused_before_anything_moves(override: str, path: str) -> None:
    (problem,) = problems_of(demo_text(), override)
    assert problem.startswith(path)


def test_what_is_wrong_with_the_world_is_told_with_the_rest() -> None:
    found = problems_of(demo_text(), "arm.payload_kg=31", "world.sensors.gyro.scale=3", "world.seeed=1")
    assert [problem.split(":")[0].split(" ")[0] for problem in found] == [
        "arm.payload_kg",
        "world.sensors.gyro.scale",
        "world.seeed",
    ]


@pytest.mark.parametrize(
    ("key", "limit"),
    [
        ("arm.payload_kg", ranges.PAYLOAD_RANGE_KG),
        ("procedure.acceleration_deg_s2", ranges.ACCELERATION_RANGE_DEG_S2),
        ("arm.transfer_speed_deg_s", ranges.SPEED_RANGE_DEG_S),
        ("arm.home_deg", ranges.JOINT_RANGE_DEG),
    ],
)
def test_values_of_an_arm_range_as_far_as_any_arms(key: str, limit: float) -> None:
    def value(number: float) -> str:
        return f"{key}=[{number}, 0, 0, 0, -90, 0]" if key == "arm.home_deg" else f"{key}={number}"

    parse(demo_text(), overrides=[value(limit)])
    (found,) = problems_of(demo_text(), value(limit * 1.001))
    assert found.startswith(key) and f"less than or equal to {limit:g}" in found


def test_a_data_rate_is_a_number_even_where_it_was_left_out() -> None:
    assert all(SensorSection.model_fields[key].annotation is float for key in ("rate_hz", "range_deg_s"))
    assert all(SensorSection.model_fields[key].is_required() for key in ("rate_hz", "range_deg_s"))


@pytest.mark.parametrize("written", ["0017", "20230017", "0x1F", "1_000", "2026-11-20", "12:30", "yes", "-7", "3.50"])
@pytest.mark.parametrize("by_override", [False, True])
def test_a_serial_number_is_what_was_written(written: str, by_override: bool) -> None:
    text = demo_text()
    if by_override:
        loaded = parse(text, overrides=[f"sensors.gyro.serial_number={written}"])
    else:
        loaded = parse(text.replace("serial_number: LSM9DS1-001", f"serial_number: {written}"))
    assert loaded.config.sensors["gyro"].serial_number == written
    assert parse(loaded.text).config == loaded.config, "what is kept says the same"


def test_a_value_that_was_given_by_an_override_is_refused_as_that() -> None:
    with pytest.raises(ConfigurationRefused) as caught:
        parse(demo_text(), overrides=["procedure.speed_deg_s=fast", "arm.home_deg=1", "sensors.lsm9ds1.role=calibrate"])
    for section in ("sensors=3", "sensors.gyro=lsm9ds1"):
        assert "must be a section" in problems_of(demo_text(), section)[0]
    told = str(caught.value)
    assert "procedure.speed_deg_s (--set): 'fast': must be a number" in told
    assert "arm.home_deg (--set): 1: must be a list in brackets" in told
    assert "sensors.lsm9ds1.part: missing; sensors.lsm9ds1 comes from --set alone; the file has gyro" in told
    assert "Correct the command line" in told


@pytest.mark.parametrize(
    ("name", "told"),
    [("mine.py", "a Python script"), ("run.h5", "a recording"), ("samples.csv", "a table of readings")],
)
def test_another_file_given_for_a_configuration_is_named_as_what_it_is(tmp_path: Path, name: str, told: str) -> None:
    (tmp_path / name).write_bytes(b"\x89HDF" * 50_000)
    with pytest.raises(ConfigurationRefused, match=told):
        load(tmp_path / name)


@pytest.mark.parametrize(
    "key", ["limits.scale_std", "procedure.rest_s", "sensors.gyro.rate_hz", "world.arm.vibration_hz"]
)
def test_yes_and_on_are_no_numbers(key: str) -> None:
    (found,) = problems_of(demo_text(), f"{key}=on")
    assert key in found and "must be a number; YAML reads yes, no, on and off as true and false" in found


def test_an_unknown_key_in_a_list_of_sections_is_named_with_its_place(tmp_path: Path) -> None:
    text = (CONFIGS / "servo.yaml").read_text(encoding="utf-8").replace("{rotation_deg: [0.6", "{turned: [0.6")
    (tmp_path / "servo.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationRefused, match=r"world\.mounts\.2\.turned \(line \d+\): unknown key.*rotation_deg"):
        load(tmp_path / "servo.yaml", turners=sections())

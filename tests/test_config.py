"""Configuration files: what is accepted, and how everything wrong is said at once."""

from pathlib import Path

import pytest
import yaml

from rig.config.load import ConfigurationRefused, load, parse

CONFIGS = Path(__file__).parent.parent / "configs"


def problems_of(text: str, *overrides: str) -> tuple[str, ...]:
    with pytest.raises(ConfigurationRefused) as caught:
        parse(text, "test.yaml", overrides)
    assert caught.value.exit_status == 2
    return caught.value.problems


def demo_text(**changes: object) -> str:
    document = yaml.safe_load((CONFIGS / "demo.yaml").read_text(encoding="utf-8"))
    return yaml.safe_dump(document | changes, sort_keys=False)


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.yaml")), ids=lambda path: path.name)
def test_every_shipped_configuration_is_valid(path: Path) -> None:
    load(path)


def test_hardware_differs_from_the_demonstration_in_two_lines_and_the_world() -> None:
    demo = yaml.safe_load((CONFIGS / "demo.yaml").read_text(encoding="utf-8"))
    hardware = yaml.safe_load((CONFIGS / "ur10e_lsm9ds1.yaml").read_text(encoding="utf-8"))
    del demo["world"]
    hardware["arm"]["host"] = demo["arm"]["host"]
    hardware["board"]["port"] = demo["board"]["port"]
    assert hardware == demo


def test_all_errors_are_reported_at_once_with_path_line_and_remedy() -> None:
    text = """\
arm: {host: 127.0.0.2, payload_kg: 20}
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
        "arm.payload_kg (line 1): 20: input should be less than or equal to 12.5",
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


@pytest.mark.parametrize("text", ["", "- a\n", "a: [1\n", "{a: 1", "a: !!python/object:os.system 1\n"])
def test_text_that_is_no_configuration_is_refused_without_a_traceback(text: str) -> None:
    assert problems_of(text)


def test_a_missing_file_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationRefused, match=r"nothing\.yaml"):
        load(tmp_path / "nothing.yaml")


def test_overrides_change_values_and_the_text_that_is_kept() -> None:
    loaded = parse(demo_text(), overrides=["procedure.rest_s=1.5", "world.seed=9"])
    assert loaded.config.procedure.rest_s == 1.5
    assert loaded.world is not None and loaded.world.seed == 9
    assert parse(loaded.text).config == loaded.config


def test_overrides_that_cannot_be_applied_are_named() -> None:
    found = problems_of(demo_text(), "procedure", "arm.host.name=3", "procedure.rest_z=3")
    assert found[0].startswith("--set procedure: must be path=value")
    assert found[1].startswith("--set arm.host.name=3: host is not a section")
    assert found[2].startswith("procedure.rest_z: unknown key, did you mean rest_s?")


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
        ("procedure.speed_deg_s=170", "(file)"),
        ("arm.host=[]", "arm.host"),
    ],
)
def test_values_that_cannot_calibrate_are_refused_before_anything_moves(override: str, path: str) -> None:
    (problem,) = problems_of(demo_text(), override)
    assert problem.startswith(path)

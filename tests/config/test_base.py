"""Configurations build on one another: a repeat calibration says only what differs."""

import shutil
from pathlib import Path

import pytest
import yaml

from rig.config.files.layers import MAX_FILES, merge
from rig.config.load import ConfigurationRefused, load, parse
from rig.data.run_folder import ScriptIdentity, new_folder
from rig.world.world_section import read_world_section
from support.paths import CONFIGS, DEMO


def problems_of(path: Path, *overrides: str) -> tuple[str, ...]:
    with pytest.raises(ConfigurationRefused) as caught:
        load(path, overrides)
    return caught.value.problems


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the demonstration in a folder below it."""
    (tmp_path / "stock").mkdir()
    shutil.copy(DEMO, tmp_path / "stock")
    return tmp_path


def written(folder: Path, text: str, name: str = "mine.yaml") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_sections_merge_key_by_key_and_lists_whole() -> None:
    base = {"a": {"b": 1, "c": {"d": [1, 2], "e": 2}}, "f": [1], "g": 3}
    over = {"a": {"c": {"d": [3]}, "h": 4}, "f": 5, "i": {"j": 6}}
    assert merge(base, over) == {"a": {"b": 1, "c": {"d": [3], "e": 2}, "h": 4}, "f": 5, "g": 3, "i": {"j": 6}}
    assert base["a"] == {"b": 1, "c": {"d": [1, 2], "e": 2}}, "the base stays as it was"


def test_null_leaves_out_what_the_base_says_and_nothing_else() -> None:
    assert merge({"a": {"b": 1, "c": 2}, "d": 3}, {"a": {"b": None}, "d": None, "e": None}) == {
        "a": {"c": 2},
        "e": None,
    }


def test_a_repeat_calibration_takes_five_lines(folder: Path) -> None:
    path = CONFIGS / "repeat_lsm9ds1.yaml"
    schema, *lines = path.read_text(encoding="utf-8").splitlines()
    assert schema.startswith("# yaml-language-server") and len(lines) == 5
    repeat, demo = load(path), load(DEMO)
    assert not repeat.simulated
    assert repeat.config.sensors["gyro"].serial_number == "LSM9DS1-002"
    assert repeat.config.limits == demo.config.limits
    assert repeat.config.arm.home_deg == demo.config.arm.home_deg


def test_the_path_is_relative_to_the_file_that_names_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "below").mkdir()
    path = written(folder / "below", "base: ../stock/demo.yaml\nprocedure: {rest_s: 7}\n")
    monkeypatch.chdir("/")
    loaded = load(path)
    assert loaded.config.procedure == load(DEMO, ["procedure.rest_s=7"]).config.procedure
    assert read_world_section(loaded) == read_world_section(load(DEMO))
    assert load(written(folder, f"base: {folder / 'stock' / 'demo.yaml'}\n")).config == load(DEMO).config


def test_the_text_as_used_stands_alone(folder: Path) -> None:
    """A run folder may be resumed where its base is not."""
    loaded = load(written(folder, "base: stock/demo.yaml\nprocedure: {rest_s: 7}\n"), ["world.seed=5"])
    kept = new_folder(folder / "run", loaded, "", ScriptIdentity("", "")) / "config.yaml"
    shutil.rmtree(folder / "stock")
    again = load(kept)
    assert "base" not in yaml.safe_load(kept.read_text(encoding="utf-8"))
    assert again.config == loaded.config and read_world_section(again).seed == 5
    assert parse(loaded.rig_text).config == loaded.config


def test_a_file_that_builds_on_none_is_kept_word_for_word(folder: Path) -> None:
    assert load(DEMO).text == DEMO.read_text(encoding="utf-8")


def test_errors_name_the_file_and_the_line_they_came_from(folder: Path) -> None:
    text = (
        DEMO.read_text(encoding="utf-8").replace("payload_kg: 0.35", "payload_kg: 99").replace("rest_s: 3", "rest: 3")
    )
    written(folder, text, "broken.yaml")
    path = written(folder, "base: broken.yaml\nboard:\n  baud: 9600\nlimits: {condition: -1}\n")
    found = problems_of(path)
    assert found[0] == "arm.payload_kg (broken.yaml, line 5): 99: input should be less than or equal to 30"
    assert found[1].startswith("board.baud (line 3): 9600 is not allowed, did you mean 921600?")
    assert found[2] == "limits.condition (line 4): -1: input should be greater than 0"
    assert found[3].startswith("procedure.rest (broken.yaml, line 26): unknown key, did you mean rest_s?")
    assert len(found) == 4


def test_what_a_file_replaces_cannot_be_wrong(folder: Path) -> None:
    written(folder, DEMO.read_text(encoding="utf-8").replace("payload_kg: 0.35", "payload_kg: 99"), "broken.yaml")
    load(written(folder, "base: broken.yaml\narm: {payload_kg: 1}\n"))


def test_a_key_given_twice_in_a_base_is_refused(folder: Path) -> None:
    written(folder, DEMO.read_text(encoding="utf-8") + "output: {folder: x}\n", "twice.yaml")
    assert problems_of(written(folder, "base: twice.yaml\n"))[0].startswith("twice.yaml: output: given twice, on lines")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("base: demo.yml\n", "base (line 1): demo.yml cannot be read: No such file or directory"),
        ("base: mine.yaml\n", "base (line 1): the files build on one another in a circle: this file → mine.yaml"),
        ("base: stock/../mine.yaml\n", "base (line 1): the files build on one another in a circle: this file → stock/"),
        ("base: stock\n", "base (line 1): stock cannot be read: it is not a regular file"),
        ("base: 3\n", "base (line 1): 3: must be the name of a file"),
        ("base: null\n", "base (line 1): None: must be the name of a file"),
        ("base: [a, b]\n", "base (line 1): ['a', 'b']: must be the name of a file"),
        (f"base: {'x' * 5000}\n", "base (line 1): xxxxx"),
        ("base: bad.yaml\n", "bad.yaml: line 2: while parsing"),
        ("base: list.yaml\n", "list.yaml: the file must be a mapping"),
    ],
)
def test_a_base_that_cannot_be_had_is_refused_by_name(text: str, why: str, folder: Path) -> None:
    written(folder, "a: [1\n", "bad.yaml")
    written(folder, "- a\n", "list.yaml")
    (found,) = problems_of(written(folder, text))
    assert found.startswith(why) and len(found) < 300


def test_a_circle_through_another_file_is_refused(folder: Path) -> None:
    written(folder, "base: mine.yaml\n", "other.yaml")
    (found,) = problems_of(written(folder, "base: other.yaml\n"))
    assert found.endswith("in a circle: this file → other.yaml → mine.yaml")


def test_a_chain_that_is_too_long_is_refused(folder: Path) -> None:
    for number in range(MAX_FILES):
        written(folder, f"base: {number + 1}.yaml\n", f"{number}.yaml")
    shutil.copy(DEMO, folder / f"{MAX_FILES}.yaml")
    (found,) = problems_of(folder / "0.yaml")
    assert f"more than {MAX_FILES} files one on another" in found
    load(folder / "1.yaml")


def test_text_without_a_file_builds_on_none() -> None:
    with pytest.raises(ConfigurationRefused) as caught:
        parse("base: demo.yaml\n")
    assert caught.value.problems == ("base (line 1): only a file can build on another",)


def test_a_misspelt_base_is_recognised(folder: Path) -> None:
    assert any("bse (line 1): unknown key, did you mean base?" in it for it in problems_of(written(folder, "bse: x\n")))


def test_an_override_of_null_leaves_out_too() -> None:
    loaded = load(DEMO, ["world=null", "arm.host=10.0.0.2", "sensors.gyro.range_deg_s=null"])
    assert not loaded.simulated and loaded.config.sensors["gyro"].range_deg_s == 245
    with pytest.raises(ConfigurationRefused, match=r"limits\.condition \(--set\): missing"):
        load(DEMO, ["limits.condition=null"])


def test_an_override_changes_one_place_where_an_alias_stands_in_two() -> None:
    text = "_: &m {x: +x, y: +y, z: +z}\n" + DEMO.read_text(encoding="utf-8").replace("{x: +x, y: +y, z: +z}", "*m")
    loaded = parse(text, overrides=["sensors.gyro.mounting.x=+y", "sensors.gyro.mounting.y=-x", "_=null"])
    assert loaded.config.sensors["gyro"].mounting.x == "+y"


def test_the_world_s_truth_stays_text_in_the_rig() -> None:
    loaded = load(DEMO, ["world.board.flash_file=flash.bin"])
    assert loaded.simulated and loaded.flash_file == Path("flash.bin")
    assert not any("World" in type(getattr(loaded, name)).__name__ for name in loaded.__slots__)
    assert load(DEMO).flash_file is None

"""The schema for editors is what the models say, and every supplied configuration names it and satisfies it."""

from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from rig.config.config_schema import config_schema, schema_text
from rig.config.procedures.attitude_sets import ATTITUDE_SETS
from support.paths import CONFIGS, DOCS

PAGE = DOCS / "config.schema.json"


@cache
def validator() -> Draft202012Validator:
    return Draft202012Validator(config_schema())


def read(path: Path) -> dict[str, Any]:
    document: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return document


@pytest.mark.slow
def test_the_page_is_today_s() -> None:
    assert PAGE.read_text(encoding="utf-8") == schema_text(), (
        "again: python -m rig.config.config_schema > docs/config.schema.json"
    )
    Draft202012Validator.check_schema(config_schema())


@pytest.mark.parametrize("path", sorted(CONFIGS.rglob("*.yaml")), ids=lambda path: path.stem)
def test_every_supplied_configuration_names_the_schema_and_satisfies_it(path: Path) -> None:
    first = path.read_text(encoding="utf-8").splitlines()[0]
    marker, _, named = first.partition("$schema=")
    assert marker == "# yaml-language-server: " and (path.parent / named).resolve() == PAGE
    assert not [(list(error.path), error.message) for error in validator().iter_errors(read(path))]


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("borad",), {"port": "COM3"}),
        (("procedure", "sped_deg_s"), 30),
        (("procedure", "speed_deg_s"), -5),
        (("sensors", "gyro", "part"), "lsm9ds2"),
        (("arm", "payload_kg"), "heavy"),
        (("world", "sensors", "gyro", "noise"), 0.1),
    ],
)
def test_what_an_editor_marks(place: tuple[str, ...], value: object) -> None:
    document = read(CONFIGS / "demo.yaml")
    section = document
    for key in place[:-1]:
        section = section[key]
    section[place[-1]] = value
    (error,) = validator().iter_errors(document)
    assert list(error.path) == list(place)


def test_each_set_of_attitudes_is_a_word_of_the_schema() -> None:
    for name in ATTITUDE_SETS:
        assert validator().is_valid({"procedure": {"name": "static_attitudes", "attitudes": name}})
    assert not validator().is_valid({"procedure": {"name": "static_attitudes", "attitudes": "nineteen"}})

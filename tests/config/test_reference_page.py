"""The page about the configuration says what the models say, of every key."""

import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import pytest
from pydantic import BaseModel

from rig.config.models import ArmSection, RigConfig
from rig.config.procedures.procedure_sections import STOCK_SECTIONS
from rig.config.reference_page import REPEAT, reference, unit_of
from rig.config.world.laboratory import WorldSection
from support.paths import CONFIGS, DOCS

MODELS: tuple[type[BaseModel], ...] = (RigConfig, ArmSection, WorldSection, *STOCK_SECTIONS.values())


def keys() -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Section, key and schema of all that is no section itself."""
    for model in MODELS:
        schema = model.model_json_schema()
        for section in (schema, *schema.get("$defs", {}).values()):
            for key, value in section["properties"].items():
                parts = (value, value.get("items", {}), *value.get("anyOf", ()))  # a list of sections is none either
                inner = any({"$ref", "patternProperties"} & set(part) for part in parts)
                if section["title"] != "ProcedureSection" and not inner:
                    yield section["title"], key, value


@cache
def made() -> str:
    return reference()


@pytest.mark.slow
def test_the_committed_page_is_what_the_models_generate() -> None:
    page = (DOCS / "configuration.md").read_text(encoding="utf-8")
    assert page == reference(), "again: python -m rig.config.reference_page > docs/configuration.md"


@pytest.mark.slow
def test_every_key_says_what_it_means_and_its_unit() -> None:
    for section, key, schema in keys():
        name = f"{section}.{key}"
        assert f"| `{key}` | {schema['description'].replace('|', chr(92) + '|')} | " in made(), name
        assert not re.search("'type': '(number|integer)'", str(schema)) or unit_of(key, schema), f"{name} has no unit"
        assert "pattern" not in schema or "allowed" in schema, f"{name}: nobody should have to read a pattern"


def test_every_section_of_the_world_stands_in_its_own_part() -> None:
    rig, world = made().split("## The simulated laboratory")
    assert "`world.sensors.<name>`" in world and "### `sensors.<name>`" in rig and "### `world" not in rig


def test_what_holds_when_a_key_is_left_out() -> None:
    page = made()
    assert "| number 0.5 to 180 | `60.0` |" in page
    assert "| what the part has, see below | the part's usual one |" in page
    assert "| `host` | name or address of the arm's controller |  | text of at most 253 characters | **must be" in page


def test_the_example_is_the_shipped_file() -> None:
    assert (CONFIGS / "repeat_lsm9ds1.yaml").read_text(encoding="utf-8") == REPEAT

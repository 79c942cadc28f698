"""Print the JSON schema of configurations, for editors: `python -m rig.config.config_schema > docs/config.schema.json`.

An editor with a YAML language server completes and checks a file whose first line names the schema: `#
yaml-language-server: $schema=PATH`. The schema requires no key, because a file may be based on another (`base`) and
state only what differs; `rig check` reports missing keys.
"""

import json
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from rig.config.files.layers import BASE_KEY
from rig.config.load import STOCK_TURNERS
from rig.config.models import RigConfig
from rig.config.procedures.procedure_sections import STOCK_SECTIONS
from rig.config.procedures.shortest_procedure import SHORTEST, TargetUncertaintySection
from rig.config.world.laboratory import WorldSection

OMITTED_KEYS = ("title", "required", "default")
NULL_SCHEMA = {"type": "null"}  # value of a key that the section does not know: it removes what the base states
OBJECT = ["object", "null"]
DIALECT = "https://json-schema.org/draft/2020-12/schema"

SHORTEST_SECTION = {"type": OBJECT, "properties": {"target_uncertainty": {"$ref": "#/$defs/TargetUncertaintySection"}}}


def config_schema() -> dict[str, Any]:
    """Return the schema of a whole file; the procedure's and the turner's names select their keys."""
    models: tuple[type[BaseModel], ...] = (
        RigConfig,
        WorldSection,
        TargetUncertaintySection,
        *STOCK_SECTIONS.values(),
        *STOCK_TURNERS.values(),
    )
    _, schema = models_json_schema([(model, "validation") for model in models])
    definitions = {name: _file_schema(definition) for name, definition in schema["$defs"].items()}
    whole = definitions.pop(RigConfig.__name__)
    turners = {kind: _add_kind(definitions[section.__name__]) for kind, section in STOCK_TURNERS.items()}
    procedures = {name: _section(section) for name, section in STOCK_SECTIONS.items()}
    own_sections = {
        BASE_KEY: {"type": "string", "description": "file on which this one builds; this one states what differs"},
        "arm": _section(STOCK_TURNERS["ur"]),
        "turner": _chosen("kind", turners, "what turns the sensors, if it is not an arm"),
        "procedure": _chosen("name", {**procedures, SHORTEST: SHORTEST_SECTION}, "what is done"),
        "world": _section(WorldSection),
    }
    properties = {
        **own_sections,
        **{key: value for key, value in whole["properties"].items() if key not in own_sections},
    }
    return {
        "$schema": DIALECT,
        "title": "Configuration of the calibration rig",
        "description": "One file is one repeatable calibration.",
        "type": "object",
        "properties": properties,
        "additionalProperties": NULL_SCHEMA,
        "$defs": definitions,
    }


def schema_text() -> str:
    """Return the schema as the text of a file."""
    return json.dumps(config_schema(), indent=1, ensure_ascii=False) + "\n"


def _section(model: type[BaseModel]) -> dict[str, Any]:
    return {"$ref": f"#/$defs/{model.__name__}"}


def _add_kind(section: Mapping[str, Any]) -> dict[str, Any]:
    """Return the schema of a turner's section with the key `kind` added."""
    return {**section, "properties": {"kind": {"type": "string"}, **section["properties"]}}


def _chosen(key: str, sections: Mapping[str, Mapping[str, Any]], text: str) -> dict[str, Any]:
    """Return the schema of a section: the value of `key` selects one of `sections`; another value allows any keys."""
    names = {"anyOf": [{"enum": [*sections]}, {"type": "string"}], "description": f"one of {', '.join(sections)}"}
    branches = [
        {"if": {"properties": {key: {"const": name}}, "required": [key], "type": "object"}, "then": section}
        for name, section in sections.items()
    ]
    return {"type": OBJECT, "description": text, "properties": {key: names}, "allOf": branches}


def _file_schema(schema: Any) -> Any:
    """Return a model's schema for files, in which all keys are optional, null omits a key, and text may be a number."""
    if isinstance(schema, list):
        return [_file_schema(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    written = {key: _file_schema(value) for key, value in schema.items() if key not in OMITTED_KEYS}
    if "properties" in schema:  # its keys are names of a section, which may equal a word of the schema
        written["properties"] = {key: _file_schema(value) for key, value in schema["properties"].items()}
    if schema.get("additionalProperties") is False:
        written["additionalProperties"] = NULL_SCHEMA
    if "const" in schema:
        written["enum"] = [written.pop("const")]
    if "enum" in written:
        written["enum"] = [*written["enum"], None]
        written.pop("type", None)
    elif isinstance(kind := schema.get("type"), str) and kind != "null":
        written["type"] = ["string", "number", "null"] if kind == "string" else [kind, "null"]
    if isinstance(schema.get("default"), (bool, int, float, str)):
        written["default"] = schema["default"]
    return written


if __name__ == "__main__":
    print(schema_text(), end="")

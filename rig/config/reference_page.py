"""Prints every key of a configuration for people: `python -m rig.config.reference_page > docs/configuration.md`."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from rig.config.files import layers, yaml_text
from rig.config.models import ArmSection, RigConfig
from rig.config.procedures.procedure_sections import DEFAULT_PROCEDURE, STOCK_SECTIONS
from rig.config.procedures.servo_section import ServoSection
from rig.config.procedures.shortest_procedure import CARRIED_OUT, SHORTEST, ShortestSection
from rig.config.section import Section
from rig.config.sensors.sensor_catalogue import PARTS
from rig.config.world.laboratory import WorldSection

Schema = Mapping[str, Any]

# A key ends in its unit. Of several endings that fit, the longest one is meant.
UNITS = {
    "_deg_s2": "°/s²",
    "_m_s2": "m/s²",
    "_deg_s": "°/s",
    "_deg_h": "°/h",
    "_rad_s": "rad/s",
    "_deg": "°",
    "_rad": "rad",
    "_mrad": "mrad",
    "_per_turn": "1/turn",
    "_mm": "mm",
    "_kg": "kg",
    "_hz": "Hz",
    "_ppm": "ppm",
    "_percent": "%",
    "_c": "°C",
    "_k": "K",
    "_s": "s",
    "_s2": "s²",
    "_ms": "ms",
    "_min": "min",
    "_g": "g",
    "_ug": "µg",
    "_w": "W",
    "_ut": "µT",
    "_gauss": "gauss",
    "_a_m2": "A m²",
    "baud": "Bd",
    "_ut_m": "µT/m",
    "_ut_min": "µT/min",
    "_k_per_min": "K/min",
    "_k_w": "K/W",
    "_w_k": "W/K",
    "_j_k": "J/K",
    "_ppm_k": "ppm/K",
    "_mg_k": "mg/K",
    "_deg_s_k": "°/s/K",
    "_deg_s_g": "°/s/g",
    "_per_k": "1/K",
    "_per_k2": "1/K²",
    "_m_s2_per_k": "m/s²/K",
    "_m_s2_per_k2": "m/s²/K²",
    "_rad_s_per_k": "rad/s/K",
    "_rad_s_per_k2": "rad/s/K²",
    "_rad_s_per_g": "rad/s/g",
    "_rad_s_per_sqrt_s": "rad/s/√s",
    "_per_rad_s": "1/(rad/s)",
    "_s2_m": "s²/m",
    "": "",  # words, booleans, and numbers whose model states the unit
}

REPEAT = """\
# yaml-language-server: $schema=../docs/config.schema.json
# The next LSM9DS1 on the same rig: a repeat calibration says only what differs.
base: ur10e_lsm9ds1.yaml
sensors: {gyro: {serial_number: LSM9DS1-002}}
procedure: {repeats: 2}
output: {folder: runs/LSM9DS1-002}
"""

INTRODUCTION = f"""\
# The configuration file

Generated from the models in [`rig/config/`](../rig/config) by
`python -m rig.config.reference_page > docs/configuration.md`: change the models, not this page.

One YAML file is one repeatable calibration: the rig, its sensors, the procedure, the verdict's limits. Every quantity
has its unit in its key. The rig checks the whole file before it connects to anything, and reports all errors at once.
Each error has its path, its line, what is allowed and, for a misspelling, the nearest key (error `configuration`, exit
status 2). A key that is not on this page is an error. Words: [glossary](glossary.md).

## Building on another file

A file can build on another one, its base, and state only what differs. `base:` names that file, by a path relative to
the file that contains the line. The following is the complete [repeat_lsm9ds1.yaml](../configs/repeat_lsm9ds1.yaml):

```yaml
{REPEAT}```

- Sections are merged key by key. Lists and single values replace those of the base.
- `null` deletes a key of the base. `world: null` takes the simulated laboratory away, so the rig uses hardware.
  `range_deg_s: null` returns to the usual range. If the base does not have the key, `null` is an error like any other
  wrong value.
- A base may have a base itself, up to {layers.MAX_FILES} files in all. A circle is refused.
- An error names its file and its line: `arm.payload_kg (demo.yaml, line 4)`.
- The run folder's `config.yaml` contains everything together and needs no base. So a run can be resumed on a computer
  that does not have the original files.

## Change a value for one run: the rest, the speed

Use `--set path.to.key=value`, once or several times, with the value in YAML: `--set procedure.rest_s=5`,
`--set 'sensors.gyro.mounting={{x: +y, y: -x, z: +z}}'`. It replaces what the file says at that
place; this may be a whole section. `null` deletes it. The run folder's `config.yaml` contains the new value.

## What a file may contain

Plain YAML in UTF-8, in a regular file of at most {yaml_text.MAX_BYTES // 1024} KiB. It may have at most
{yaml_text.MAX_NODES} keys and values (an alias counts as everything that it replaces), and at most
{yaml_text.MAX_DEPTH} sections or lists inside each other. Keys are words. Tags (`!!…`), control characters and a key
that is there twice are refused.
"""


def reference() -> str:
    """Return the page of all configuration keys as Markdown."""
    return "\n".join([INTRODUCTION, *_keys(), *_parts(), *_world()]) + "\n"


def _keys() -> Iterator[str]:
    yield from (
        "## Keys",
        "",
        "`arm`, `sensors` and `limits` are required; `board` is required if a sensor is on it. The other sections may",
        "be left out. The last column says what holds when a key is left out.",
        "",
    )
    schema = RigConfig.model_json_schema()
    for name in schema["properties"]:
        if name == "procedure":
            yield from _procedures()
        elif name == "turner":
            yield from _turners()
        else:
            section = schema["properties"][name]
            yield from _section(name, _section_of(section) or section, schema["$defs"])


def _turners() -> Iterator[str]:
    schema = ArmSection.model_json_schema()
    yield from _section("arm", schema, schema.get("$defs", {}))
    yield from (
        "### `turner`",
        "",
        "What turns the sensors, by its `kind`. `turner: {kind: ur, …}` with the keys of `arm` is the same as",
        "`arm`; a file has one of the two. `turner: {kind: hand}` is an operator's hand, and has no keys",
        "([by hand](how-to/without-an-arm/by-hand.md)). `kind: servo` has the keys below. A package may bring another",
        "kind, which brings its own keys ([another turner](how-to/with-code/other-hardware.md)).",
        "",
    )
    servo = ServoSection.model_json_schema()
    yield from _section("turner", servo, servo.get("$defs", {}), "### `turner` with `kind: servo`")


def _procedures() -> Iterator[str]:
    yield from (
        "### `procedure`",
        "",
        f"`name` states which procedure is run; the default is `{DEFAULT_PROCEDURE}`. The keys of this "
        "section depend on it.",
        "[A procedure of your own](how-to/with-code/own-procedure.md) has its own section.",
        "",
    )
    sections: dict[str, type[Section]] = {}
    for name, stock in STOCK_SECTIONS.items():
        sections |= {name: stock, SHORTEST: ShortestSection} if name == CARRIED_OUT else {name: stock}
    for name, section in sections.items():
        schema = section.model_json_schema()
        yield from _section("procedure", schema, schema.get("$defs", {}), f"### `procedure` with `name: {name}`")


def _parts() -> Iterator[str]:
    rows = (
        (
            f"`{name}`",
            part.rates_rule,
            "–" if part.any_rate else f"{part.default_rate_hz:g}",
            ", ".join(f"{range_deg_s:g}" for range_deg_s in part.ranges_deg_s) or "any",
            "–" if part.any_rate else f"{part.default_range_deg_s:g}",
            ", ".join(f"{range_g:g}" for range_g in part.ranges_g) or "any",
        )
        for name, part in PARTS.items()
    )
    yield from ("### The parts' rates and ranges", "")
    yield from _table(("part", "`rate_hz` in Hz", "usual", "`range_deg_s` in °/s", "usual", "`range_g` in g"), rows)
    yield ""


def _world() -> Iterator[str]:
    schema = WorldSection.model_json_schema()
    yield from (
        "## The simulated laboratory",
        "",
        "With a `world:` section a simulated arm, servo or operator's hand, an emulated board, simulated KVH 1775s and",
        "autopilots answer at `arm.host` or `turner.port`, `board.port` and the sensors' ports. They answer on this",
        "computer only: the host must be a loopback",
        "address (127.x.y.z), and a port must be `socket://host:port`. If another simulated laboratory already has",
        "this address, a command takes a free one and says so; only `rig world` never changes the address.",
        "Without a `world:` section the rig connects to the real arm and board. Only the simulated laboratory uses the",
        "values of this section. They are in no recording and no result.",
        "",
    )
    yield from _section("world", schema, schema["$defs"])


def _section(path: str, schema: Schema, definitions: Schema, heading: str | None = None) -> Iterator[str]:
    """Yield a section's heading, its keys in a table, and its subsections."""
    if "patternProperties" in schema:  # one section for each name
        (named_section,) = schema["patternProperties"].values()
        yield from _section(f"{path}.<name>", named_section, definitions)
        return
    section = _resolve(schema, definitions)
    properties = section["properties"]
    inner = {key: part for key, value in properties.items() if (part := _section_of(value)) is not None}
    required = section.get("required", ())
    yield from (heading or f"### `{path}`", "", " ".join(section["description"].split()), "")
    rows = (_row(key, it, key in required) for key, it in properties.items() if key not in inner)
    yield from _table(("key", "meaning", "unit", "allowed", "left out"), rows)
    yield ""
    for key, it in inner.items():
        yield from _section(f"{path}.{key}", it, definitions)


def _section_of(schema: Schema) -> Schema | None:
    """Return the schema of the section or sections that a key holds, or None for a plain value."""
    if "$ref" in schema or "patternProperties" in schema:
        return schema
    if "$ref" in schema.get("items", ()):  # a list of sections
        return dict(schema["items"])
    return next((variant for variant in schema.get("anyOf", ()) if "$ref" in variant), None)


def _resolve(schema: Schema, definitions: Schema) -> Schema:
    return definitions[schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema


def _row(key: str, schema: Schema, required: bool) -> tuple[str, ...]:
    value = next((it for it in schema.get("anyOf", ()) if it != {"type": "null"}), schema)
    allowed = schema.get("allowed") or _describe_values(value)
    return f"`{key}`", schema["description"], unit_of(key, schema), allowed, _describe_default(schema, required)


def unit_of(key: str, schema: Schema) -> str:
    """Return the unit of a key's value, by its model or its name; "" for words and booleans."""
    stated = (variant["unit"] for variant in (schema, *schema.get("anyOf", ())) if "unit" in variant)
    return next(stated, None) or UNITS[max((end for end in UNITS if key.endswith(end)), key=len, default="")]


def _describe_values(schema: Schema) -> str:
    """Return the allowed values in words."""
    if "prefixItems" in schema:
        first, *others = schema["prefixItems"]
        return f"{1 + len(others)} numbers{_describe_items(first)}"
    if "items" in schema:
        return f"list{_describe_items(schema['items'])}"
    return _single(schema)


def _describe_items(schema: Schema) -> str:
    words = _single(schema).removeprefix("number").strip()
    return f", each {words}" if words else ""


def _single(schema: Schema) -> str:
    if "enum" in schema or "const" in schema:
        return " or ".join(f"`{value}`" for value in schema.get("enum", [schema.get("const")]))
    if schema["type"] in ("number", "integer"):
        return ("whole number" if schema["type"] == "integer" else "number") + _range(schema)
    if schema["type"] == "boolean":
        return "`true` or `false`"
    return f"text of at most {schema['maxLength']} characters" if "maxLength" in schema else "text"


def _range(schema: Schema) -> str:
    low, above = schema.get("minimum"), schema.get("exclusiveMinimum")
    high, below = schema.get("maximum"), schema.get("exclusiveMaximum")
    if low is not None and high is not None:
        return f" {low:g} to {high:g}"
    bounds = (("at least", low), ("above", above), ("at most", high), ("below", below))
    words = ", ".join(f"{word} {bound:g}" for word, bound in bounds if bound is not None)
    return f" {words}" if words else ""


def _describe_default(schema: Schema, required: bool) -> str:
    """Return the value that a key has if it is left out, in words or as in a file."""
    if "usual" in schema:
        return str(schema["usual"])
    if required:
        return "**must be given**"
    default = schema["default"]
    return "nothing" if default is None else f"`{default if isinstance(default, str) else json.dumps(default)}`"


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(headings)} |"
    yield "|" + " --- |" * len(headings)
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"


if __name__ == "__main__":
    print(reference(), end="")

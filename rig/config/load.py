"""Reads a configuration file, and says everything that is wrong with it at once."""

import difflib
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from rig.config.models import ProcedureSection, RigConfig
from rig.config.procedure_sections import DEFAULT_PROCEDURE, STOCK_SECTIONS
from rig.config.world_models import WorldSection
from rig.errors import Refused

Location = tuple[int | str, ...]
Model = TypeVar("Model", bound=BaseModel)
Sections = Mapping[str, type[ProcedureSection]]


@dataclass(frozen=True, slots=True)
class Loaded:
    """A valid configuration. `world` goes to the simulated laboratory and nowhere else.

    `text` is the file as used (overrides applied), `rig_text` the same without its `world:` section: that is what a
    recording keeps.
    """

    config: RigConfig
    world: WorldSection | None
    text: str
    rig_text: str


class ConfigurationRefused(Refused):
    """The configuration is not valid; `problems` has one line for each error found."""

    def __init__(self, source: str, problems: Sequence[str]) -> None:
        count = "1 error" if len(problems) == 1 else f"{len(problems)} errors"
        super().__init__("configuration", f"{source} has {count}", "Mend the file and run again; nothing has moved")
        self.problems = tuple(problems)

    def __str__(self) -> str:
        return "\n".join([super().__str__(), *(f"  {problem}" for problem in self.problems)])


def load(path: str | Path, overrides: Sequence[str] = (), sections: Sections = STOCK_SECTIONS) -> Loaded:
    """Read, override and validate a configuration file.

    `overrides` are `path.to.key=value` with the value in YAML. `sections` are the procedures the file may name, each
    with what its `procedure:` section holds. Raises `ConfigurationRefused` listing every error with
    its path, line, value, what is allowed and, for a misspelling, the nearest valid spelling.
    """
    source = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationRefused(source, [f"cannot be read: {error}"]) from None
    return parse(text, source, overrides, sections)


def parse(
    text: str,
    source: str = "configuration",
    overrides: Sequence[str] = (),
    sections: Sections = STOCK_SECTIONS,
) -> Loaded:
    """As `load`, from text."""
    try:
        lines, repeated = _survey(text)
        document = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigurationRefused(source, [" ".join(str(error).split())]) from None
    if not isinstance(document, dict):
        raise ConfigurationRefused(source, ["the file must be a mapping with the keys arm, board, sensors, limits"])
    problems = repeated + [problem for item in overrides for problem in _override(document, item)]

    rig_part = {key: value for key, value in document.items() if key != "world"}
    config, rig_problems = _validate_rig(rig_part, sections, lines)
    world: WorldSection | None = None
    world_problems: list[str] = []
    if "world" in document:
        world, world_problems = _validate(WorldSection, document["world"], ("world",), lines)
    problems += rig_problems + world_problems
    if config is not None and world is not None:
        problems += _world_fits(config, world)
    if problems or config is None:
        raise ConfigurationRefused(source, problems)
    return Loaded(
        config=config,
        world=world,
        text=_dump(document) if overrides else text,
        rig_text=_dump(rig_part),
    )


def _dump(document: Mapping[str, Any]) -> str:
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True)


def _survey(text: str) -> tuple[dict[Location, int], list[str]]:
    """The line of every key, and the keys given twice (YAML itself would silently keep the last)."""
    lines: dict[Location, int] = {}
    repeated: list[str] = []

    def visit(node: yaml.Node | None, location: Location) -> None:
        if isinstance(node, yaml.MappingNode):
            for key, value in node.value:
                place = (*location, str(key.value))
                if place in lines:
                    repeated.append(
                        f"{_dotted(place)}: given twice, on lines {lines[place]} and {key.start_mark.line + 1}"
                    )
                lines[place] = key.start_mark.line + 1
                visit(value, place)
        elif isinstance(node, yaml.SequenceNode):
            for index, value in enumerate(node.value):
                visit(value, (*location, index))

    visit(yaml.compose(text, Loader=yaml.SafeLoader), ())
    return lines, repeated


def _override(document: dict[str, Any], item: str) -> Iterator[str]:
    """Apply one `a.b.c=value` in place; yields a problem instead when it cannot be applied."""
    path, equals, value = item.partition("=")
    if not equals or not path:
        yield f"--set {item}: must be path=value, for example procedure.speed_deg_s=30"
        return
    *parents, last = path.split(".")
    place: Any = document
    for parent in parents:
        place = place.setdefault(parent, {}) if isinstance(place, dict) else None
        if not isinstance(place, dict):
            yield f"--set {item}: {parent} is not a section"
            return
    place[last] = yaml.safe_load(value)


def _validate_rig(
    document: Mapping[str, Any], sections: Sections, lines: Mapping[Location, int]
) -> tuple[RigConfig | None, list[str]]:
    """The rig's part: the procedure by the section its name chooses, and the rest."""
    procedure, problems = _validate_procedure(document.get("procedure", {}), sections, lines)
    rest = {**document, "procedure": procedure or ProcedureSection(name="")}
    config, rest_problems = _validate(RigConfig, rest, (), lines)
    if procedure is None or config is None:
        return None, rest_problems + problems
    problems = [f"(file): {problem}" for problem in procedure.problems(config)]
    return (None if problems else config), problems


def _validate_procedure(
    data: Any, sections: Sections, lines: Mapping[Location, int]
) -> tuple[ProcedureSection | None, list[str]]:
    """A name that is not known is one problem; the other keys are then judged as those of the nearest name."""
    name = data.get("name", DEFAULT_PROCEDURE) if isinstance(data, dict) else DEFAULT_PROCEDURE
    if isinstance(name, str) and name in sections:
        return _validate(sections[name], data, ("procedure",), lines)
    place = ("procedure", "name")
    problems = [_where(place, lines) + _not_allowed(name, list(sections))]
    nearest = difflib.get_close_matches(str(name), list(sections), n=1)
    if nearest:
        problems += _validate(sections[nearest[0]], {**data, "name": nearest[0]}, ("procedure",), lines)[1]
    return None, problems


def _validate(
    model: type[Model], data: Any, prefix: Location, lines: Mapping[Location, int]
) -> tuple[Model | None, list[str]]:
    try:
        return model.model_validate(data), []
    except ValidationError as error:
        # A list whose only item is wrong is also reported as too short: the first report is the useful one.
        items = [item for item in error.errors() if item["type"] != "too_short" or not item["input"]]
        return None, [_explain(model, item, prefix, lines) for item in items]


def _explain(model: type[BaseModel], item: Any, prefix: Location, lines: Mapping[Location, int]) -> str:
    """One validation error as: path (line): what is wrong, what is allowed, nearest spelling."""
    location: Location = item["loc"]
    where = _where((*prefix, *location), lines)
    kind, value = item["type"], item["input"]
    if kind == "extra_forbidden":
        allowed = [*_keys_at(model, location[:-1]), *(["world"] if not prefix and len(location) == 1 else [])]
        return f"{where}: unknown key{_nearest(str(location[-1]), allowed)}; allowed: {', '.join(allowed)}"
    if kind == "missing":
        return f"{where}: missing"
    if kind == "literal_error":
        allowed = [word.strip("'") for word in item["ctx"]["expected"].replace(" or ", ", ").split(", ")]
        return where + _not_allowed(value, allowed)
    message = item["msg"].removeprefix("Value error, ")
    shown = "" if isinstance(value, dict) else f"{value!r}: "
    return f"{where}: {shown}{message[0].lower()}{message[1:]}"


def _where(place: Location, lines: Mapping[Location, int]) -> str:
    line = lines.get(place)
    return _dotted(place) + (f" (line {line})" if line else "")


def _not_allowed(value: Any, allowed: Sequence[str]) -> str:
    return f": {value!r} is not allowed{_nearest(str(value), allowed)}; allowed: {', '.join(allowed)}"


def _keys_at(model: type[BaseModel], location: Location) -> list[str]:
    """The keys allowed in the section at `location` of `model`."""
    annotation: Any = model
    for part in location:
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            annotation = annotation.model_fields[str(part)].annotation
        else:
            annotation = typing.get_args(annotation)[-1]  # dict[str, Section] → Section
        if isinstance(annotation, types.UnionType):
            annotation = typing.get_args(annotation)[0]
    return list(annotation.model_fields)


def _nearest(word: str, allowed: Sequence[str]) -> str:
    matches = difflib.get_close_matches(word, allowed, n=1, cutoff=0.5)
    return f", did you mean {matches[0]}?" if matches else ""


def _dotted(location: Location) -> str:
    return ".".join(str(part) for part in location) or "(file)"


def _world_fits(config: RigConfig, world: WorldSection) -> Iterator[str]:
    """The world stands in for hardware only on this machine, and only for the sensors the rig names."""
    if not (config.arm.host.startswith("127.") or config.arm.host == "localhost"):
        yield f"arm.host: {config.arm.host!r} must be a loopback address (127.x.y.z) when the file has a world: section"
    if not config.board.port.startswith("socket://"):
        yield f"board.port: {config.board.port!r} must be socket://host:port when the file has a world: section"
    for name in sorted(set(config.sensors) ^ set(world.sensors)):
        where = "world.sensors" if name in config.sensors else "sensors"
        yield f"{where}.{name}: missing; every sensor stands both in sensors and in world.sensors"

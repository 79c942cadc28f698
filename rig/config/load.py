"""The reading of a configuration file, which reports all of its errors at once."""

import difflib
import ipaddress
import types
import typing
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

import yaml
from pydantic import BaseModel, ValidationError

from rig.config.files.layers import BASE_KEY, SET, MergedLayers, Places, merge_layers, read_layers
from rig.config.files.verbatim_text import take_text_as_written
from rig.config.files.yaml_text import Location, Unreadable, format_path
from rig.config.models import ArmSection, ProcedureSection, RigConfig, SensorsConfig, StatementConfig, TurnerSection
from rig.config.procedures.hand_sections import HandSection
from rig.config.procedures.procedure_sections import DEFAULT_PROCEDURE, STOCK_SECTIONS
from rig.config.procedures.servo_section import ServoSection
from rig.config.procedures.shortest_procedure import (
    CARRIED_OUT,
    SHORTEST,
    TargetUncertaintySection,
    alternative_procedure,
    expand_procedure,
)
from rig.config.world.laboratory import WorldSection
from rig.errors import Refused
from rig.errors.quoting import printable, quote

Model = TypeVar("Model", bound=BaseModel)
Sections = Mapping[str, type[ProcedureSection]] | None  # None: the reader does not need the procedure
Turners = Mapping[str, type[TurnerSection]] | None  # None: the reader needs only the stock turners
# The stock kinds of turners, each a room of `rig.turners`, by name; `arm` is the section of the first.
STOCK_TURNERS: Mapping[str, type[TurnerSection]] = {"ur": ArmSection, "hand": HandSection, "servo": ServoSection}
TURNER_SECTIONS = frozenset({"arm", "turner"})  # of which a configuration has one
MAX_PROBLEMS = 25
CONFIGURATION_REMEDY = (
    "Give a configuration; rig new FILE writes one, and rig demo --files . copies those of the documentation"
)
WHOLE_FILE_PROBLEMS = ("cannot be read: ", "is ")  # how a problem of the whole file begins


@dataclass(frozen=True, slots=True)
class Loaded:
    """A valid configuration.

    - `simulated`: whether the file has a `world:` section. Only the simulated laboratory reads this section.
    - `flash_file`: the file with the simulated board's memory, None without such a file.
    - `text`: the file as used, merged with base and overrides; `rig_text`: the same without the `world:` section, as
      recorded.
    """

    config: RigConfig
    simulated: bool
    flash_file: Path | None
    text: str
    rig_text: str

    @property
    def laboratory(self) -> str | None:
        """The file's text with all defaults filled in, if it has a `world:` section, else None."""
        return self.text if self.simulated else None


class ConfigurationRefused(Refused):
    """An invalid configuration: its `problems`, one line each, and `give`, the remedy for an unreadable file."""

    def __init__(self, source: str, problems: Sequence[str], give: str = CONFIGURATION_REMEDY) -> None:
        self.problems = tuple(printable(problem) for problem in problems)
        if self._is_unreadable:
            what, remedy = self.problems[0], give
        else:
            what = "has 1 error" if len(problems) == 1 else f"has {len(problems)} errors"
            by_option = all(f"{SET} " in problem or f"({SET})" in problem for problem in problems)
            remedy = f"Correct the {'command line' if by_option else 'file'} and run again; nothing has moved"
        super().__init__("configuration", f"{printable(source)} {what}", remedy)

    @property
    def _is_unreadable(self) -> bool:
        return len(self.problems) == 1 and self.problems[0].startswith(WHOLE_FILE_PROBLEMS)

    def __str__(self) -> str:
        if self._is_unreadable:
            return super().__str__()
        more = len(self.problems) - MAX_PROBLEMS
        shown = [*self.problems[:MAX_PROBLEMS], *([f"and {more} more"] if more > 0 else [])]
        return "\n".join([super().__str__(), *(f"  {problem}" for problem in shown)])


def load(
    path: str | Path, overrides: Sequence[str] = (), sections: Sections = STOCK_SECTIONS, turners: Turners = None
) -> Loaded:
    """Return the valid configuration in a file, after overrides.

    `overrides` are `path.to.key=value` with the value in YAML. `sections` are the procedures by name, with the model of
    their `procedure:` section; `turners` are the kinds of turners, with their models. Raise `ConfigurationRefused`
    listing every error with its path, line, value, what is allowed and, for a misspelling, the nearest valid spelling.
    """
    with _refusing_unreadable(str(path)):
        layered = read_layers(Path(path), overrides)
    return _validate_all(layered, str(path), sections, turners)


def load_sensors(path: str | Path, overrides: Sequence[str] = ()) -> tuple[SensorsConfig, str | None]:
    """Return the sensors' part of a configuration, and the file's text for the simulated laboratory.

    The text is None if the file has no `world:` section. A file that has one must be complete, because the laboratory
    simulates all of it. Raise `ConfigurationRefused`.
    """
    with _refusing_unreadable(str(path)):
        layered = read_layers(Path(path), overrides)
    if "world" in layered.document:
        loaded = _validate_all(layered, str(path), None, None)
        return loaded.config, loaded.text
    rest = {key: value for key, value in layered.document.items() if key not in TURNER_SECTIONS}
    turner_keys = TURNER_SECTIONS & layered.document.keys()
    _, turner_problems = _validate_turner(layered.document, None, layered) if turner_keys else (None, [])
    return _require(SensorsConfig, rest, layered, str(path), turner_problems), None


def load_statement(overrides: Sequence[str]) -> StatementConfig:
    """Return site and certificate from overrides without a file. Raise `ConfigurationRefused` as `load` does."""
    with _refusing_unreadable(SET):
        layered = merge_layers("{}", None, overrides)
    return _require(StatementConfig, layered.document, layered, SET)


def load_as(model: type[Model], path: str | Path, give: str) -> Model:
    """Return the section that a file holds, as a `model`. Raise `ConfigurationRefused` as `load` does.

    `give` is the remedy for a file that cannot be read.
    """
    with _refusing_unreadable(str(path), give):
        layered = read_layers(Path(path))
    return _require(model, layered.document, layered, str(path))


def parse(
    text: str,
    source: str = "configuration",
    overrides: Sequence[str] = (),
    sections: Sections = STOCK_SECTIONS,
    turners: Turners = None,
) -> Loaded:
    """Return the valid configuration in a text, as `load` does for a file; the text has no base file."""
    with _refusing_unreadable(source):
        layered = merge_layers(text, None, overrides)
    return _validate_all(layered, source, sections, turners)


@contextmanager
def _refusing_unreadable(source: str, give: str = CONFIGURATION_REMEDY) -> Iterator[None]:
    """Convert the error of a text that cannot be read at all into `ConfigurationRefused`, with `give` as remedy."""
    try:
        yield
    except Unreadable as error:
        raise ConfigurationRefused(source, [str(error)], give) from None


def _require(model: type[Model], data: Any, layered: MergedLayers, source: str, more: Sequence[str] = ()) -> Model:
    """Return `data` as a `model`. Raise `ConfigurationRefused` listing every problem, and those given as `more`."""
    section, problems = _validate(model, data, (), layered)
    if layered.problems or more or section is None:
        raise ConfigurationRefused(source, [*layered.problems, *more, *problems])
    return section


def _validate_all(layered: MergedLayers, source: str, sections: Sections, turners: Turners) -> Loaded:
    """Return the valid configuration. Raise ConfigurationRefused with all problems of all sections."""
    document = layered.document
    rig_part = {key: value for key, value in document.items() if key != "world"}
    config, rig_problems = _validate_rig(rig_part, sections, turners, layered)
    world: WorldSection | None = None
    world_problems: list[str] = []
    if "world" in document:
        world, world_problems = _validate(WorldSection, document["world"], ("world",), layered)
    problems = [*layered.problems, *rig_problems, *world_problems]
    if config is not None and world is not None:
        problems += _world_fits(config, world)
    if problems or config is None:
        raise ConfigurationRefused(source, problems)
    return Loaded(
        config=config,
        simulated=world is not None,
        flash_file=None if world is None else world.board.flash_file,
        text=_dump(document) if layered.text is None else layered.text,
        rig_text=_dump(rig_part),
    )


def _dump(document: Mapping[str, Any]) -> str:
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True)


def _validate_rig(
    document: Mapping[str, Any], sections: Sections, turners: Turners, layered: MergedLayers
) -> tuple[RigConfig | None, list[str]]:
    """Return all sections except the world's, None if invalid, and the problems.

    The procedure's name and the turner's kind select the models of their sections.
    """
    procedure, problems = _validate_procedure(document.get("procedure", {}), sections, layered)
    turner, turner_problems = _validate_turner(document, turners, layered)
    rest = {**document, "procedure": procedure or ProcedureSection(name=""), "turner": turner or TurnerSection()}
    rest.pop("arm", None)
    config, rest_problems = _validate(RigConfig, rest, (), layered)
    if procedure is None or turner is None or config is None:
        return None, turner_problems + rest_problems + problems
    problems = [*procedure.problems(config)]
    return (None if problems else config), problems


def _validate_procedure(
    data: Any, sections: Sections, layered: MergedLayers
) -> tuple[ProcedureSection | None, list[str]]:
    """Return the procedure's section, None if invalid, and the problems.

    If the name is unknown, the keys are compared with those of the procedure with the nearest name.
    """
    name = data.get("name", DEFAULT_PROCEDURE) if isinstance(data, dict) else DEFAULT_PROCEDURE
    if sections is None:
        return ProcedureSection(name=str(name)), []
    name_location = ("procedure", "name")
    short = name == SHORTEST and SHORTEST not in sections
    if isinstance(data, dict) and (
        short or (name == CARRIED_OUT and "target_uncertainty" in data)
    ):  # the name is that of a script
        if (otherwise := alternative_procedure(layered.document)) is not None:
            return None, [f"{_describe_location(name_location, layered.places)}: {otherwise}"]
        wanted, problems = _validate(
            TargetUncertaintySection, data.get("target_uncertainty", {}), ("procedure", "target_uncertainty"), layered
        )
        if wanted is None:
            return None, problems
        data = expand_procedure(data, wanted)
        name = data["name"]
    if isinstance(name, str) and name in sections:
        return _validate(sections[name], data, ("procedure",), layered)
    problems = [_describe_location(name_location, layered.places) + _not_allowed(name, [*sections, SHORTEST])]
    nearest = difflib.get_close_matches(str(name)[:100], list(sections), n=1)
    if nearest:
        problems += _validate(sections[nearest[0]], {**data, "name": nearest[0]}, ("procedure",), layered)[1]
    return None, problems


def _validate_turner(
    document: Mapping[str, Any], turners: Turners, layered: MergedLayers
) -> tuple[TurnerSection | None, list[str]]:
    """Return the turner's section, None if invalid, and the problems; a wrong kind is a single problem."""
    if "turner" not in document:
        if "arm" not in document:
            return None, ["arm: missing"]
        return _validate(ArmSection, document["arm"], ("arm",), layered)
    kinds = {**STOCK_TURNERS, **(turners or {})}
    data = document["turner"]
    kind = data.get("kind") if isinstance(data, dict) else None
    if "arm" in document:
        problem = (
            _describe_location(("turner",), layered.places) + ": the turner is given twice; give either arm or turner"
        )
    elif not isinstance(data, dict):
        problem = (
            _describe_location(("turner",), layered.places) + f": {quote(data)}: must be a section, with the key kind"
        )
    elif isinstance(kind, str) and kind in kinds:
        keys = {key: value for key, value in data.items() if key != "kind"}
        return _validate(kinds[kind], keys, ("turner",), layered)
    elif turners is None and kind is not None:
        return TurnerSection(), []
    else:
        problem = _describe_location(("turner", "kind"), layered.places) + _not_allowed(kind, list(kinds))
    return None, [problem]


def _validate(model: type[Model], data: Any, prefix: Location, layered: MergedLayers) -> tuple[Model | None, list[str]]:
    take_text_as_written(model, data, prefix, layered.written)
    try:
        return model.model_validate(data), []
    except ValidationError as error:
        # A list whose only item is wrong is also reported as too short: the first report is the useful one.
        items = [item for item in error.errors() if item["type"] != "too_short" or not item["input"]]
        return None, [_explain(model, item, prefix, layered) for item in items]


SHAPES = {
    "float_parsing": "a number",
    "float_type": "a number",
    "int_parsing": "a whole number",
    "int_type": "a whole number",
    "tuple_type": "a list in brackets, such as [a, b, c]",
    "dict_type": "a section that holds others by their names",
}


def _explain(model: type[BaseModel], item: Any, prefix: Location, layered: MergedLayers) -> str:
    """Return one validation error as a line: path, line number, fault, allowed values, nearest spelling."""
    location: Location = item["loc"]
    where = _describe_location((*prefix, *location), layered.places)
    kind, value = item["type"], item["input"]
    if kind == "extra_forbidden":
        whole = not prefix and len(location) == 1
        arm = ["arm"] if whole and issubclass(model, SensorsConfig) else []
        allowed = [*arm, *_keys_at(model, location[:-1]), *(["world", BASE_KEY] if whole else [])]
        return f"{where}: unknown key{_nearest(str(location[-1]), allowed)}; allowed: {', '.join(allowed)}"
    if kind == "missing":
        return f"{where}: missing{_hint_at_override((*prefix, *location[:-1]), layered)}"
    if kind == "literal_error":
        allowed = [word.strip("'") for word in item["ctx"]["expected"].replace(" or ", ", ").split(", ")]
        return where + _not_allowed(value, allowed)
    if kind in SHAPES:
        return f"{where}: {quote(value)}: must be {SHAPES[kind]}"
    if kind == "model_type":
        return f"{where}: {quote(value)}: must be a section, with the keys {', '.join(_keys_at(model, location))}"
    message = item["msg"].removeprefix("Value error, ")
    shown = "" if isinstance(value, dict) else f"{quote(value)}: "
    words = f"{shown}{message[0].lower()}{message[1:]}"
    return f"{where}: {words}" if (*prefix, *location) else words  # what concerns the whole file has no place in it


def _hint_at_override(section: Location, layered: MergedLayers) -> str:
    """Return a hint that a section comes from `--set` alone, with the sections that the file has, or else ""."""
    if layered.places.get(section) != SET:
        return ""
    siblings: Any = layered.document
    for part in section[:-1]:
        siblings = siblings[part]
    others = [str(key) for key in siblings if key != section[-1] and layered.places.get((*section[:-1], key)) != SET]
    if not others or not section[:-1]:
        return ""
    return f"; {format_path(section)} comes from --set alone; the file has {', '.join(others)}"


def _describe_location(location: Location, places: Places) -> str:
    source = places.get(location)
    return format_path(location) + (f" ({source})" if source else "")


def _not_allowed(value: Any, allowed: Sequence[str]) -> str:
    return f": {quote(value)} is not allowed{_nearest(str(value), allowed)}; allowed: {', '.join(allowed)}"


def _keys_at(model: type[BaseModel], location: Location) -> list[str]:
    """Return the keys that `model` allows in the section at `location`."""
    annotation: Any = model
    for part in location:
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            annotation = annotation.model_fields[str(part)].annotation
        else:
            annotation = [item for item in typing.get_args(annotation) if item is not ...][-1]  # of dict[str, Section]
        if isinstance(annotation, types.UnionType):
            annotation = typing.get_args(annotation)[0]
    return [field.alias or name for name, field in annotation.model_fields.items()]


def _nearest(word: str, allowed: Sequence[str]) -> str:
    matches = difflib.get_close_matches(word[:100], allowed, n=1, cutoff=0.5)
    return f", did you mean {matches[0]}?" if matches else ""


def _world_fits(config: RigConfig, world: WorldSection) -> Iterator[str]:
    """Yield the conflicts of world and rig: an address on another machine, or sensors that the rig does not have."""
    turner = config.turner
    if (host := turner.simulated_at) is None and not isinstance(turner, HandSection):
        yield "world: simulates an arm, a hand, or a servo whose port is socket://host:port, but turner is another"
        return
    if host is not None and not _is_loopback(host):
        key = "arm.host" if isinstance(turner, ArmSection) else f"turner.{next(iter(turner.override_host(host)))}"
        yield f"{key}: {quote(host)} must be a loopback address (127.x.y.z) when the file has a world: section"
    yield from world.misfits(turner)
    for key, port in config.ports.items():
        if not (port.startswith("socket://") and _is_loopback(urlsplit(port).hostname or "")):
            yield (
                f"{key}: {quote(port)} must be socket://host:port, at a loopback address (127.x.y.z), "
                "when the file has a world: section"
            )
    for kind, named, simulated in (
        ("sensors", config.sensors, world.sensors),
        ("magnetometers", config.magnetometers, world.magnetometers),
    ):
        for name in sorted(set(named) ^ set(simulated)):
            where = f"world.{kind}" if name in named else kind
            yield f"{where}.{name}: missing; every sensor has a section both in {kind} and in world.{kind}"
    yield from _instruments_fit(config, world)


def _instruments_fit(config: RigConfig, world: WorldSection) -> Iterator[str]:
    """Yield a conflict for each sensor that the world simulates as an instrument but the rig reads in another way."""
    for name in sorted(config.sensors.keys() & world.sensors.keys()):
        where = "the sensor is on the board" if name in config.on_board else "the sensor is at another's port"
        if world.sensors[name].kvh1775 is not None and config.sensors[name].part != "kvh1775":
            yield f"world.sensors.{name}.kvh1775: no such instrument; {where}"
        if world.sensors[name].autopilot is not None and config.sensors[name].mavlink is None:
            yield f"world.sensors.{name}.autopilot: no such instrument; {where}"
        printed, printer = config.sensors[name].lines, world.sensors[name].lines
        if printer is not None and printed is None:
            yield f"world.sensors.{name}.lines: no such device; the sensor is a {config.sensors[name].part}"
        if printer is not None and printed is not None:
            for scalar in sorted(printer.scalars.keys() - printed.scalars.keys()):
                yield f"world.sensors.{name}.lines.scalars: sensors.{name}.lines.scalars has no {quote(scalar)}"


def _is_loopback(host: str) -> bool:
    """Return whether a host is this machine; 127.example.org, which also begins with 127, is not."""
    try:
        return host == "localhost" or ipaddress.IPv4Address(host).is_loopback
    except ValueError:
        return False

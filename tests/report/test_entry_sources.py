"""The table of what each entry of `result.json` takes: it holds today, and a private name changes no file."""

from dataclasses import dataclass
from importlib import import_module
from pkgutil import walk_packages
from types import MappingProxyType

import pytest

from firmware_host import answers
from rig.data.entries.budget import ClockComparisonEntry
from rig.report.entry import entry
from rig.report.entry_sources import SOURCES, Row


@dataclass(frozen=True)
class Comparison:
    """What is written: `error` and `std`, and a private name that is a key of the entry as well."""

    by: str = "the computer's clock"
    error: float = 1e-6
    std: float = 2e-6
    clock: str = "a private name that happens to be a key"


@dataclass(frozen=True)
class Renamed:
    """The same with another private name for what fills a key."""

    by: str = "the computer's clock"
    deviation: float = 1e-6
    std: float = 2e-6


@pytest.fixture(autouse=True)
def table(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the entry be filled from these classes."""
    rows = (Row(("Comparison", "Renamed"), {"clock": "by", "error": "error", "std": "std"}),)
    monkeypatch.setattr("rig.report.entry_sources.SOURCES", MappingProxyType({ClockComparisonEntry: rows}))


def test_a_key_is_filled_by_the_table_and_not_by_an_attribute_of_its_name() -> None:
    assert entry(ClockComparisonEntry, Comparison()).model_dump() == {
        "clock": "the computer's clock",
        "error": 1e-6,
        "std": 2e-6,
    }


def test_a_private_rename_is_an_error_and_no_missing_key() -> None:
    with pytest.raises(AttributeError, match="error"):
        entry(ClockComparisonEntry, Renamed())


def test_a_source_without_a_row_is_refused() -> None:
    with pytest.raises(TypeError, match="ClockComparisonEntry takes from float"):
        entry(ClockComparisonEntry, 1.0)


def _names(cls: type) -> set[str]:
    return {*dir(cls), *(name for base in cls.__mro__ for name in getattr(base, "__annotations__", {}))}


def _classes() -> dict[str, list[type]]:
    """Return the classes of the analysis, and of what it is made from, by name."""
    rooms = ("analysis", "estimation", "observation", "data")
    folders = [package for room in rooms for package in import_module(f"rig.{room}").__path__]
    walked = [walk_packages([folder], f"rig.{room}.") for folder, room in zip(folders, rooms, strict=True)]
    modules = [import_module(info.name) for infos in walked for info in infos] + [answers]
    classes: dict[str, list[type]] = {}
    for module in modules:
        for name, cls in vars(module).items():
            if isinstance(cls, type) and cls.__module__ == module.__name__:
                classes.setdefault(name, []).append(cls)
    return classes


def test_every_row_names_keys_classes_and_attributes_that_there_are() -> None:
    rows = [(kind, row) for kind, of in SOURCES.items() for row in of]
    classes = _classes()
    assert not [(kind.__name__, key) for kind, row in rows for key in row.attributes.keys() - kind.model_fields.keys()]
    assert not [
        (kind.__name__, name)
        for kind, row in rows
        for name in row.classes
        if not any(set(row.attributes.values()) <= _names(cls) for cls in classes.get(name, ()))
    ]

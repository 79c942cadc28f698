"""The lock file has all that `make demo` needs, each file by its hash, and nothing about where to get it."""

import re
import tomllib

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from support.paths import ROOT

TEXT = (ROOT / "requirements" / "demo.txt").read_text(encoding="utf-8")
ENTRIES = [entry for entry in re.split(r"^(?=[a-z])", TEXT, flags=re.MULTILINE) if not entry.startswith("#")]
PINS = [Requirement(entry.split("\\")[0]) for entry in ENTRIES]


@pytest.mark.parametrize("python", ["3.11", "3.12"])
def test_every_requirement_is_pinned_within_its_range(python: str) -> None:
    environment = {"python_version": python, "python_full_version": f"{python}.0", "extra": ""}
    pinned = {
        canonicalize_name(pin.name): str(pin.specifier).removeprefix("==")
        for pin in PINS
        if pin.marker is None or pin.marker.evaluate(environment)
    }
    document = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = document["project"]
    wanted = [
        *project["dependencies"],
        *project["optional-dependencies"]["world"],
        *document["build-system"]["requires"],
    ]
    outside = [
        line
        for line in wanted
        if not (asked := Requirement(line)).specifier.contains(pinned.get(canonicalize_name(asked.name), "0"))
    ]
    assert not outside, f"again: make lock ({outside})"


def test_every_file_has_its_hash_and_comes_from_wherever_the_reader_gets_packages() -> None:
    for entry, pin in zip(ENTRIES, PINS, strict=True):
        assert re.fullmatch(r"==[0-9][0-9a-z.]*", str(pin.specifier)), pin
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", entry), pin
    assert "://" not in TEXT and "--index" not in TEXT and "--find-links" not in TEXT

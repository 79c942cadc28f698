"""The maker's description of the chip, register by register."""

import xml.etree.ElementTree as ET
import zipfile
from functools import cache
from pathlib import Path


@cache
def device() -> ET.Element:
    """Return the maker's description of the STM32L4x2, from pyOCD's wheel."""
    import pyocd  # with all its probes and targets

    archive = Path(pyocd.__file__).parent / "debug" / "svd" / "svd_data.zip"
    with zipfile.ZipFile(archive) as data:
        return ET.fromstring(data.read("STM32L4x2.svd"))


@cache
def peripherals() -> dict[str | None, ET.Element]:
    """Return the peripherals by name."""
    return {p.findtext("name"): p for p in device().iter("peripheral")}


@cache
def interrupts() -> dict[str | None, int]:
    """Return the interrupts' numbers by name."""
    return {i.findtext("name"): int(i.findtext("value", "")) for i in device().iter("interrupt")}


def number(element: ET.Element, tag: str) -> int:
    return int(element.findtext(tag, ""), 0)


def register(peripheral: str, name: str) -> ET.Element:
    """Return a register's description, also of a peripheral that is described as a copy of another."""
    element = peripherals()[peripheral]
    element = peripherals()[element.get("derivedFrom", peripheral)]
    return next(r for r in element.iter("register") if r.findtext("name") == name)

"""The chip as its maker describes it, register by register."""

import xml.etree.ElementTree as ET
import zipfile
from functools import cache
from pathlib import Path


@cache
def device() -> ET.Element:
    """The maker's description of the STM32L4x2, as pyOCD's wheel carries it."""
    import pyocd  # with all its probes and targets

    archive = Path(pyocd.__file__).parent / "debug" / "svd" / "svd_data.zip"
    with zipfile.ZipFile(archive) as data:
        return ET.fromstring(data.read("STM32L4x2.svd"))


@cache
def peripherals() -> dict[str | None, ET.Element]:
    """The peripherals by their names."""
    return {p.findtext("name"): p for p in device().iter("peripheral")}


@cache
def interrupts() -> dict[str | None, int]:
    """The numbers of the interrupts by their names."""
    return {i.findtext("name"): int(i.findtext("value", "")) for i in device().iter("interrupt")}


def number(element: ET.Element, tag: str) -> int:
    return int(element.findtext(tag, ""), 0)


def register(peripheral: str, name: str) -> ET.Element:
    """A register's description, also where one peripheral is described as a copy of another."""
    element = peripherals()[peripheral]
    element = peripherals()[element.get("derivedFrom", peripheral)]
    return next(r for r in element.iter("register") if r.findtext("name") == name)

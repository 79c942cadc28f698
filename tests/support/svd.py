"""The chip as its maker describes it, register by register."""

import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import pyocd


def svd() -> ET.Element:
    """The maker's description of the STM32L4x2, as pyOCD's wheel carries it."""
    archive = Path(pyocd.__file__).parent / "debug" / "svd" / "svd_data.zip"
    with zipfile.ZipFile(archive) as data:
        return ET.fromstring(data.read("STM32L4x2.svd"))


DEVICE = svd()
PERIPHERALS = {p.findtext("name"): p for p in DEVICE.iter("peripheral")}
INTERRUPTS = {i.findtext("name"): int(i.findtext("value", "")) for i in DEVICE.iter("interrupt")}


def number(element: ET.Element, tag: str) -> int:
    return int(element.findtext(tag, ""), 0)


def register(peripheral: str, name: str) -> ET.Element:
    """A register's description, also where one peripheral is described as a copy of another."""
    element = PERIPHERALS[peripheral]
    element = PERIPHERALS[element.get("derivedFrom", peripheral)]
    return next(r for r in element.iter("register") if r.findtext("name") == name)

"""Finds the configurations and examples that come with the program, in its wheel or its checkout."""

from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2]
NAMES = ("configs", "examples", "docs/examples", "docs/config.schema.json")  # as in setup.py


def locate_supplied(name: str) -> Path:
    """Return the location of a supplied file or folder, given its path in the checkout: `configs/demo.yaml`."""
    in_wheel = PACKAGE / "supplied" / name
    return in_wheel if in_wheel.exists() else PACKAGE.parent / name

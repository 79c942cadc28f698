"""Recordings that nobody here made, of sensors turned by hand and before cameras.

They are no part of this project; their README says whose they are. They are looked for in the folder
RIG_REAL_RECORDINGS names and in shared/real beside the repository.
"""

import gzip
import os
from pathlib import Path

import pytest

from support.paths import ROOT

PLACES = [Path(os.environ.get("RIG_REAL_RECORDINGS", "")), ROOT.parent / "shared" / "real"]


def recording(name: str) -> Path:
    """The folder of one; the test is skipped, by name, where there is none."""
    for root in PLACES:
        if (root / name).is_dir():
            return root / name
    pytest.skip("recordings of others are not here: set RIG_REAL_RECORDINGS to their folder")


def unpack(name: str, file: str, folder: Path) -> Path:
    """A file of one, as a user has it, in a folder of the test's."""
    packed = recording(name) / f"{file}.gz"
    path = folder / file
    path.write_bytes(
        gzip.decompress(packed.read_bytes()) if packed.is_file() else (recording(name) / file).read_bytes()
    )
    return path

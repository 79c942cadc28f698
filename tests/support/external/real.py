"""Other people's recordings of sensors turned by hand and in front of cameras.

They are no part of this project; their README names the owners. They are searched in the folder named by
RIG_REAL_RECORDINGS and in shared/real next to the repository.
"""

import gzip
import os
from pathlib import Path

import pytest

from support.paths import ROOT

PLACES = [Path(os.environ.get("RIG_REAL_RECORDINGS", "")), ROOT.parent / "shared" / "real"]


def recording(name: str) -> Path:
    """Return the folder of a recording; skip the test, with a reason, if it is not available."""
    for root in PLACES:
        if (root / name).is_dir():
            return root / name
    pytest.skip("recordings of others are not here: set RIG_REAL_RECORDINGS to their folder")


def unpack(name: str, file: str, folder: Path) -> Path:
    """Unpack a file of a recording into the test's `folder`, as a user has it; return its path."""
    packed = recording(name) / f"{file}.gz"
    path = folder / file
    path.write_bytes(
        gzip.decompress(packed.read_bytes()) if packed.is_file() else (recording(name) / file).read_bytes()
    )
    return path

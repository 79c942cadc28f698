"""A wall clock that can be set while a program runs: `clock_shift.c`, preloaded into it."""

import subprocess
from pathlib import Path

SOURCE = Path(__file__).with_name("clock_shift.c")
FILE = "clock_shift"  # in the folder of the run: by how many seconds


def shift_clock(folder: Path) -> dict[str, str]:
    """Return the environment of a program whose clock is shifted by the seconds in `folder`/clock_shift; needs gcc."""
    library = folder / "clock_shift.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O2", "-o", library, SOURCE, "-ldl"], check=True)
    return {"LD_PRELOAD": str(library), "CLOCK_SHIFT_FILE": str(folder / FILE)}

"""What lies where in a run folder, and how to go on with one."""

import shlex
from datetime import UTC, datetime
from pathlib import Path

from rig.config.load import Loaded
from rig.errors import Refused

CONFIG, SCRIPT, RESULT = "config.yaml", "script.py", "result.json"
_BEGINNINGS = {"raw": "run", "calibrated": "verify"}  # of the names of recordings, by what is streamed


def new_folder(out: Path | None, loaded: Loaded, script: str) -> Path:
    """A run folder with the configuration as used and the script's text, nothing else. Raises Refused `run_folder`."""
    stamp = datetime.now(UTC).strftime("%Y-%m-%dT%H-%M-%SZ")
    folder = out or Path(loaded.config.output.folder) / f"{stamp}-{loaded.config.procedure.name}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        empty = not any(folder.iterdir())
        if empty:
            (folder / SCRIPT).write_text(script, encoding="utf-8")
            (folder / CONFIG).write_text(loaded.text, encoding="utf-8")
    except OSError as error:
        raise Refused("run_folder", f"{folder} cannot be written: {error}", "Choose another with --out") from error
    if not empty:
        raise Refused(
            "run_folder", f"{folder} is not empty", f"Choose another with --out, or go on with: {resuming(folder)}"
        )
    return folder


def recordings(folder: Path, readings: str) -> list[Path]:
    """The recordings of "raw" or of "calibrated" readings, in the order they were made: run.h5, run-2.h5, …"""
    return sorted(folder.glob(f"{_BEGINNINGS[readings]}*.h5"), key=lambda path: (len(path.name), path.name))


def next_recording(folder: Path, readings: str) -> Path:
    """Where the next one goes."""
    count = len(recordings(folder, readings))
    return folder / f"{_BEGINNINGS[readings]}{f'-{count + 1}' if count else ''}.h5"


def resuming(folder: Path) -> str:
    """The command that goes on with an interrupted run."""
    return f"rig resume {shlex.quote(str(folder))}"

"""The files of a run folder, and the command that resumes a run."""

import itertools
import json
import shlex
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.data.latest_run import note_run
from rig.data.validation import validate
from rig.errors import Refused

if TYPE_CHECKING:
    from rig.config.load import Loaded

CONFIG, SCRIPT, RESULT, CERTIFICATE = "config.yaml", "script.py", "result.json", "certificate.html"
SCRIPT_IDENTITY = "script.json"
TRUTH_FILE = "truth.json"  # a file of a simulated laboratory, for people; no estimator reads it
LATENESS_FILE = "world_late.txt"  # the causes of late steps of the simulated laboratory
LOG, ARM_LOG = "log.txt", "arm_client.log"
IDENTITY_MAX_BYTES = 10_000
_BEGINNINGS = {"raw": "run", "calibrated": "verify"}  # beginnings of the names of recordings, by what is streamed


@dataclass(frozen=True, slots=True)
class ScriptIdentity:
    """The script with which a run was begun: the name of its file, and the SHA-256 of its text in hexadecimal."""

    name: str
    sha256: str


def new_folder(out: Path | None, loaded: "Loaded", script: str, identity: ScriptIdentity) -> Path:
    """Make and return a run folder with the configuration as used and the script. Raise Refused `run_folder`."""
    parent = Path(loaded.config.output.folder)
    with refuse_unwritable(out or parent):
        folder = out or folder_of_its_own(parent, loaded.config.procedure.name)
        empty_folder(folder, or_else=f", or go on with: {resuming(folder)}")
        note_run(folder)
        _write_all(folder, {SCRIPT: script, SCRIPT_IDENTITY: json.dumps(asdict(identity)) + "\n", CONFIG: loaded.text})
    return folder


def discard(folder: Path) -> None:
    """Remove a new run folder without measurements, unless it holds other files."""
    begun = [folder / name for name in (CONFIG, SCRIPT, SCRIPT_IDENTITY, LATENESS_FILE, TRUTH_FILE, LOG, ARM_LOG)]
    with suppress(OSError):
        for path in [*begun, *(file for readings in _BEGINNINGS for file in recordings(folder, readings))]:
            path.unlink(missing_ok=True)
        folder.rmdir()


def empty_folder(folder: Path, *, or_else: str = "") -> Path:
    """Make the folder, or return it if it is empty. Raise Refused `run_folder`, with `or_else` as a further remedy."""
    with refuse_unwritable(folder):
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise Refused("run_folder", f"{folder} is not empty", f"Choose another with --out{or_else}")
    return folder


@contextmanager
def refuse_unwritable(folder: Path) -> Iterator[None]:
    """Raise Refused `run_folder` if the folder cannot be written."""
    try:
        yield
    except OSError as error:
        raise Refused("run_folder", f"{folder} cannot be written: {error}", "Choose another with --out") from error


def _write_all(folder: Path, texts: Mapping[str, str]) -> None:
    """Write all new files or, on a full disk, no file, so that no run resumes from half a configuration."""
    begun: list[Path] = []
    try:
        for name, text in texts.items():
            # If two runs create it simultaneously, only one succeeds.
            with (folder / name).open("x", encoding="utf-8", newline="") as file:
                begun.append(folder / name)
                file.write(text)
    except OSError:
        for path in begun:
            path.unlink()
        raise


def folder_of_its_own(parent: Path, what: str) -> Path:
    """Make and return a new folder named by the time and its content `what`, and numbered if the name exists."""
    parent.mkdir(parents=True, exist_ok=True)
    name = f"{datetime.now(UTC):%Y-%m-%dT%H-%M-%SZ}-{what}"
    folder, numbers = parent / name, itertools.count(2)
    while True:
        with suppress(FileExistsError):
            folder.mkdir()
            return folder
        folder = parent / f"{name}-{next(numbers)}"


def script_identity(folder: Path) -> ScriptIdentity:
    """Return the script with which a run folder was begun. Raise Refused `another_script` if it is unknown."""
    path = folder / SCRIPT_IDENTITY
    try:
        return validate(ScriptIdentity, json.loads(read_regular_file(path, IDENTITY_MAX_BYTES)), "script")
    except (UnfitFile, OSError, ValueError, RecursionError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise Refused(
            "another_script",
            f"{path} does not state which script the run began with ({why})",
            "Start a new run with `rig run`",
        ) from error


def recordings(folder: Path, readings: str) -> list[Path]:
    """Return the recordings of "raw" or "calibrated" readings in order: run.h5, run-2.h5, …"""
    return sorted(folder.glob(f"{_BEGINNINGS[readings]}*.h5"), key=lambda path: (len(path.name), path.name))


def next_recording(folder: Path, readings: str) -> Path:
    """Return the path of the next recording."""
    count = len(recordings(folder, readings))
    return folder / f"{_BEGINNINGS[readings]}{f'-{count + 1}' if count else ''}.h5"


def resuming(folder: Path) -> str:
    """Return the command that resumes an interrupted run."""
    return f"rig resume {shlex.quote(str(folder))}"


def refuse_links(*paths: Path) -> None:
    """Refuse to write through a link, or into a pipe, that another user may have put into a folder.

    Raise Refused `not_written_through` if a path exists and is neither a regular file nor a folder.
    """
    for path in paths:
        if path.is_symlink() or (path.exists() and not (path.is_file() or path.is_dir())):
            raise Refused(
                "not_written_through",
                f"{path} is a link, a pipe or a device, and the rig does not write through it",
                "Look where the link leads; remove it, or name another folder with --out",
            )

"""The run folders that this user ran last, newest at the end, for `latest` in place of a run folder."""

from contextlib import suppress
from pathlib import Path

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.config.files.safe_writing import write_new
from rig.config.files.user_folder import rig_folder
from rig.errors import Refused

LATEST = "latest"
MAX_FOLDERS = 20  # the newest may be removed
_LIST_MAX_BYTES = 1_000_000


def note_run(folder: Path) -> None:
    """Remember `folder` as this user's latest run; ignore errors."""
    with suppress(OSError, Refused):
        path = _list()
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        new = str(folder.resolve())
        earlier = [noted for noted in _read_noted() if noted != new]
        write_new(path, "".join(f"{noted}\n" for noted in [*earlier, new][-MAX_FOLDERS:]))


def latest_run() -> Path:
    """Return the newest remembered run folder that still exists. Raise Refused `no_latest_run`."""
    for noted in reversed(_read_noted()):
        if (folder := Path(noted)).is_dir():
            return folder.relative_to(Path.cwd()) if folder.is_relative_to(Path.cwd()) else folder
    raise Refused(
        "no_latest_run", "no run folder of yours is known", "Name the run folder; `rig demo` makes a first one"
    )


def meant_run(path: str | Path) -> Path:
    """Return the path that a user names; `latest` as its first part stands for the folder of the user's latest run.

    If a file `latest` exists, this file is meant. Raise as `latest_run` does.
    """
    first, *rest = Path(path).parts or (".",)
    return latest_run().joinpath(*rest) if first == LATEST and not Path(LATEST).exists() else Path(path)


def _read_noted() -> list[str]:
    with suppress(OSError, UnfitFile, UnicodeDecodeError, Refused):
        return read_regular_file(_list(), _LIST_MAX_BYTES).decode().splitlines()
    return []


def _list() -> Path:
    return rig_folder() / "latest_runs"

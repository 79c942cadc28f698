"""The process that reads one file: `python -m rig.data.processes.reading_child`, or a forked one.

It writes to stdout, for `rig.data.processes.reading_process`, the parts that the reader yields: a line of JSON for a
dict, an array in NumPy's format. A failure ends in one line on stderr and a `Status`.
"""

import errno
import io
import json
import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, BinaryIO, NoReturn

import numpy as np

from rig.data.processes.reading_parts import Part, Status
from rig.errors import Refused

_SIGNAL_AT_PARENTS_DEATH = 1  # PR_SET_PDEATHSIG of prctl(2)


def read_and_end(request: Mapping[str, Any]) -> NoReturn:
    """Read the file of a `ReadingTask` (`request`), write its parts to stdout, and end this process."""
    limits: Mapping[str, Any] = request["limits"]
    _end_with_parent()
    written_bytes = _limit(limits)
    try:
        with _output() as out:
            read: Callable[..., Iterator[Part]] = resolve_name(request["reader"])
            for part in read(Path(request["path"]), **request["arguments"]):
                out.write(_encode(part))
    except Refused as refused:
        _exit_at_once(Status.REFUSED, json.dumps(refused.problem))
    except MemoryError:
        _exit_at_once(Status.NO_MEMORY)
    except Exception as error:  # of any kind: a damaged file may raise anything
        code = error.errno if isinstance(error, OSError) else None
        if code == errno.EFBIG and written_bytes == limits["written_bytes"]:
            _exit_at_once(Status.TOO_LONG)
        if code in (errno.EFBIG, errno.ENOSPC, errno.EDQUOT):
            _exit_at_once(Status.NO_ROOM, str(error))
        _exit_at_once(Status.UNREADABLE, " ".join(str(error).split()).rstrip(".") or type(error).__name__)
    _exit_at_once(Status.READ)


def _output() -> BinaryIO:
    """Return the original stdout, and redirect stdout to nowhere, because libraries print to it."""
    out = os.fdopen(os.dup(1), "wb")
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    return out


def _encode(part: Part) -> bytes:
    if isinstance(part, dict):
        return json.dumps(part).encode() + b"\n"
    encoded = io.BytesIO()
    np.save(encoded, part, allow_pickle=False)
    return encoded.getvalue()


def _end_with_parent() -> None:
    """Make the system kill this process when its parent ends, and make this process ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(_SIGNAL_AT_PARENTS_DEATH, signal.SIGKILL)


def _limit(limits: Mapping[str, Any]) -> int | None:
    """Limit this process's resources; return the largest file, bytes, that it may write, None on Windows."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows
        return None
    processor_s = int(limits["processor_s"]) + 1
    _lower(resource.RLIMIT_CORE, 0)
    _lower(resource.RLIMIT_AS, limits["memory_bytes"])
    _lower(resource.RLIMIT_CPU, processor_s)
    return _lower(resource.RLIMIT_FSIZE, limits["written_bytes"])


def _lower(what: int, limit: int) -> int:
    """Lower a limit of this process to `limit` at most; return the resulting limit."""
    import resource

    soft, hard = resource.getrlimit(what)
    limit = min(limit, *(current for current in (soft, hard) if current != resource.RLIM_INFINITY), limit)
    resource.setrlimit(what, (limit, hard))
    return limit


def _exit_at_once(status: Status, why: str = "") -> NoReturn:
    """Exit without closing files, because HDF5 may fail to close a file that it failed to open."""
    os.write(2, f"{why}\n".encode(errors="replace") if why else b"")
    os._exit(status)


if __name__ == "__main__":
    read_and_end(json.load(sys.stdin))

"""Reading of a foreign file in a process of its own, within limits of memory, time and disk space.

A library may never return from a damaged file, or unpack a few bytes to gigabytes, and nothing inside the process can
end that. So foreign files (recordings, bags, logs, tables) are read in a process that can be ended from outside
(`rig.data.processes.reading_child`), and only complete results reach the rig.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, BinaryIO, Self

from rig.config.files.regular_file import RECORDING_MAX_BYTES, UnfitFile, open_regular_file
from rig.data.processes.forked_reader import HDF5_PLUGINS, ForkedReader, can_fork, measure_address_space
from rig.data.processes.process_silence import Silence
from rig.data.processes.reading_parts import Part, Status
from rig.errors import Refused
from rig.errors.quoting import printable

if TYPE_CHECKING:
    pass

Reader = Callable[..., Iterator[Part]]

MAX_FILES = 10_000  # in a folder: a bag is split into one for every minute or gigabyte
MAX_UNPACKED_RATIO = 20  # to stored size: noisy readings unpack to a quarter of that, zeros to a thousand times
SPARE_BYTES = 32_000_000  # margin for small files, in addition to that ratio
# Address space, half of which the libraries take; and more per byte of the file.
MEMORY_BYTES, MEMORY_TIMES_STORED = 320 << 20, 2
PROCESSOR_S, PROCESSOR_S_PER_BYTE = 8.0, 1e-6  # a slow computer reads 3 MB of readings a second, packed 1 MB
IDLE_DURATION_RATIO = 1.5  # of the total duration on an idle computer to the processor time
TICK_S, MAX_EXIT_S = 0.1, 1.0
MAX_STARVED_FACTOR = 6  # on that duration while the reading process gets no processor
# A foreign file must load no plugin of HDF5; and threads for linear algebra would reserve gigabytes of memory.
ENVIRONMENT = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "OMP", "MKL")} | HDF5_PLUGINS
MAX_COMPLAINT_BYTES = 65_536
MAX_REASON_CHARACTERS = 300
TIME_LIMIT_SIGNAL = getattr(signal, "SIGXCPU", None)  # to a process that has used up its time


@dataclass(frozen=True, slots=True)
class ReadingLimits:
    """The limits of a process that reads a file.

    - `memory_bytes`: address space.
    - `processor_s`: time on a processor.
    - `idle_s`: time until its end, in which waits for a processor or for the disk do not count.
    - `written_bytes`: the size of each file that it writes, for its results and for unpacking.
    """

    memory_bytes: int
    processor_s: float
    idle_s: float
    written_bytes: int


class UnreadableFile(Exception):
    """The reason why a file was not read, as the end of the sentence that names it."""


class CostlyFile(UnreadableFile):
    """A file that takes more time or memory to read than its size allows."""


def limits_for(stored_bytes: int) -> ReadingLimits:
    """Return the limits for reading a file, or a folder of files, by its size on the disk."""
    processor_s = PROCESSOR_S + PROCESSOR_S_PER_BYTE * stored_bytes
    return ReadingLimits(
        memory_bytes=MEMORY_BYTES + MEMORY_TIMES_STORED * stored_bytes,
        processor_s=processor_s,
        idle_s=IDLE_DURATION_RATIO * processor_s,
        written_bytes=SPARE_BYTES + MAX_UNPACKED_RATIO * stored_bytes,
    )


def stored_bytes(path: Path) -> int:
    """Return the size on the disk of a regular file, or of all files directly in a folder.

    Raise `UnfitFile` for a pipe, a device, a socket, a file that is mostly holes, and a folder of too many files;
    OSError as `open` does.
    """
    if not path.is_dir():
        return _file_size_on_disk(path)
    with os.scandir(path) as entries:
        files = [entry.name for entry in islice(entries, MAX_FILES + 1) if not entry.is_dir()]
    if len(files) > MAX_FILES:
        raise UnfitFile(f"it holds more than {MAX_FILES} files")
    return sum(_file_size_on_disk(path / name, f"{name!r:.60}") for name in files)


def _file_size_on_disk(path: Path, name: str = "it") -> int:
    """Return a file's size on the disk, without holes. Raise UnfitFile if its full size is too large in comparison."""
    try:
        with open_regular_file(path, RECORDING_MAX_BYTES) as file:
            size, stored = os.fstat(file.fileno()).st_size, size_without_holes(file)
    except UnfitFile as error:
        raise UnfitFile(str(error).replace("it ", f"{name} ", 1)) from None
    if size > MAX_UNPACKED_RATIO * stored + SPARE_BYTES:
        raise UnfitFile(f"{name} expands {stored} bytes to {size}")
    return stored


def size_without_holes(file: BinaryIO) -> int:
    """Return the size of an open file without its holes; the full size if the system does not state it."""
    size = os.fstat(file.fileno()).st_size
    if not hasattr(os, "SEEK_DATA"):
        return size
    stored = end = 0
    while end < size:
        try:
            start = os.lseek(file.fileno(), end, os.SEEK_DATA)
        except OSError:  # no more data
            break
        end = os.lseek(file.fileno(), start, os.SEEK_HOLE)
        stored += end - start
    os.lseek(file.fileno(), 0, os.SEEK_SET)
    return stored


class ReadingTask:
    """A file that another process reads by a `reader` ("module:function"), called with its path and `arguments`.

    The arguments are JSON values. The process starts at once, so the caller may import modules meanwhile; leaving the
    context ends it. Raise Refused `temporary_folder_full`.
    """

    def __init__(self, reader: str, path: Path, arguments: Mapping[str, Any], limits: ReadingLimits) -> None:
        request = {"reader": reader, "path": str(path), "arguments": arguments, "limits": asdict(limits)}
        self._path, self._limits = path, limits
        with ExitStack() as stack:
            try:
                spare, self._out = (stack.enter_context(tempfile.TemporaryFile()) for _ in range(2))
                room = stack.enter_context(tempfile.TemporaryDirectory(prefix="rig-reads-", ignore_cleanup_errors=True))
                if not (forking := can_fork()):
                    spare.write(json.dumps(request).encode())
                    spare.seek(0)
            except OSError as error:
                raise _no_room(path, str(error)) from error
            environment = ENVIRONMENT | dict.fromkeys(("TMPDIR", "SQLITE_TMPDIR"), room)
            self._process = (
                _fork(request, self._out, spare, environment) if forking else _start(spare, self._out, environment)
            )
            stack.callback(_kill, self._process)
            self._ending = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.close()

    def parts(self) -> list[Part]:
        """Return the parts that the reader yields, once it has ended.

        Raise `UnreadableFile` for a file that cannot be read, `CostlyFile` for one beyond the limits, Refused
        `temporary_folder_full`, and the errors that the reader raises.
        """
        try:
            complaint = _wait_for(self._process, self._limits.idle_s)
        except TimeoutError:
            raise CostlyFile(f"no end of it was found in {self._limits.idle_s:.0f} s") from None
        finally:
            _kill(self._process)
        if self._process.returncode == Status.NO_ROOM:
            raise _no_room(self._path, complaint.decode(errors="replace").strip())
        assert self._process.returncode is not None, "it has ended"
        _raise_failure(self._process.returncode, complaint, self._limits)
        self._out.seek(0)
        return list(_parts(self._out))


def _start(request: BinaryIO, out: BinaryIO, environment: Mapping[str, str]) -> "subprocess.Popen[bytes]":
    """Start a process that reads the file of the `request`, and return it."""
    # Not from the working folder, where any file could pass for a module, but by this process' own search path.
    command = [sys.executable, "-P", "-m", "rig.data.processes.reading_child"]
    environment = {**os.environ, **environment, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.Popen(command, stdin=request, stdout=out, stderr=subprocess.PIPE, env=environment)


def _fork(
    request: Mapping[str, Any], out: BinaryIO, complaints: BinaryIO, environment: Mapping[str, str]
) -> ForkedReader:
    """Fork a process from this one that reads the file, and return it."""
    from rig.data.processes.reading_child import read_and_end

    limits = request["limits"]
    own_bytes = limits["memory_bytes"] + measure_address_space()
    request = {**request, "limits": {**limits, "memory_bytes": own_bytes}}
    return ForkedReader(lambda: read_and_end(request), out, complaints, environment)


def read_apart(reader: str, path: Path, arguments: Mapping[str, Any], limits: ReadingLimits) -> list[Part]:
    """Return the parts that a `reader` ("module:function") yields of a file, in a process of its own with `limits`.

    Raise as `ReadingTask.parts` does.
    """
    with ReadingTask(reader, path, arguments, limits) as reading:
        return reading.parts()


def _wait_for(reading: "subprocess.Popen[bytes] | ForkedReader", idle_s: float) -> bytes:
    """Return the process' output on stderr, once it has ended.

    Raise TimeoutError if it has been idle for `idle_s`; time spent waiting for a processor or the disk does not count.
    Wall time is measured, because a hanging library may sleep and so use no processor time.
    """
    silent = Silence(reading.pid, spared=MAX_STARVED_FACTOR)
    while not silent.lasts_over(idle_s / TICK_S):
        try:
            return reading.communicate(timeout=TICK_S)[1]
        except subprocess.TimeoutExpired:
            silent.tick()
    raise TimeoutError


def _kill(reading: "subprocess.Popen[bytes] | ForkedReader") -> None:
    """Kill the process, and wait a limited time for its end, which a dead disk may delay."""
    reading.kill()
    with suppress(subprocess.TimeoutExpired):
        reading.wait(MAX_EXIT_S)
    if reading.stderr is not None:
        reading.stderr.close()


def _raise_failure(status: int, complaint: bytes, limits: ReadingLimits) -> None:
    """Raise as `read_apart` does if the process' exit status is a failure."""
    if status == Status.READ:
        return
    lines = complaint[-MAX_COMPLAINT_BYTES:].decode(errors="replace").strip().splitlines()
    why = printable(lines[-1]) if lines else "reading it ended the process that read it"
    if status == Status.REFUSED:
        raise Refused(*json.loads(lines[-1]))
    if status == Status.NO_MEMORY:
        raise CostlyFile(f"it takes more than {limits.memory_bytes >> 20} MiB of memory to be read")
    if status == Status.TOO_LONG:
        raise CostlyFile(f"its unpacked content is longer than {limits.written_bytes // 1_000_000} MB")
    if -status == TIME_LIMIT_SIGNAL:
        raise CostlyFile(f"it takes more than {limits.processor_s:.0f} s of a processor to be read")
    raise UnreadableFile(why if len(why) <= MAX_REASON_CHARACTERS else f"{why[:MAX_REASON_CHARACTERS]}…")


def _no_room(path: Path, why: str) -> Refused:
    return Refused(
        "temporary_folder_full",
        f"{tempfile.gettempdir()} has no room for what {path} holds ({why})",
        "Make room there, or name another folder in the environment variable TMPDIR",
    )


def _parts(out: Any) -> Iterator[Part]:
    """Yield the parts in the process' output; each is a line of JSON or an array in NumPy's format."""
    import numpy as np

    while start := out.read(1):
        out.seek(-1, os.SEEK_CUR)
        yield json.loads(out.readline()) if start == b"{" else np.load(out)

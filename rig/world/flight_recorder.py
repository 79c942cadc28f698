"""The world's flight recorder: what held a step that came late, written while it is held.

A thread looks ten times a second when the world last came round. It writes the stacks of all threads as soon as a step
is late, and the loop, once it goes on, for how long it was held and what its processor time says about the cause.
"""

import faulthandler
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from rig.config.files.written_file import open_to_append

LATE_S = 0.5  # wall time
LOOK_S = 0.1  # between two looks of the thread
RECORDS = 40  # that are written at most, so that a world that is late for good fills no disk
NS_PER_S = 1e9


class FlightRecorder:
    """Writes to the file `path`, made with the first record and never through a link; to stderr where it is None.

    `waits_for` says whom the world waits for. A record that cannot be written is lost: nothing waits for it.
    """

    def __init__(self, path: Path | None, waits_for: Callable[[], str]) -> None:
        self._path, self._waits_for = path, waits_for
        self._records = 0
        self._writing = threading.Lock()
        self._alive_s = time.monotonic()
        self._looked_s = self._alive_s
        self._ran_s, self._starved_s = processor_times()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="flight recorder", daemon=True)
        self._thread.start()

    def alive(self) -> None:
        """A step has been made, or none is due."""
        now_s = time.monotonic()
        late_s, self._alive_s = now_s - self._alive_s, now_s
        if late_s > LATE_S:
            self._account(late_s)
        if now_s - self._looked_s > LOOK_S:
            self._looked_s = now_s
            self._ran_s, self._starved_s = processor_times()

    def close(self) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        recorded_s = 0.0
        while not self._ended.wait(LOOK_S):
            began_s = self._alive_s
            if began_s != recorded_s and time.monotonic() - began_s > LATE_S:
                recorded_s = began_s
                self._dump(time.monotonic() - began_s)

    def _dump(self, late_s: float) -> None:
        self._write(f"a step is {late_s:.2f} s late; waited for: {self._waits_for()}", stacks=True)

    def _account(self, late_s: float) -> None:
        ran_s, starved_s = processor_times()
        ran_s, starved_s = ran_s - self._ran_s, starved_s - self._starved_s
        other_s = max(0.0, late_s - ran_s - starved_s)
        self._write(
            f"a step came {late_s:.2f} s late: the loop ran for {ran_s:.2f} s, waited for a processor "
            f"for {starved_s:.2f} s and {other_s:.2f} s for something else, or was stopped",
            stacks=False,
        )

    def _write(self, text: str, *, stacks: bool) -> None:
        with self._writing, suppress(OSError):
            if self._records >= RECORDS:
                return
            self._records += 1
            file = os.dup(sys.stderr.fileno()) if self._path is None else open_to_append(self._path)
            try:
                os.write(file, f"{time.strftime('%Y-%m-%d %H:%M:%S')} {text}\n".encode())
                if stacks:
                    faulthandler.dump_traceback(file, all_threads=True)
            finally:
                os.close(file)


def processor_times() -> tuple[float, float]:
    """How long this thread has run and has waited for a processor, s; 0 for the latter where proc(5) is not there."""
    try:
        ran_ns, starved_ns, _ = Path(f"/proc/self/task/{threading.get_native_id()}/schedstat").read_text().split()
    except (OSError, ValueError):
        return time.thread_time(), 0.0
    return int(ran_ns) / NS_PER_S, int(starved_ns) / NS_PER_S

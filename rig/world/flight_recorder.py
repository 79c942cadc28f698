"""The world's flight recorder: it reports the cause of a late step while the step is still delayed.

A thread checks ten times a second when the loop last completed a step. It writes the stacks of all threads as soon as a
step is late. When the loop continues, the recorder writes the delay and the processor time that the loop had during the
delay, which shows the cause.
"""

import faulthandler
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from rig.config.files.safe_writing import open_to_append

MIN_LATENESS_S = 0.5  # wall time of a tick that is late
POLL_S = 0.1  # of the thread's checks
MAX_RECORDS = 40  # so that a world that is always late does not fill the disk
NS_PER_S = 1e9


class FlightRecorder:
    """A recorder that writes to the file `path`, never through a link, or to stderr if `path` is None.

    `waits_for` names the clients for which the world waits. A record that cannot be written is lost.
    """

    def __init__(self, path: Path | None, waits_for: Callable[[], str]) -> None:
        self._path, self._waits_for = path, waits_for
        self._records = 0
        self._writing = threading.Lock()
        self._alive_s = time.monotonic()
        self._checked_s = self._alive_s
        self._ran_s, self._starved_s = read_processor_times()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="flight recorder", daemon=True)
        self._thread.start()

    def alive(self) -> None:
        """Record that a step was made, or that no step is due."""
        now_s = time.monotonic()
        late_s, self._alive_s = now_s - self._alive_s, now_s
        if late_s > MIN_LATENESS_S:
            self._account(late_s)
        if now_s - self._checked_s > POLL_S:
            self._checked_s = now_s
            self._ran_s, self._starved_s = read_processor_times()

    def close(self) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        recorded_s = 0.0
        while not self._ended.wait(POLL_S):
            began_s = self._alive_s
            if began_s != recorded_s and time.monotonic() - began_s > MIN_LATENESS_S:
                recorded_s = began_s
                self._dump(time.monotonic() - began_s)

    def _dump(self, late_s: float) -> None:
        self._write(f"a step is {late_s:.2f} s late; waited for: {self._waits_for()}", stacks=True)

    def _account(self, late_s: float) -> None:
        """Write how much of the delay the process ran, waited for a processor, or did neither."""
        ran_s, starved_s = read_processor_times()
        ran_s, starved_s = ran_s - self._ran_s, starved_s - self._starved_s
        other_s = max(0.0, late_s - ran_s - starved_s)
        self._write(
            f"a step came {late_s:.2f} s late: the loop ran for {ran_s:.2f} s, waited for a processor "
            f"for {starved_s:.2f} s and {other_s:.2f} s for something else, or was stopped",
            stacks=False,
        )

    def _write(self, text: str, *, stacks: bool) -> None:
        """Append a dated line, and on request all threads' stacks; stop after `MAX_RECORDS` records."""
        with self._writing, suppress(OSError):
            if self._records >= MAX_RECORDS:
                return
            self._records += 1
            file = os.dup(sys.stderr.fileno()) if self._path is None else open_to_append(self._path)
            try:
                os.write(file, f"{time.strftime('%Y-%m-%d %H:%M:%S')} {text}\n".encode())
                if stacks:
                    faulthandler.dump_traceback(file, all_threads=True)
            finally:
                os.close(file)


def read_processor_times() -> tuple[float, float]:
    """Return the times, s, that this thread has run and waited for a processor; the latter is 0 without proc(5)."""
    try:
        ran_ns, starved_ns, _ = Path(f"/proc/self/task/{threading.get_native_id()}/schedstat").read_text().split()
    except (OSError, ValueError):
        return time.thread_time(), 0.0
    return int(ran_ns) / NS_PER_S, int(starved_ns) / NS_PER_S

"""The thread that reads a sensor's own port: what went wrong there first, and how long nothing has come."""

import threading
import time
from collections.abc import Callable

from rig.sensors.errors import SensorError
from rig.sensors.silence import Silence


class PortReader:
    """Reads until it is closed; what each read brought goes to `take`, on its thread, with when that was.

    `news` is held while something is taken, and notified of it. What ends the reading early is a fault: that which
    `failed` makes of it, be it the port's OSError, a SensorError, or whatever a consumer raised.
    """

    def __init__(
        self,
        name: str,
        read: Callable[[], bytes],
        take: Callable[[bytes, float], None],
        failed: Callable[[Exception], SensorError],
    ) -> None:
        self.news = threading.Condition()
        self.silence = Silence()
        self.fault: SensorError | None = None
        self._read, self._take, self._failed = read, take, failed
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Begin to read."""
        self._thread.start()

    @property
    def closed(self) -> bool:
        """Whether it reads no more."""
        return self._closing.is_set()

    def close(self) -> None:
        """Ends the thread."""
        self._closing.set()
        self._thread.join()

    def fail(self, error: SensorError) -> None:
        """Makes `error` the fault, unless there is one already."""
        self.fault = self.fault or error

    def wait(self, until: Callable[[], bool], timeout_s: float) -> bool:
        """Whether it was so in time. Raises what went wrong meanwhile."""
        with self.news:
            done = self.news.wait_for(lambda: until() or self.fault is not None, timeout_s)
            if self.fault is not None:
                raise self.fault
            return done

    def silent_s(self, clock_s: float | None) -> float:
        """How long nothing has come, s, by `clock_s` too (`Silence.seen_by`). Raises what went wrong meanwhile."""
        if self.fault is not None:
            raise self.fault
        with self.news:
            return self.silence.seen_by(clock_s)

    def _run(self) -> None:
        try:
            while not self._closing.is_set():
                self._take(self._read(), time.monotonic())
        except Exception as error:  # a failing consumer must reach the caller, not end in a dead thread
            self.fail(self._failed(error))
        with self.news:
            self.news.notify_all()

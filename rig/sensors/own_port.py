"""A device's own port from its opening to its end: who reads it, what went wrong first, how long nothing has come."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Protocol

from firmware_host.serial_port import SerialPort, why_closed
from rig.sensors.errors import SensorError
from rig.sensors.silence import USUAL, Patience, Silence


class Port(Protocol):
    """An open port; `read` returns what came within `READ_TIMEOUT_S`. OSError for all that goes wrong."""

    def read(self) -> bytes: ...
    def write(self, data: bytes) -> None: ...
    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class Faults:
    """What is raised of a device when its port has closed, when it sends no more, when a consumer of it has failed.

    Each is complete but for the end of what it says: why, or for how long.
    """

    closed: SensorError
    silent: SensorError
    not_taken: SensorError

    def of(self, error: Exception) -> SensorError:
        """The fault that an error of the port or of a consumer is."""
        if isinstance(error, SensorError):
            return error
        if isinstance(error, OSError):
            return _ended(self.closed, f": {error}")
        return _ended(self.not_taken, f": {error!r}")


class OwnPort:
    """An open port and the thread that reads it until `close`; what each read brought goes to `take`, with when.

    `news` is held while something is taken, and notified of it. What ends the reading early is the `fault`, be it the
    port's OSError, a SensorError, or whatever a consumer raised.
    """

    def __init__(
        self,
        port: Port,
        name: str,
        faults: Faults,
        take: Callable[[bytes, float], None],
        *,
        patience: Patience = USUAL,
        farewell: Callable[[], None] = lambda: None,
    ) -> None:
        """`name` is the port's; `farewell` is called when it closes, while it can still be written to."""
        self.news = threading.Condition()
        self.silence = Silence()
        self.fault: SensorError | None = None
        self._port, self._faults, self._take, self._farewell = port, faults, take, farewell
        self._patience = patience
        self._most_silent_s: float | None = None  # while it streams
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reader of {name}", daemon=True)

    def begin(self) -> None:
        """Begin to read."""
        self._thread.start()

    @property
    def streams(self) -> bool:
        """Whether a silence is a fault."""
        return self._most_silent_s is not None

    def stream(self, more_s: float = 0.0) -> None:
        """Take a silence from now on for a fault, when it is longer than patience has it by `more_s`."""
        with self.news:
            self._most_silent_s, self.silence = self._patience.silent_s + more_s, Silence()

    def check(self, clock_s: float | None = None) -> None:
        """Raises what went wrong meanwhile, a silence while it streams too.

        `clock_s` is what another instrument's clock shows now, if there is one: a silence must be as long by that too.
        """
        if self.fault is not None:
            raise self.fault
        with self.news:
            silent_s = self.silence.seen_by(clock_s)
        if self._most_silent_s is not None and silent_s > self._most_silent_s:
            raise _ended(self._faults.silent, f" for {silent_s:.1f} s")

    def wait(self, until: Callable[[], bool], timeout_s: float) -> bool:
        """Whether it was so in time. Raises what went wrong meanwhile."""
        with self.news:
            done = self.news.wait_for(lambda: until() or self.fault is not None, timeout_s)
            if self.fault is not None:
                raise self.fault
            return done

    def write(self, data: bytes) -> None:
        """Send. Raises SensorError, as of a port that closed."""
        try:
            self._port.write(data)
        except OSError as error:
            raise self._faults.of(error) from error

    def close(self) -> None:
        """Says farewell, ends the thread and closes the port. May be called twice."""
        if self._closing.is_set():
            return
        with suppress(SensorError):
            self._farewell()
        self._closing.set()
        self._thread.join()
        self._port.close()

    def _run(self) -> None:
        try:
            while not self._closing.is_set():
                self._take(self._port.read(), time.monotonic())
        except Exception as error:  # a failing consumer must reach the caller, not end in a dead thread
            self.fault = self._faults.of(error)
        with self.news:
            self.news.notify_all()


def opened(
    port: str,
    baud: int,
    by: Callable[[str, int], Port] = SerialPort,
    *,
    where: str = "",
    named_by: str = "its name",
) -> Port:
    """The port, open. Raises SensorError `no_port`; `where` is whose it is, `named_by` what says which."""
    try:
        return by(port, baud)
    except OSError as error:
        raise SensorError(
            "no_port",
            f"{where}the port {port} does not open: {why_closed(port, error)}",
            f"Check {named_by} and the cable, and that no other program has the port",
        ) from error


@contextmanager
def closed_on_failure(close: Callable[[], None]) -> Iterator[None]:
    """A `with` block that sets something up, which `close` undoes where that fails."""
    try:
        yield
    except BaseException:
        close()
        raise


def _ended(error: SensorError, end: str) -> SensorError:
    return SensorError(error.name, error.what + end, error.remedy)

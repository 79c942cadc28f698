"""A device's own port from opening to close: its reader thread, its first fault, and its silence."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Protocol

from firmware_host.serial_port import SerialPort, explain_closed
from rig.sensors.errors import SensorError
from rig.sensors.port_silence import PATIENCE, Patience, PortSilence

MAX_CATCH_UP_S = 60.0  # to read what has arrived, however busy the computer


class DevicePort(Protocol):
    """An open port; `read` returns all data received within `READ_TIMEOUT_S`. All errors are OSErrors."""

    def read(self) -> bytes: ...
    def write(self, data: bytes) -> None: ...
    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class PortFaults:
    """The errors of a device if its port has closed, if it is silent, or if a consumer of its data has failed.

    When such an error is raised, the reason, or the duration of the silence, is added to its message.
    """

    closed: SensorError
    silent: SensorError
    not_taken: SensorError

    def complete(self, error: Exception) -> SensorError:
        """Return the fault for an error of the port or of a consumer, with the reason."""
        if isinstance(error, SensorError):
            return error
        if isinstance(error, OSError):
            return _complete_error(self.closed, f": {error}")
        return _complete_error(self.not_taken, f": {error!r}")


class OwnPort:
    """An open port and the thread that reads it until `close`; `take` gets the data and the time of each read.

    The condition `news` is locked during `take`, and notified after it. The first error that ends the reading becomes
    the `fault`: the port's OSError, a SensorError, or an error of a consumer.
    """

    def __init__(
        self,
        port: DevicePort,
        name: str,
        faults: PortFaults,
        take: Callable[[bytes, float], None],
        *,
        patience: Patience = PATIENCE,
        farewell: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare the reader of the port called `name`; `farewell` is called before the port closes."""
        self.news = threading.Condition()
        self.silence = PortSilence()
        self.fault: SensorError | None = None
        self._port, self._faults, self._take, self._farewell = port, faults, take, farewell
        self._patience = patience
        self._reads = 0
        self._most_silent_s: float | None = None  # set while data are streamed
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
        """Treat from now on a silence longer than `Patience.silent_s` plus `more_s` as a fault."""
        with self.news:
            self._most_silent_s, self.silence = self._patience.silent_s + more_s, PortSilence()

    def check(self, clock_s: float | None = None) -> None:
        """Raise the fault of the port, or of a stream that has been silent for too long.

        `clock_s` is the present time on another instrument's clock: the silence must be too long on that clock as well.
        """
        if self.fault is not None:
            raise self.fault
        with self.news:
            silent_s = self.silence.measure_s(clock_s)
        if self._most_silent_s is not None and silent_s > self._most_silent_s:
            raise _complete_error(self._faults.silent, f" for {silent_s:.1f} s")

    def wait(self, until: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until a condition is true; return False after the time-out. Raise a fault that occurs meanwhile."""
        with self.news:
            done = self.news.wait_for(lambda: until() or self.fault is not None, timeout_s)
            if self.fault is not None:
                raise self.fault
            return done

    def catch_up(self) -> None:
        """Wait until all data that have arrived by now are taken. Raise a fault that occurs meanwhile."""
        enough = self._reads + 2  # the present read may have begun before
        self.wait(lambda: self._reads >= enough, MAX_CATCH_UP_S)

    def write(self, data: bytes) -> None:
        """Send data. Raise SensorError if the port has closed."""
        try:
            self._port.write(data)
        except OSError as error:
            raise self._faults.complete(error) from error

    def close(self) -> None:
        """Call the `farewell` function, end the thread and close the port. May be called twice."""
        if self._closing.is_set():
            return
        with suppress(SensorError):
            self._farewell()
        self._closing.set()
        self._thread.join()
        self._port.close()

    def _run(self) -> None:
        """Read the port until it is closed; keep the first error as the fault."""
        try:
            while not self._closing.is_set():
                self._take(self._port.read(), time.monotonic())
                with self.news:
                    self._reads += 1
                    self.news.notify_all()
        except Exception as error:  # a failing consumer must reach the caller, not end in a dead thread
            self.fault = self._faults.complete(error)
        with self.news:
            self.news.notify_all()


def open_device_port(
    port: str,
    baud: int,
    open_port: Callable[[str, int], DevicePort] = SerialPort,
    *,
    owner: str = "",
    setting: str = "its name",
) -> DevicePort:
    """Return an open port. Raise SensorError `no_port`; its message names the `owner` and the `setting` of the port."""
    try:
        return open_port(port, baud)
    except OSError as error:
        raise SensorError(
            "no_port",
            f"{owner}the port {port} does not open: {explain_closed(port, error)}",
            f"Check {setting} and the cable, and that no other program has the port",
        ) from error


@contextmanager
def closing_on_failure(close: Callable[[], None]) -> Iterator[None]:
    """Call `close` if the block, which sets something up, fails."""
    try:
        yield
    except BaseException:
        close()
        raise


def _complete_error(error: SensorError, end: str) -> SensorError:
    return SensorError(error.name, error.what + end, error.remedy)

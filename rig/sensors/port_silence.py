"""The silence of a sensor with a port of its own: the time for which reads of the port brought nothing.

If another instrument's clock is known, such as the turner's, the silence is at most the time that passed on that clock.
"""

from dataclasses import dataclass

from firmware_host.serial_port import READ_TIMEOUT_S

MAX_ATTEMPTS = 4  # of a request


@dataclass(frozen=True, slots=True)
class Patience:
    """A driver's time-outs: `first_s` for the first data or an answer, `silent_s` for further data of a stream."""

    first_s: float = 4.0  # an Arduino restarts when its port is opened
    silent_s: float = 2.0

    def attempts(self, more_s: float = 0.0) -> list[float]:
        """Return the time-outs, s, of repeated requests: each twice the previous one, together `first_s` + `more_s`."""
        return [(self.first_s + more_s) * 2**attempt / (2**MAX_ATTEMPTS - 1) for attempt in range(MAX_ATTEMPTS)]


PATIENCE = Patience()


class PortSilence:
    """The silence of a port: the time, s, for which it was read without data.

    A delayed reader therefore does not make a device seem silent. Time in which the turner's clock stops, as in a
    simulation, does not count either.
    """

    def __init__(self) -> None:
        self._idle_reads = 0
        self._clock_s: float | None = None  # time of the other clock at the last check
        self._clock_then_s: float | None = None  # time of the other clock at the last data

    def note(self, count: int) -> None:
        """Record one read of the port, which brought `count` of the awaited items."""
        self._idle_reads += 1
        if count:
            self._idle_reads, self._clock_then_s = 0, self._clock_s

    def measure_s(self, clock_s: float | None) -> float:
        """Return the duration of the silence, s; `clock_s` is the turner's time now, None to use its last one."""
        self._clock_s = self._clock_s if clock_s is None else clock_s
        return self.lasts_s

    @property
    def lasts_s(self) -> float:
        """The time spent reading without data, s."""
        silent_s = self._idle_reads * READ_TIMEOUT_S
        if self._clock_s is None:
            return silent_s
        if self._clock_then_s is None:
            self._clock_then_s = self._clock_s
        return min(silent_s, self._clock_s - self._clock_then_s)

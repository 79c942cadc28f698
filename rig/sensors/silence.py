"""How long a sensor with a port of its own has sent nothing, by reads of its port and by another clock."""

from dataclasses import dataclass

from firmware_host.serial_port import READ_TIMEOUT_S

ATTEMPTS = 4  # times something is asked


@dataclass(frozen=True, slots=True)
class Patience:
    """How long a driver waits: `first_s` for what comes first or for an answer, `silent_s` for more of a stream."""

    first_s: float = 4.0  # an Arduino starts anew when its port is opened
    silent_s: float = 2.0

    def attempts(self, more_s: float = 0.0) -> list[float]:
        """How long to wait for each answer, s, to what is asked again and again: `first_s` and `more_s` in all.

        Each wait is twice as long as the one before.
        """
        return [(self.first_s + more_s) * 2**attempt / (2**ATTEMPTS - 1) for attempt in range(ATTEMPTS)]


USUAL = Patience()


class Silence:
    """The reader says what came; whoever checks the link says what another instrument's clock shows, if there is one.

    It is not locked: both hold `OwnPort.news` meanwhile.
    """

    def __init__(self) -> None:
        self._idle_reads = 0
        self._clock_s: float | None = None  # what the other clock showed at the last check,
        self._clock_then_s: float | None = None  # … and when something came last

    def note(self, count: int) -> None:
        """A read brought so many of what is waited for."""
        self._idle_reads += 1
        if count:
            self._idle_reads, self._clock_then_s = 0, self._clock_s

    def seen_by(self, clock_s: float | None) -> float:
        """How long it lasts, s, now that the other clock shows `clock_s`."""
        self._clock_s = self._clock_s if clock_s is None else clock_s
        return self.lasts_s

    @property
    def lasts_s(self) -> float:
        """How long nothing has come, in time spent reading: when the reader was held up, nobody was silent.

        Nor was anybody while another instrument's clock stood still, if there is one: it may be a simulated one's.
        """
        silent_s = self._idle_reads * READ_TIMEOUT_S
        if self._clock_s is None:
            return silent_s
        if self._clock_then_s is None:
            self._clock_then_s = self._clock_s
        return min(silent_s, self._clock_s - self._clock_then_s)

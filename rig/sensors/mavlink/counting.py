"""Which message is which: lost and doubled ones by sequence numbers, samples by the autopilot's time. Pure."""

from collections import deque
from dataclasses import dataclass, field

from rig.sensors.errors import SensorError

SEQUENCE_NUMBERS = 256
LATE = 64  # a number so little before the newest belongs to a message that was overtaken
REMEMBERED = 64  # messages, of which another copy may come
TIME_WRAP = 1 << 32
LONGEST_GAP_US = 60e6  # a step of the clock beyond that is a clock that began anew
MISSING = 1.5  # intervals from one sample to the next, of which one more must be missing: a scheduler may be late


@dataclass(slots=True)
class LinkCounter:
    """Counts what one autopilot sends over one link: all its messages have one sequence number, modulo 256.

    A message that comes after a later one is of no use any more: it stays counted as lost.
    """

    lost: int = 0
    doubled: int = 0
    _last: int | None = None
    _recent: deque[bytes] = field(default_factory=lambda: deque(maxlen=REMEMBERED))

    def is_new(self, sequence: int, frame: bytes) -> bool:
        """Whether the message, the bytes of a whole frame, is neither a copy of another nor a late one."""
        if frame in self._recent:
            self.doubled += 1
            return False
        self._recent.append(frame)
        gap = 0 if self._last is None else (sequence - self._last - 1) % SEQUENCE_NUMBERS
        if gap >= SEQUENCE_NUMBERS - LATE:
            return False
        self.lost += gap
        self._last = sequence
        return True


@dataclass(slots=True)
class ImuCounter:
    """Numbers the samples of one IMU from 0, those that are missing included, by the autopilot's own time.

    `time_us` counts on where its 32 bits begin anew: those of milliseconds do after 49.7 days.
    """

    name: str
    interval_us: float
    unit_us: int
    repeated: int = 0
    number: int = -1
    time_us: int = 0
    _last: int = 0

    def count(self, time: int) -> bool:
        """Whether a sample of that time is another than the one before. Raises SensorError `autopilot_restarted`."""
        if self.number < 0:
            self.number, self.time_us, self._last = 0, time * self.unit_us, time
            return True
        passed = time - self._last
        passed_us = (passed if passed >= 0 else passed % TIME_WRAP) * self.unit_us
        if passed_us == 0:  # PX4 sends a reading again when only its compass has a new one
            self.repeated += 1
            return False
        if passed_us > LONGEST_GAP_US:
            raise SensorError(
                "autopilot_restarted",
                f"sensors.{self.name}: the autopilot's time went from {self._last} to {time} × {self.unit_us} µs",
                "Look at its supply: it has restarted. Then run again",
            )
        self.number += max(1, round(passed_us / self.interval_us)) if passed_us > MISSING * self.interval_us else 1
        self.time_us += passed_us
        self._last = time
        return True

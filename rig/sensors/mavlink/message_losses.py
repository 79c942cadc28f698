"""Counting of messages: lost and doubled ones by sequence numbers, samples by the autopilot's time. Pure."""

from collections import deque
from dataclasses import dataclass, field

from rig.sensors.errors import SensorError

SEQUENCE_NUMBERS = 256
MAX_OVERTAKEN = 64  # a message whose number is at most this far before the newest was overtaken
RECENT_MESSAGES = 64  # compared to detect copies
TIME_WRAP = 1 << 32
MAX_GAP_US = 60e6  # a longer step is a restarted clock
LOSS_STEP = (
    1.5  # in intervals between samples: after a longer one a sample is missing, although a scheduler may be late
)


@dataclass(slots=True)
class LinkCounter:
    """The count of one autopilot's messages over one link, which share one sequence number modulo 256.

    A message that comes after a later one counts as lost.
    """

    lost: int = 0
    doubled: int = 0
    _last: int | None = None
    _recent: deque[bytes] = field(default_factory=lambda: deque(maxlen=RECENT_MESSAGES))

    def is_new(self, sequence: int, frame: bytes) -> bool:
        """Return whether a message, given as the bytes of its frame, is neither a repetition nor late."""
        if frame in self._recent:
            self.doubled += 1
            return False
        self._recent.append(frame)
        gap = 0 if self._last is None else (sequence - self._last - 1) % SEQUENCE_NUMBERS
        if gap >= SEQUENCE_NUMBERS - MAX_OVERTAKEN:
            return False
        self.lost += gap
        self._last = sequence
        return True


@dataclass(slots=True)
class ImuCounter:
    """The numbers of one IMU's samples from 0, missing ones included, by the autopilot's own time.

    - `name`, `interval_us`: the sensor, and the nominal interval of its samples.
    - `unit_us`: the unit of the autopilot's time.
    - `repeated`: the count of messages without a new time.
    - `number`, `time_us`: number and time of the last sample; the time is unwrapped (32 bits wrap after 49.7 days).
    """

    name: str
    interval_us: float
    unit_us: int
    repeated: int = 0
    number: int = -1
    time_us: int = 0
    _last: int = 0

    def count(self, time: int) -> bool:
        """Return whether a time belongs to a new sample. Raise SensorError `autopilot_restarted`."""
        if self.number < 0:
            self.number, self.time_us, self._last = 0, time * self.unit_us, time
            return True
        passed = time - self._last
        passed_us = (passed if passed >= 0 else passed % TIME_WRAP) * self.unit_us
        if passed_us == 0:  # PX4 repeats a reading if only its compass has a new one
            self.repeated += 1
            return False
        if passed_us > MAX_GAP_US:
            raise SensorError(
                "autopilot_restarted",
                f"sensors.{self.name}: the autopilot's time went from {self._last} to {time} × {self.unit_us} µs",
                "Look at its supply: it has restarted. Then run again",
            )
        self.number += max(1, round(passed_us / self.interval_us)) if passed_us > LOSS_STEP * self.interval_us else 1
        self.time_us += passed_us
        self._last = time
        return True

"""Numbering of messages: the 7-bit sequence number and the 32-bit microseconds, unwrapped. Pure."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.kvh_messages import SEQUENCE_NUMBERS

HOST_JITTER_S = 0.04  # of a silence: a USB adapter buffers for 16 ms, and a clock is read every 20 ms
_US_WRAP = 1 << 32


@dataclass(slots=True)
class MessageCounter:
    """The numbers of one stream's messages from 0. Lost messages are counted too.

    `timed`: whether messages state microseconds, as in format B. Those of formats A and C have only the sequence
    number, modulo 128, which does not show a loss of 128 messages in a row. A silence that long, by the computer's
    clock with an error of up to `host_jitter_s`, is therefore refused.
    """

    where: str  # the name of the instrument in messages
    interval_us: float
    timed: bool
    host_jitter_s: float = HOST_JITTER_S
    lost: int = 0
    _number: int = -1
    _sequence: int = 0
    _time_us: int = 0  # time of the last message, from a zero of its microseconds before the first message

    def count(self, messages: NDArray[Any], silent_s: float = 0.0) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the running numbers (n,) and times (n,) in µs of messages (n,) that follow a silence of `silent_s`.

        Raise SensorError: `kvh_gap_ambiguous` if 128 or more messages in a row may have been lost,
        `kvh_time_contradicts` if sequence numbers and microseconds disagree.
        """
        if not len(messages):
            return np.empty(0, np.int64), np.empty(0, np.int64)
        sequence = messages["sequence"].astype(np.int64)
        time_us = messages["time_us"].astype(np.int64)
        if self._number < 0:
            self._sequence, self._time_us = int(sequence[0]) - 1, int(time_us[0])
            passed_us = np.diff(time_us, prepend=time_us[0]) % _US_WRAP
            passed_us[0] = round(self.interval_us)
            self._time_us -= int(passed_us[0])
            silent_s = 0.0
        else:
            passed_us = np.diff(time_us, prepend=self._time_us % _US_WRAP) % _US_WRAP
        steps = (np.diff(sequence, prepend=self._sequence) - 1) % SEQUENCE_NUMBERS + 1  # from 1: no message comes twice
        if self.timed:
            self._check_times(steps, passed_us)
        elif silent_s > (SEQUENCE_NUMBERS + 0.5) * self.interval_us * 1e-6 - self.host_jitter_s:
            raise self._ambiguous(f"no readable message came for {silent_s:.2f} s")
        self.lost += int(steps.sum()) - len(steps)
        numbers = self._number + np.cumsum(steps)
        times = self._time_us + np.cumsum(passed_us) if self.timed else np.rint(numbers * self.interval_us)
        self._number, self._sequence = int(numbers[-1]), int(sequence[-1])
        self._time_us = int(times[-1])
        return numbers, times.astype(np.int64)

    def _check_times(self, steps: NDArray[np.int64], passed_us: NDArray[np.int64]) -> None:
        """Raise SensorError unless the times `passed_us` since the last message agree with the sequence `steps`."""
        by_time = np.rint(passed_us / self.interval_us).astype(np.int64)
        if (by_time > SEQUENCE_NUMBERS).any():
            raise self._ambiguous(f"{int(by_time.max()) - 1} messages are missing in a row")
        if (by_time != steps).any():
            index = int(np.argmax(by_time != steps))
            raise SensorError(
                "kvh_time_contradicts",
                f"{self.where}: by its microseconds {by_time[index]} data periods passed between two messages, but by "
                f"their sequence numbers {steps[index]}",
                "Look at its supply: it may have restarted. Then run again",
            )

    def _ambiguous(self, what: str) -> SensorError:
        return SensorError(
            "kvh_gap_ambiguous",
            f"{self.where}: {what}; sequence numbers, which are modulo 128, do not say how many were lost",
            "Check the cable and the load of this computer, then run again",
        )

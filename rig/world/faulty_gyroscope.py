"""A gyroscope whose electronics do something wrong with its rates: one axis stands still, readings come again."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from firmware_host.emulator.parts.gyroscope import Gyroscope
from rig.config.world.faulty import SimulatedFaultySection


class FrozenGyroscope:
    """What is read of a simulated gyroscope, as a `Gyroscope` is read, one axis of which stands still."""

    def __init__(self, gyroscope: Gyroscope, section: SimulatedFaultySection) -> None:
        self._gyroscope, self._section = gyroscope, section
        self.temperature_c = gyroscope.temperature_c
        self._frozen: float | None = None

    def read(self, time_s: float) -> list[float]:
        """Return the next reading (3,), rad/s, taken at `time_s`."""
        section, rates = self._section, self._gyroscope.read(time_s)
        if section.frozen_axis is not None and time_s >= section.frozen_from_s:
            axis = "xyz".index(section.frozen_axis)
            self._frozen = rates[axis] if self._frozen is None else self._frozen
            rates[axis] = self._frozen
        return rates


class Repeats:
    """Rates of samples as they are sent: now and then the last few of them come again in the place of new ones."""

    def __init__(self, section: SimulatedFaultySection, seed: np.random.SeedSequence) -> None:
        self._begins = section.repeated / section.repeated_length
        self._random = np.random.default_rng(seed.spawn(1)[0]) if section.repeated else None
        self._last: deque[Sequence[float]] = deque(maxlen=section.repeated_length)
        self._again: deque[Sequence[float]] = deque()

    def sent(self, rates: Sequence[float]) -> Sequence[float]:
        """Return the rates (3,) that are sent in the place of the next ones."""
        if self._random is None:
            return rates
        if not self._again and len(self._last) == self._last.maxlen and self._random.random() < self._begins:
            self._again.extend(self._last)
        sent = self._again.popleft() if self._again else rates
        self._last.append(sent)
        return sent

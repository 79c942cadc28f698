"""Gyroscopes with a fault in their electronics: a frozen axis, repeated readings."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from firmware_host.emulator.parts.gyroscope import Gyroscope
from rig.config.world.faulty import SimulatedFaultySection


class FrozenGyroscope:
    """A simulated gyroscope with one axis that freezes. It is used like a `Gyroscope`."""

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
    """A source of repeated samples: now and then the last few rates are sent again in place of new ones."""

    def __init__(self, section: SimulatedFaultySection, seed: np.random.SeedSequence) -> None:
        self._start_probability = section.repeated / section.repeated_length
        self._random = np.random.default_rng(seed.spawn(1)[0]) if section.repeated else None
        self._last: deque[Sequence[float]] = deque(maxlen=section.repeated_length)
        self._queue: deque[Sequence[float]] = deque()

    def next_rates(self, rates: Sequence[float]) -> Sequence[float]:
        """Return the rates (3,), rad/s, to send in place of `rates`."""
        if self._random is None:
            return rates
        if not self._queue and len(self._last) == self._last.maxlen and self._random.random() < self._start_probability:
            self._queue.extend(self._last)
        next_rates = self._queue.popleft() if self._queue else rates
        self._last.append(next_rates)
        return next_rates

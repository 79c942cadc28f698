"""Which sample is which, and when it was taken: by the device's time, by counting, or by when a line arrived. Pure."""

from copy import copy
from dataclasses import dataclass, field
from math import exp

import numpy as np
from numpy.typing import NDArray

from rig.config.sensors.lines_section import LONGEST_GAP_S, LinesSection, LineTimeSection
from rig.config.units import UNITS
from rig.estimation.arrays import Array
from rig.sensors.errors import SensorError

ODD_ONES = 3  # samples in a row whose time cannot be: fewer are damaged, so many are a device that began anew
COARSE = 0.2  # of the interval between samples: a time printed in coarser steps is made even
SMOOTHED_S = 2.0  # over which arrival times, and coarse ones, are made even
ARRIVAL_GAP_S = 0.1  # that a line may be late before one counts as lost
_RESTARTED = "Check its supply and cable, and that its program prints nothing else between; then run again"


def is_coarse(step_s: float, rate_hz: float) -> bool:
    """Whether steps of a printed time are no small part of the interval between samples."""
    return step_s * rate_hz > COARSE


@dataclass(slots=True)
class Stamper:
    """Numbers and times of one stream's samples, in µs of its clock; `lost` are those that never came.

    What cannot be is left out and counted as `odd`: a time or a number that goes back, or more than 2 s ahead. The time
    is printed in steps of `step_s`: coarse ones are made even.
    """

    section: LinesSection
    rate_hz: float
    where: str  # the device as messages name it
    step_s: float = 0.0
    lost: int = 0
    odd: int = 0
    _number: int = -1
    _time_s: float = 0.0  # as it was told, from the first sample on
    _odd_in_a_row: int = 0
    _last_time: float | None = None  # as printed
    _last_sequence: float | None = None
    _even: "Evened | None" = None
    _host_began_s: float | None = None
    _stamp_us: int = -1

    def stamp(
        self, values: Array, skipped: int, host_time_s: float
    ) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[np.int64]]:
        """Which of `values` (n, columns) are samples, and of those the numbers (m,) from 0, and times (m,) in µs.

        `skipped` lines before them were no samples; they came at `host_time_s`. Raises SensorError `lines_time_jumped`.
        """
        if not len(values):
            return np.zeros(0, np.bool_), np.zeros(0, np.int64), np.zeros(0, np.int64)
        passed_s, steps = self._steps(values, skipped)
        kept = np.ones(len(values), np.bool_)
        if not self._possible(passed_s, steps).all():
            kept = self._possible_ones(values)
            values = values[kept]
            if not len(values):
                return kept, np.zeros(0, np.int64), np.zeros(0, np.int64)
            passed_s, steps = self._steps(values, skipped)
        self._odd_in_a_row = 0
        began = self._number < 0
        if self.section.clock == "arrival":
            steps = self._late(steps, host_time_s)
        if began:
            steps[0], passed_s[0] = 1, 0.0
        told_s = self._time_s + np.cumsum(passed_s)
        if self._is_coarse and "sequence" not in self.section.columns:
            steps = self._steps_of_coarse(told_s)
        self.lost += int(steps.sum()) - len(steps)
        numbers = self._number + np.cumsum(steps)
        times_s = self._times_s(numbers, told_s, host_time_s)
        self._number, self._time_s = int(numbers[-1]), self._time_s + float(passed_s.sum())
        self._remember(values[-1])
        stamps = np.rint(times_s * 1e6).astype(np.int64)
        # Coarse times that were made even may still meet.
        ahead = self._stamp_us + 1 + np.arange(len(stamps))
        stamps = np.maximum.accumulate(np.maximum(stamps, ahead) - np.arange(len(stamps))) + np.arange(len(stamps))
        self._stamp_us = int(stamps[-1])
        return kept, numbers, stamps

    # -- numbers -------------------------------------------------------------------------------------------------
    def _steps(self, values: Array, skipped: int) -> tuple[Array, NDArray[np.int64]]:
        """Seconds (n,) by the device's time, and samples (n,), that passed before each; seconds are 0 without one."""
        columns = self.section.columns
        passed_s = np.zeros(len(values))
        steps = np.ones(len(values), np.int64)
        if self.section.time is not None:
            passed_s = self._passed_s(values[:, columns.index("time")], self.section.time)
            steps = np.maximum(np.rint(passed_s * self.rate_hz), 1).astype(np.int64)
        elif "sequence" not in columns:
            steps[0] += skipped  # a line that was no sample was one, most likely
        if "sequence" in columns:
            counted = values[:, columns.index("sequence")]
            before = counted[0] - 1 if self._last_sequence is None else self._last_sequence
            moved = np.diff(counted, prepend=before)
            wrap = self.section.sequence_wrap
            if wrap:
                moved %= wrap
                if self.section.time is not None:
                    moved += wrap * np.maximum(np.rint((steps - moved) / wrap), 0)
            steps = np.where(np.abs(moved) < 2.0**53, moved, -1).astype(np.int64)
        return passed_s, steps

    def _passed_s(self, printed: Array, column: LineTimeSection) -> Array:
        unit_s, wrap = UNITS[column.unit].size, column.wrap
        before = printed[0] if self._last_time is None else self._last_time
        passed = np.diff(printed, prepend=before)
        if wrap:
            passed %= wrap
        found: Array = passed * unit_s
        if self._last_time is None:
            found[0] = 1.0 / self.rate_hz
        return found

    def _remember(self, row: Array) -> None:
        columns = self.section.columns
        self._last_time = float(row[columns.index("time")]) if "time" in columns else None
        self._last_sequence = float(row[columns.index("sequence")]) if "sequence" in columns else None

    def _possible_ones(self, values: Array) -> NDArray[np.bool_]:
        """One by one, which of (n, columns) can follow those before. Raises SensorError `lines_time_jumped`."""
        kept = np.zeros(len(values), np.bool_)
        last = (self._last_time, self._last_sequence)
        try:
            for place, row in enumerate(values):
                passed_s, steps = self._steps(row[None], 0)
                if self._possible(passed_s, steps).all():
                    kept[place], self._odd_in_a_row = True, 0
                    self._remember(row)
                    continue
                self.odd += 1
                self._odd_in_a_row += 1
                if self._odd_in_a_row >= ODD_ONES:
                    raise SensorError("lines_time_jumped", f"{self.where}: {self._jump(row)}", _RESTARTED)
        finally:
            self._last_time, self._last_sequence = last
        return kept

    def _possible(self, passed_s: Array, steps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which samples can follow the one before: later, unless times are coarse, and not too late."""
        later = passed_s > 0 if self.section.time is not None and not self._is_coarse else passed_s >= 0
        in_time = (passed_s <= LONGEST_GAP_S) & (steps >= 1) & (steps <= LONGEST_GAP_S * self.rate_hz + 1)
        found: NDArray[np.bool_] = later & in_time
        return found

    @property
    def _is_coarse(self) -> bool:
        """Whether the device's time is printed in steps that are no small part of the interval between samples."""
        return self.section.time is not None and is_coarse(self.step_s, self.rate_hz)

    def _steps_of_coarse(self, told_s: Array) -> NDArray[np.int64]:
        """Samples (n,) that passed before each, by coarse times (n,): one each, but where a time is too far ahead.

        What is lost within a step of the time cannot be seen.
        """
        even = Evened(self.rate_hz) if self._even is None else copy(self._even)
        steps = np.ones(len(told_s), np.int64)
        for place, time_s in enumerate(told_s):
            if even.begun:
                late = (time_s - even.ahead_s(1)) * self.rate_hz
                steps[place] += round(late) if late > self.step_s * self.rate_hz + 0.5 else 0
            number = even.number + int(steps[place])
            even.evened(np.array([number]), float(time_s))
        return steps

    def _jump(self, row: Array) -> str:
        columns = self.section.columns
        told = [
            f"its {name} went from {before:.15g} to {row[columns.index(name)]:.15g}"
            for name, before in (("time", self._last_time), ("sequence", self._last_sequence))
            if name in columns and before is not None
        ]
        return " and ".join(told) + ": the device was restarted, or more than 2 s of its lines are lost"

    # -- times ---------------------------------------------------------------------------------------------------
    def _late(self, steps: NDArray[np.int64], host_time_s: float) -> NDArray[np.int64]:
        """The steps, with those that only the wait before the lines shows to be lost."""
        if "sequence" in self.section.columns or self._even is None:
            return steps
        late_s = host_time_s - (self._host_began_s or 0.0) - self._even.ahead_s(int(steps.sum()))
        if late_s > max(ARRIVAL_GAP_S, 8 / self.rate_hz):
            steps = steps.copy()
            steps[0] += round(late_s * self.rate_hz)
        return steps

    def _times_s(self, numbers: NDArray[np.int64], told_s: Array, host_time_s: float) -> Array:
        if self.section.clock == "counted":
            return numbers / self.rate_hz
        if self.section.clock == "device":
            if not self._is_coarse:
                return told_s
            self._even = self._even or Evened(self.rate_hz)
            return self._even.evened_each(numbers, told_s)
        if self._even is None or self._host_began_s is None:
            self._even, self._host_began_s = Evened(self.rate_hz), host_time_s - numbers[-1] / self.rate_hz
        return self._even.evened(numbers, host_time_s - self._host_began_s)


@dataclass(slots=True)
class Evened:
    """A clock that follows told times slowly, by how many samples have passed: a loop of second order."""

    rate_hz: float
    number: int = -1
    _period_s: float = field(default=0.0)
    _time_s: float = 0.0

    def __post_init__(self) -> None:
        self._period_s = 1.0 / self.rate_hz

    @property
    def begun(self) -> bool:
        """Whether it knows the time of a sample."""
        return self.number >= 0

    def ahead_s(self, steps: int) -> float:
        """When the sample after so many steps would be."""
        return self._time_s + steps * self._period_s

    def evened(self, numbers: NDArray[np.int64], told_s: float) -> Array:
        """Times (n,) of samples (n,), of which the last was told to be at `told_s`."""
        last, before, count = int(numbers[-1]), self._time_s, int(numbers[-1]) - self.number
        if not self.begun:
            self.number, self._time_s = last, told_s
            return np.asarray(told_s - (last - numbers) * self._period_s, np.float64)
        wrong_s = told_s - self.ahead_s(count)
        share = 1 - exp(-count * self._period_s / SMOOTHED_S)
        self._time_s = max(self.ahead_s(count) + share * wrong_s, before + 1e-6 * count)
        self._period_s = max(self._period_s + share**2 / 4 * wrong_s / count, 1e-6)
        found: Array = before + (self._time_s - before) * (numbers - self.number) / count
        self.number = last
        return found

    def evened_each(self, numbers: NDArray[np.int64], told_s: Array) -> Array:
        """Times (n,) of samples (n,) that each were told a time."""
        return np.array([self.evened(numbers[k : k + 1], float(told_s[k]))[0] for k in range(len(numbers))])

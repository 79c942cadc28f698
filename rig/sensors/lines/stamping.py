"""Numbers and times of samples: from the device's time, from counting, or from the arrival of lines. Pure."""

from copy import copy
from dataclasses import dataclass, field
from math import ceil, exp, log

import numpy as np
from numpy.typing import NDArray

from rig.config.sensors.lines_section import MAX_GAP_S, LinesSection, LineTimeSection
from rig.config.units import UNITS
from rig.estimation.arrays import Array
from rig.sensors.errors import SensorError

MAX_ODD_SAMPLES = 3  # in a row with an impossible time: fewer are damaged, as many are a restart
COARSE_STEP_FRACTION = 0.2  # of the sample interval: a time with coarser steps is smoothed
SMOOTHING_S = 2.0  # time constant, of arrival times and coarse ones
MAX_ARRIVAL_DELAY_S = 0.1  # of a line: above it, one counts as lost
ROUND_OFF = 1e-12  # of a logarithm
_RESTARTED = "Check its supply and cable, and that its program prints nothing else between; then run again"


def is_coarse(step_s: float, rate_hz: float) -> bool:
    """Return whether the step of a device's time is a large part of the sample interval."""
    return step_s * rate_hz > COARSE_STEP_FRACTION


@dataclass(slots=True)
class Stamper:
    """The numbers and times of one stream's samples, in µs of its clock.

    - `section`, `rate_hz`: the configuration.
    - `where`: the device's name in messages.
    - `step_s`: the step of the device's time; a coarse time is smoothed.
    - `lost`: the number of samples that did not arrive.
    - `odd`: the number of samples left out because their time or number goes back or jumps by more than 2 s.
    """

    section: LinesSection
    rate_hz: float
    where: str
    step_s: float = 0.0
    lost: int = 0
    odd: int = 0
    _number: int = -1
    _time_s: float = 0.0  # device's time since the first sample
    _odd_in_a_row: int = 0
    _behind: int = 0  # rows in a row that show that the last one was damaged
    _last_time: float | None = None  # as printed
    _last_sequence: float | None = None
    _before_last: tuple[float | None, float | None] = (None, None)  # time and sequence of the row before the last
    _smoothed: "SmoothedClock | None" = None
    _host_began_s: float | None = None
    _stamp_us: int = -1

    def stamp(
        self, values: Array, skipped: int, host_time_s: float
    ) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[np.int64]]:
        """Return a mask (n,) of the m valid rows of `values` (n, columns), and numbers and times (µs) of these rows.

        Numbers begin with 0 and count lost samples too. The rows arrived at `host_time_s`, after `skipped` rejected
        lines. Raise SensorError `lines_time_jumped`.
        """
        if not len(values):
            return np.zeros(0, np.bool_), np.zeros(0, np.int64), np.zeros(0, np.int64)
        passed_s, steps = self._steps(values, skipped)
        is_sample = np.ones(len(values), np.bool_)
        if not self._is_possible(passed_s, steps).all():
            is_sample = self._select_possible(values)
            values = values[is_sample]
            if not len(values):
                return is_sample, np.zeros(0, np.int64), np.zeros(0, np.int64)
            passed_s, steps = self._steps(values, skipped)
        self._odd_in_a_row = self._behind = 0
        is_first = self._number < 0
        if self.section.clock == "arrival":
            steps = self._add_late(steps, host_time_s)
        if is_first:
            steps[0], passed_s[0] = 1, 0.0
        device_s = self._time_s + np.cumsum(passed_s)
        if self._is_coarse and "sequence" not in self.section.columns:
            steps = self._count_coarse_steps(device_s)
        self.lost += int(steps.sum()) - len(steps)
        numbers = self._number + np.cumsum(steps)
        times_s = self._compute_times_s(numbers, device_s, host_time_s)
        self._number, self._time_s = int(numbers[-1]), self._time_s + float(passed_s.sum())
        self._remember(values[-1])
        stamps = np.rint(times_s * 1e6).astype(np.int64)
        # Smoothed coarse times may still coincide.
        ahead = self._stamp_us + 1 + np.arange(len(stamps))
        stamps = np.maximum.accumulate(np.maximum(stamps, ahead) - np.arange(len(stamps))) + np.arange(len(stamps))
        self._stamp_us = int(stamps[-1])
        return is_sample, numbers, stamps

    # -- numbers -------------------------------------------------------------------------------------------------
    def _steps(self, values: Array, skipped: int) -> tuple[Array, NDArray[np.int64]]:
        """Return time (n,), s, and number of samples (n,) since the previous line; 0 s if no time is printed."""
        columns = self.section.columns
        passed_s = np.zeros(len(values))
        steps = np.ones(len(values), np.int64)
        if self.section.time is not None:
            passed_s = self._unwrap_time_s(values[:, columns.index("time")], self.section.time)
            steps = np.maximum(np.rint(passed_s * self.rate_hz), 1).astype(np.int64)
        elif "sequence" not in columns:
            steps[0] += skipped  # a rejected line was most likely a damaged sample
        if "sequence" in columns:
            sequence = values[:, columns.index("sequence")]
            last_sequence = sequence[0] - 1 if self._last_sequence is None else self._last_sequence
            advance = np.diff(sequence, prepend=last_sequence)
            wrap = self.section.sequence_wrap
            if wrap:
                advance %= wrap
                if self.section.time is not None:
                    advance += wrap * np.maximum(np.rint((steps - advance) / wrap), 0)
            steps = np.where(np.abs(advance) < 2.0**53, advance, -1).astype(np.int64)
        return passed_s, steps

    def _unwrap_time_s(self, printed: Array, column: LineTimeSection) -> Array:
        """Return for each row the time, s, since the row before it, across wraps of the device's time."""
        unit_s, wrap = UNITS[column.unit].size, column.wrap
        last_time = printed[0] if self._last_time is None else self._last_time
        passed = np.diff(printed, prepend=last_time)
        if wrap:
            passed %= wrap
        passed_s: Array = passed * unit_s
        if self._last_time is None:
            passed_s[0] = 1.0 / self.rate_hz
        return passed_s

    def _remember(self, row: Array) -> None:
        columns = self.section.columns
        self._before_last = (self._last_time, self._last_sequence)
        self._last_time = float(row[columns.index("time")]) if "time" in columns else None
        self._last_sequence = float(row[columns.index("sequence")]) if "sequence" in columns else None

    def _select_possible(self, values: Array) -> NDArray[np.bool_]:
        """Return a mask of the rows that can follow the previous row. Raise SensorError `lines_time_jumped`."""
        is_sample = np.zeros(len(values), np.bool_)
        state = (self._last_time, self._last_sequence, self._before_last)
        try:
            for index, row in enumerate(values):
                if self._can_follow(row):
                    is_sample[index], self._odd_in_a_row, self._behind = True, 0, 0
                    self._remember(row)
                    continue
                self.odd += 1
                if self._shows_false_last(row) and self._behind < MAX_GAP_S * self.rate_hz:
                    self._behind += 1
                    continue
                self._odd_in_a_row += 1
                if self._odd_in_a_row >= MAX_ODD_SAMPLES:
                    raise SensorError("lines_time_jumped", f"{self.where}: {self._jump(row)}", self._remedy(row))
        finally:
            self._last_time, self._last_sequence, self._before_last = state
        return is_sample

    def _can_follow(self, row: Array) -> bool:
        """Return whether a row can follow the last one."""
        return bool(self._is_possible(*self._steps(row[None], 0)).all())

    def _shows_false_last(self, row: Array) -> bool:
        """Return whether a row can follow the row before the last: the last one was damaged, and is too far ahead.

        The rows up to the time of the damaged one are left out.
        """
        last = (self._last_time, self._last_sequence)
        columns = self.section.columns
        same = [row[columns.index(name)] == was for name, was in zip(("time", "sequence"), last, strict=True) if was]
        if self._before_last == (None, None) or all(same):
            return False
        try:
            self._last_time, self._last_sequence = self._before_last
            return self._can_follow(row)
        finally:
            self._last_time, self._last_sequence = last

    def _is_possible(self, passed_s: Array, steps: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return a mask of the samples that are within 2 s after the previous one; coarse times may also be equal."""
        later = passed_s > 0 if self.section.time is not None and not self._is_coarse else passed_s >= 0
        in_time = (passed_s <= MAX_GAP_S) & (steps >= 1) & (steps <= MAX_GAP_S * self.rate_hz + 1)
        possible: NDArray[np.bool_] = later & in_time
        return possible

    @property
    def _is_coarse(self) -> bool:
        """Whether the step of the device's time is a large part of the sample interval."""
        return self.section.time is not None and is_coarse(self.step_s, self.rate_hz)

    def _count_coarse_steps(self, device_s: Array) -> NDArray[np.int64]:
        """Return how many samples (n,) each sample is after the previous one, from coarse times (n,), s.

        The number exceeds 1 if the time jumps, because samples were lost. A loss that is shorter than a step of the
        time does not show.
        """
        clock = SmoothedClock(self.rate_hz) if self._smoothed is None else copy(self._smoothed)
        steps = np.ones(len(device_s), np.int64)
        for index, time_s in enumerate(device_s):
            if clock.is_set:
                late = (time_s - clock.predict_s(1)) * self.rate_hz
                steps[index] += round(late) if late > self.step_s * self.rate_hz + 0.5 else 0
            number = clock.number + int(steps[index])
            clock.advance_to(np.array([number]), float(time_s))
        return steps

    def _jump(self, row: Array) -> str:
        columns = self.section.columns
        changes = [
            f"its {name} went from {before:.15g} to {row[columns.index(name)]:.15g}"
            for name, before in (("time", self._last_time), ("sequence", self._last_sequence))
            if name in columns and before is not None
        ]
        return " and ".join(changes) + ": the device was restarted, or more than 2 s of its lines are lost"

    def _remedy(self, row: Array) -> str:
        """Return what to do about a jump: state the counter's wrap if it was probably one, at a power of two or ten."""
        columns, time = self.section.columns, self.section.time
        interval = {"sequence": 1.0, "time": 1.0 / UNITS[time.unit].size / self.rate_hz if time is not None else 0.0}
        stated = {"sequence": self.section.sequence_wrap, "time": 0.0 if time is None else time.wrap}
        keys = {"sequence": "lines.sequence_wrap", "time": "lines.time.wrap"}
        for name, before in (("time", self._last_time), ("sequence", self._last_sequence)):
            if name not in columns or before is None or not 1 < row[columns.index(name)] + 1 <= before:
                continue
            for wrap in (base ** ceil(log(before + 1, base) - ROUND_OFF) for base in (2.0, 10.0)):
                if (
                    wrap != stated[name]
                    and wrap - before + row[columns.index(name)] <= 2 * MAX_ODD_SAMPLES * interval[name]
                ):
                    return f"If its {name} starts again at {wrap:.15g}, set {keys[name]} to {wrap:.15g}. {_RESTARTED}"
        return _RESTARTED

    # -- times ---------------------------------------------------------------------------------------------------
    def _add_late(self, steps: NDArray[np.int64], host_time_s: float) -> NDArray[np.int64]:
        """Return the `steps`. If the lines are late, the first step is increased by the number of lost samples."""
        if "sequence" in self.section.columns or self._smoothed is None:
            return steps
        late_s = host_time_s - (self._host_began_s or 0.0) - self._smoothed.predict_s(int(steps.sum()))
        if late_s > max(MAX_ARRIVAL_DELAY_S, 8 / self.rate_hz):
            steps = steps.copy()
            steps[0] += round(late_s * self.rate_hz)
        return steps

    def _compute_times_s(self, numbers: NDArray[np.int64], device_s: Array, host_time_s: float) -> Array:
        """Return the samples' times (n,), s, by the section's `clock`: counted, printed, or smoothed arrival times."""
        if self.section.clock == "counted":
            return numbers / self.rate_hz
        if self.section.clock == "device":
            if not self._is_coarse:
                return device_s
            self._smoothed = self._smoothed or SmoothedClock(self.rate_hz)
            return self._smoothed.advance_through(numbers, device_s)
        if self._smoothed is None or self._host_began_s is None:
            self._smoothed, self._host_began_s = SmoothedClock(self.rate_hz), host_time_s - numbers[-1] / self.rate_hz
        return self._smoothed.advance_to(numbers, host_time_s - self._host_began_s)


@dataclass(slots=True)
class SmoothedClock:
    """A clock that counts samples and slowly adapts to their coarse times: a second-order phase-locked loop."""

    rate_hz: float
    number: int = -1
    _period_s: float = field(default=0.0)
    _time_s: float = 0.0

    def __post_init__(self) -> None:
        self._period_s = 1.0 / self.rate_hz

    @property
    def is_set(self) -> bool:
        """Whether a time was set."""
        return self.number >= 0

    def predict_s(self, steps: int) -> float:
        """Return the predicted time, s, of the sample `steps` after the last."""
        return self._time_s + steps * self._period_s

    def advance_to(self, numbers: NDArray[np.int64], input_s: float) -> Array:
        """Advance the clock to the samples `numbers` (n,), the last at time `input_s`; return their times (n,), s."""
        last, time_before_s, count = int(numbers[-1]), self._time_s, int(numbers[-1]) - self.number
        if not self.is_set:
            self.number, self._time_s = last, input_s
            return np.asarray(input_s - (last - numbers) * self._period_s, np.float64)
        error_s = input_s - self.predict_s(count)
        gain = 1 - exp(-count * self._period_s / SMOOTHING_S)
        self._time_s = max(self.predict_s(count) + gain * error_s, time_before_s + 1e-6 * count)
        self._period_s = max(self._period_s + gain**2 / 4 * error_s / count, 1e-6)
        times_s: Array = time_before_s + (self._time_s - time_before_s) * (numbers - self.number) / count
        self.number = last
        return times_s

    def advance_through(self, numbers: NDArray[np.int64], input_s: Array) -> Array:
        """Advance the clock through the samples `numbers` (n,), at input times (n,), s; return their times (n,), s."""
        return np.array(
            [self.advance_to(numbers[index : index + 1], float(input_s[index]))[0] for index in range(len(numbers))]
        )

"""The temperatures that a calibration over temperature still lacks. Pure functions.

The sensors go from one end of the range to the other, and back if both directions are wanted. At intervals the arm
makes a set of sweeps, whose temperature is the mean over the set. Sets with neighbouring temperatures may be at most
`max_step_k` apart, and the coldest and the warmest set at most a quarter of that from the ends of the range.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, zip_longest

from rig.data.recording.thermal_events import SetMeasured

NEXT_SET_FRACTION = 0.5  # of the largest step, after which a set begins: its own change of temperature is added
END_FRACTION = 0.25  # largest distance from an end of the range, as a fraction of the largest step
FULL_POWER_K = 2.0  # control error at which the heater has full power
MAX_LAG_K = 3.0  # between the ramp and the heated sensor
INTEGRAL_TIME_S = 30.0  # of the controller


@dataclass(slots=True)
class TemperatureCourse:
    """The course through a range of temperatures, in which sets of sweeps are at most `max_step_k` apart.

    `sets`: the measured sets of sweeps. `warming`: the present direction, None before a temperature is known.
    """

    from_c: float
    to_c: float
    max_step_k: float
    both_directions: bool
    sets: list[SetMeasured] = field(default_factory=list)
    warming: bool | None = None

    def begin(self, temperature_c: float) -> None:
        """Choose the direction that an interrupted run had, or else the one away from the nearer end of the range."""
        self.warming = temperature_c <= (self.from_c + self.to_c) / 2
        if self.sets:
            self.warming = self.sets[-1].warming
            self._turn_round(self.sets[-1])

    def add_set(self, step: SetMeasured) -> None:
        """Add a measured set of sweeps, and reverse the direction if this set was at the end of the range."""
        self.sets.append(step)
        self._turn_round(step)

    def _turn_round(self, step: SetMeasured) -> None:
        if self.warming and min(step.temperatures_c.values()) >= self.to_c - END_FRACTION * self.max_step_k:
            self.warming = False
        elif not self.warming and max(step.temperatures_c.values()) <= self.from_c + END_FRACTION * self.max_step_k:
            self.warming = True

    def is_due(self, now_c: Mapping[str, float]) -> bool:
        """Return whether the sensors are at the range's end, or far enough from the last set's temperatures."""
        if not self.sets:
            return True
        if min(now_c.values()) >= self.to_c if self.warming else max(now_c.values()) <= self.from_c:
            return True
        last = self.sets[-1].temperatures_c
        moved = (abs(now_c[name] - last[name]) for name in now_c)
        return min(moved) >= NEXT_SET_FRACTION * self.max_step_k

    def next_c(self, now_c: float) -> float:
        """Return the temperature at which the next set of sweeps is due, for a sensor at `now_c`."""
        if not self.sets:
            return now_c
        last = self.sets[-1].temperatures_c.values()
        step_k = NEXT_SET_FRACTION * self.max_step_k
        return min(max(last) + step_k, self.to_c) if self.warming else max(min(last) - step_k, self.from_c)

    def missing(self) -> str | None:
        """Return the part of the range without a set of sweeps, in words; None if the range is covered."""
        directions = ((True, "while warming"), (False, "while cooling")) if self.both_directions else ((None, ""),)
        return next(self._missing(directions), None)

    def _missing(self, directions: Iterable[tuple[bool | None, str]]) -> Iterator[str]:
        """Yield a sentence for each direction without sets of sweeps, and for each gap in temperature."""
        for direction, words in directions:
            sets = self._sets_in(direction)
            if not sets:
                yield f"no set of sweeps was made {words}".strip()
            for name in sets[0].temperatures_c if sets else ():
                gap = self._gap(sorted(step.temperatures_c[name] for step in sets))
                if gap is not None:
                    yield f"{name} was never between {gap[0]:.1f} and {gap[1]:.1f} °C {words}".strip()

    def _sets_in(self, direction: bool | None) -> list[SetMeasured]:
        """Return the sets of sweeps in a `direction`, or all if None; a set at a reversal is in both directions."""
        pairs = zip_longest(self.sets, self.sets[1:])
        return [
            step
            for step, after in pairs
            if direction is None or step.warming is direction or (after is not None and after.warming is direction)
        ]

    def _gap(self, temperatures_c: Sequence[float]) -> tuple[float, float] | None:
        """Return the coldest gap between the sets' ascending `temperatures_c` that is too wide; None if there is none.

        The ends of the course's range count too: a gap may lie before the first set or after the last one.
        """
        end_k = END_FRACTION * self.max_step_k
        if temperatures_c[0] > self.from_c + end_k:
            return self.from_c, temperatures_c[0]
        for low, high in pairwise(temperatures_c):
            if high - low > self.max_step_k and high > self.from_c and low < self.to_c - end_k:
                return low, high
        return None if temperatures_c[-1] >= self.to_c - end_k else (temperatures_c[-1], self.to_c)


@dataclass(slots=True)
class Ramp:
    """The setpoint that a heater follows, and the power that this needs, from 0 to `most_power`.

    The setpoint `wanted_c` changes at `rate_k_s`, but waits for a sensor that cannot follow.
    """

    rate_k_s: float
    most_power: float
    wanted_c: float | None = None
    _sum_k_s: float = 0.0
    _time_s: float = 0.0

    def power(self, time_s: float, now_c: float, goal_c: float) -> float:
        """Return the heater's power at `time_s` as a fraction, to bring a sensor at `now_c` towards `goal_c`."""
        if self.wanted_c is None:
            self.wanted_c, self._time_s = now_c, time_s
        dt_s, self._time_s = time_s - self._time_s, time_s
        step_k = self.rate_k_s * dt_s
        self.wanted_c += min(max(goal_c - self.wanted_c, -step_k), step_k)
        self.wanted_c = min(max(self.wanted_c, now_c - MAX_LAG_K), now_c + MAX_LAG_K)
        off_k = self.wanted_c - now_c
        wanted = off_k / FULL_POWER_K + self._sum_k_s / (FULL_POWER_K * INTEGRAL_TIME_S)
        # The integral must not wind up while the power is at its limit.
        if 0.0 < wanted < 1.0 or (wanted >= 1.0) != (off_k > 0):
            self._sum_k_s += off_k * dt_s
        return self.most_power * min(max(wanted, 0.0), 1.0)

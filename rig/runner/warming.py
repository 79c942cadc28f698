"""The supervision of the sensors' temperatures by their own thermometers, and the ramp of the board's heater.

The temperatures are checked many times a second, even while the arm moves: a sensor that is too hot or changes too fast
ends the run, which stops the arm first. The board's heater switches itself off if no further commands arrive.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from firmware_host.client import Board
from firmware_host.protocol import HEATER_LIMIT_C
from rig.board.identify import refusing
from rig.config.procedures.procedure_sections import ThermalSection
from rig.data.quantity import TEMPERATURE
from rig.data.recording.recorded_events import Event
from rig.data.recording.thermal_events import SetMeasured, TemperatureWanted
from rig.errors import Fault, ProblemError, Refused
from rig.plans.motions.temperature_course import Ramp, TemperatureCourse
from rig.runner.acquisition import Acquisition

POLL_S = 0.25  # of checks, and of commands to the heater
RATE_SPAN_S = 30.0  # time over which the rate of change is judged: a thermometer's steps are coarse
MIN_RATE_SPAN_S = 0.8 * RATE_SPAN_S
RAMP_FRACTION = 0.6  # of the largest allowed rate: the parts do not warm up evenly
SET_FRACTION = 0.6  # of the largest step within which a set must end
OVERTRAVEL_K = 1.0  # over the ends of the range, so that a set's mean reaches them
HEATER_MARGIN_K = 2.0  # to the heater's own limit


@dataclass(slots=True)
class Warming:
    """The supervision of a calibration over temperature.

    - `names`: the sensors whose thermometers are used.
    - `heater`: the board with the heater, None if the operator changes the temperature.
    - `set_s`: the duration of a set (all sweeps and dwells at one temperature), planned or the longest so far.
    """

    section: ThermalSection
    acquisition: Acquisition
    note: Callable[[Event], None]
    names: tuple[str, ...]
    heater: Board | None
    set_s: float
    course: TemperatureCourse
    _history: dict[str, deque[tuple[float, float]]] = field(default_factory=dict)
    _of_set: list[dict[str, float]] | None = None  # temperatures since the set began
    _began_s: float = 0.0  # start of the set
    _ramp: Ramp | None = None
    _looked_s: float = -np.inf

    def prepare(self) -> None:
        """Check thermometers and heater before anything moves. Raise Refused `no_thermometer`, `no_heater`."""
        for name in self.names:
            sensor = self.acquisition.counts[name].sensor
            if sensor.temperature_stated or not sensor.measures(TEMPERATURE):
                raise Refused(
                    "no_thermometer",
                    f"{name} provides no temperature, but the procedure thermal calibrates over temperature",
                    "Use a sensor with a thermometer, or another procedure",
                )
        if self.heater is None:
            return
        try:
            self.heater.heat(0.0)
        except ProblemError as error:
            if error.name != "unknown_message":
                with refusing():
                    raise
            raise Refused(
                "no_heater",
                f"procedure.heater_power is {self.section.heater_power:g}, and the firmware "
                f"{self.heater.identity.firmware} of the board does not support a heater",
                "Flash the image that comes with this program: `rig board flash`; or set procedure.heater_power to 0",
            ) from error
        self._ramp = Ramp(self._rate_k_s, self.section.heater_power)

    @property
    def _rate_k_s(self) -> float:
        """The rate of a ramp: below the limit, and so slow that temperature hardly changes during a set of sweeps."""
        allowed_k_s = RAMP_FRACTION * self.section.max_rate_k_per_min / 60
        return min(allowed_k_s, SET_FRACTION * self.section.max_step_k / max(self.set_s, 1.0))

    def check(self, time_s: float) -> None:
        """Check the thermometers at the controller's time `time_s`, and command the heater.

        Raise Fault `overheated`, `too_fast`.
        """
        if time_s - self._looked_s < POLL_S:
            return
        self._looked_s = time_s
        now_c = self.now_c()
        if not now_c:
            return
        if self._of_set is not None:
            self._of_set.append(now_c)
        self._refuse_hot(now_c)
        for name, (read_s, temperature_c) in self.acquisition.find_newest_readings(TEMPERATURE).items():
            if name in now_c:
                self._refuse_fast(name, read_s, temperature_c)
        self._heat(time_s, now_c)

    def now_c(self) -> dict[str, float]:
        """Return the sensors' temperatures by name; empty until all have sent one."""
        latest = {sample.sensor: sample.latest.get(TEMPERATURE.name) for sample in self.acquisition.samples()}
        readings_c = {name: value[0] for name in self.names if (value := latest.get(name)) is not None}
        return readings_c if len(readings_c) == len(self.names) else {}

    def find_missing(self) -> str | None:
        """Return the part of the temperature range that is not covered yet, in words; None if all is covered."""
        return self.course.missing()

    def begin_waiting(self) -> None:
        """Report the temperature to wait for; the operator or the heater brings it about."""
        now_c = self.now_c()
        farthest_c = self._farthest_c(now_c)
        if self.course.warming is None:
            self.course.begin(farthest_c)
            farthest_c = self._farthest_c(now_c)
        if not self.course.is_due(now_c):
            heated = self.heater is not None
            self.note(TemperatureWanted(bool(self.course.warming), farthest_c, self.course.next_c(farthest_c), heated))

    @property
    def is_due(self) -> bool:
        """Whether the next set of sweeps and dwells may begin."""
        return self.course.is_due(self.now_c())

    def begin_set(self) -> None:
        """Begin to average the temperatures during the next set of sweeps and dwells."""
        self._began_s = self._looked_s
        self._of_set = []

    def end_set(self, first: int, end: int) -> None:
        """End the set whose sweeps and dwells have the indices from `first` up to, not including, `end`."""
        if self._of_set:
            means = {name: float(np.mean([now_c[name] for now_c in self._of_set])) for name in self.names}
            measured = SetMeasured(first, end, bool(self.course.warming), means)
            self.note(measured)
            self.course.add_set(measured)
            self.set_s = max(self.set_s, self._looked_s - self._began_s)
        self._of_set = None
        if self._ramp is not None:
            self._ramp.rate_k_s = self._rate_k_s

    def stop_heating(self) -> None:
        """Switch the heater off, and send no more commands to it."""
        self._ramp = None
        if self.heater is not None:
            self.heater.keep_heating(0.0)

    def _farthest_c(self, now_c: Mapping[str, float]) -> float:
        """Return the temperature of the sensor that lags most: the coldest while warming, the warmest while cooling."""
        return max(now_c.values()) if self.course.warming is False else min(now_c.values())

    def _refuse_hot(self, now_c: Mapping[str, float]) -> None:
        """Raise Fault `overheated` if a sensor or the heater is above its limit."""
        hottest = max(now_c, key=lambda name: now_c[name])
        too_hot = self.heater is not None and self.heater.heating is not None and self.heater.heating.cause == "too_hot"
        if now_c[hottest] > self.section.max_temperature_c or too_hot:
            limit_c = HEATER_LIMIT_C if too_hot else self.section.max_temperature_c
            raise Fault(
                "overheated",
                f"{hottest} is at {now_c[hottest]:.1f} °C, and the limit is {limit_c:g} °C",
                "Let it cool; heat with less power (procedure.heater_power) or from farther away, then resume",
            )

    def _refuse_fast(self, name: str, read_s: float, temperature_c: float) -> None:
        """Raise Fault `too_fast` if the temperature changes too fast.

        The rate is computed from the times of the readings, not of their arrival, which may be late.
        """
        history = self._history.setdefault(name, deque())
        if history and read_s <= history[-1][0]:
            return
        history.append((read_s, temperature_c))
        while history[-1][0] - history[0][0] > RATE_SPAN_S:
            history.popleft()
        if history[-1][0] - history[0][0] < MIN_RATE_SPAN_S:
            return
        times_s, temperatures_c = np.array(history).T
        k_per_min = 60 * float(np.polynomial.polynomial.polyfit(times_s - times_s[0], temperatures_c, 1)[1])
        if abs(k_per_min) > self.section.max_rate_k_per_min:
            raise Fault(
                "too_fast",
                f"the temperature of {name} changes by {k_per_min:+.1f} K/min, and at most "
                f"{self.section.max_rate_k_per_min:g} K/min are allowed: its thermometer then has another temperature "
                "than its sensing element",
                "Heat or cool more slowly, or allow more (procedure.max_rate_k_per_min), then resume",
            )

    def _heat(self, time_s: float, now_c: Mapping[str, float]) -> None:
        """Send the heater one command."""
        if self._ramp is None or self.heater is None or self.course.warming is None:
            return
        ends_c = self.section.from_c - OVERTRAVEL_K, self.section.to_c + OVERTRAVEL_K
        goal_c = min(ends_c[self.course.warming], HEATER_LIMIT_C - HEATER_MARGIN_K)
        self.heater.keep_heating(self._ramp.power(time_s, max(now_c.values()), goal_c))


def range_not_reached(missing: str, why: str) -> Fault:
    """Return the fault of a run that ends before it has covered the range."""
    return Fault(
        "range_not_reached",
        f"{missing}; {why}",
        "Warm or cool the sensors further, then resume; or name the range that they reach, and start a new run",
    )

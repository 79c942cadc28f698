"""The temperatures of the simulated board and its parts: one body, a heater on it, air around it."""

from math import expm1

import numpy as np

from rig.config.world.thermal import SimulatedThermalSection


class HeatedPart:
    """A sensor on the body. Its thermometer follows the body, its elements follow the thermometer with hysteresis.

    The hysteresis is a play operator: `branch` is 1 after warming, -1 after cooling, in between during a reversal.
    """

    def __init__(self, section: SimulatedThermalSection) -> None:
        self._section = section
        self._thermometer_c = self._element_c = self._play_c = section.start_c
        self._offset_k = 0.0

    def advance(self, body_c: float, heater_w: float, dt_s: float) -> None:
        """Let the part follow the body's temperature for `dt_s`; the heater's power also warms the elements."""
        section = self._section
        self._thermometer_c += (body_c - self._thermometer_c) * _settle(dt_s, section.thermometer_lag_s)
        self._element_c += (self._thermometer_c - self._element_c) * _settle(dt_s, section.element_lag_s)
        self._offset_k += (section.gradient_k_w * heater_w - self._offset_k) * _settle(dt_s, section.element_lag_s)
        half_k, input_c = section.hysteresis_k / 2, self._element_c + self._offset_k
        self._play_c = min(max(self._play_c, input_c - half_k), input_c + half_k)

    def thermometer_c(self, _time_s: float) -> float:
        """Return the thermometer's reading, °C, at a time within the last tick."""
        return self._thermometer_c

    def temperature_c(self, _time_s: float) -> float:
        """Return the temperature of the sensing elements, °C."""
        return self._element_c + self._offset_k

    def branch(self, time_s: float) -> float:
        """Return the branch of the hysteresis, from -1 to 1."""
        return (self.temperature_c(time_s) - self._play_c) / (self._section.hysteresis_k / 2)


class HeatedBody:
    """The board as one body at `temperature_c`, °C. A test may set `air_c`, which overrides the air's temperature."""

    def __init__(self, section: SimulatedThermalSection) -> None:
        self._section = section
        self.temperature_c = section.start_c
        self.air_c: float | None = None
        self._time_s = 0.0
        self._parts: dict[str, HeatedPart] = {}

    def part(self, name: str) -> HeatedPart:
        """Return the heated part `name` of the body; a new part has the starting temperature."""
        return self._parts.setdefault(name, HeatedPart(self._section))

    def advance(self, time_s: float, duty: float, *, powered: bool) -> None:
        """Simulate until `time_s`, with the heater's pin on for the fraction `duty` of the time."""
        section, dt_s = self._section, time_s - self._time_s
        if dt_s <= 0:
            return
        self._time_s = time_s
        heater_w = duty * section.heater_w
        power_w = heater_w + (section.own_w if powered else 0.0)
        final_c = self._air_at(time_s) + power_w / section.loss_w_k
        self.temperature_c += (final_c - self.temperature_c) * _settle(dt_s, section.capacity_j_k / section.loss_w_k)
        for part in self._parts.values():
            part.advance(self.temperature_c, heater_w, dt_s)

    def _air_at(self, time_s: float) -> float:
        if self.air_c is not None:
            return self.air_c
        if len(self._section.air_c) == 1:
            return self._section.air_c[0][1]
        times, temperatures = zip(*self._section.air_c, strict=True)
        return float(np.interp(time_s, times, temperatures))


def _settle(dt_s: float, time_constant_s: float) -> float:
    """Return the fraction of a step that a first-order lag has completed after `dt_s`."""
    return -expm1(-dt_s / time_constant_s)

"""A sensor's samples on the controller's clock, and their averages with the variance of the mean."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import RATE, TEMPERATURE, Quantity
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.estimation.temperature.over_temperature import OverTemperature
from rig.observation.motion.known_motion import KnownMotion
from rig.observation.statistics.mean import Mean
from rig.observation.timebase import TimeBase, estimate_time_base
from rig.observation.windows import Window

NO_STEPS = Steps(0.0)


@dataclass(frozen=True, slots=True)
class Average:
    """Readings averaged: mean (3,) rad/s, variance (3,) of that mean in (rad/s)², noise (3,) of one sample in rad/s.

    The variance of a revolution or a rest also holds the drift of the bias from rest to rest, `drift_rad2_s2` (3,).
    `start_s`, `end_s`: between which times, on the controller's clock. `attitude` (3, 3) is the mean rotation from the
    arm's base frame into the flange's, None where no arm tells it. `freedom` (3,): with how many degrees of freedom the
    noise's part of the variance is known, infinite where nobody counted. `lines_hz` (k,): frequencies of what vibrates
    and was taken out of the mean. `rounding_rad2_s2` (3,) is the part of the variance that is of the rounding to steps.
    """

    mean_rad_s: Array
    variance_rad2_s2: Array
    noise_rad_s: Array
    samples: int
    start_s: float
    end_s: float
    temperature_c: float
    attitude: Array | None = None
    drift_rad2_s2: Array | float = 0.0
    freedom: Array | float = np.inf
    lines_hz: Array = field(default_factory=partial(np.zeros, 0))
    rounding_rad2_s2: Array | float = 0.0

    @property
    def duration_s(self) -> float:
        """Duration of what was averaged."""
        return self.end_s - self.start_s

    @property
    def noise_rad2_s2(self) -> Array:
        """(3,) the part of the variance that is of the noise, (rad/s)²."""
        return self.variance_rad2_s2 - self.drift_rad2_s2 - self.rounding_rad2_s2

    @property
    def mean_std_rad_s(self) -> Array:
        """(3,) standard deviation of the mean."""
        std: Array = np.sqrt(self.variance_rad2_s2)
        return std


@dataclass(frozen=True, slots=True)
class Stream:
    """A sensor's samples in physical units, on the controller's clock; by `polynomials` at one temperature.

    Its rates come in `steps`.
    """

    sensor: RecordedSensor
    clock: TimeBase
    time_s: Array
    board_time_s: Array
    readings_rad_s: Array
    raw: NDArray[Any]
    polynomials: Mapping[Quantity, OverTemperature] = field(default_factory=dict)
    steps: Steps = NO_STEPS

    def at_reference(self, polynomials: Mapping[Quantity, OverTemperature]) -> "Stream":
        """A stream whose readings are those at the reference of these polynomials."""
        taken = replace(self, polynomials=polynomials)
        return replace(taken, readings_rad_s=taken.taken(RATE, self.readings_rad_s, slice(None)))

    def taken(self, quantity: Quantity, readings: Array, inside: slice) -> Array:
        """Readings (n, 3) of the samples inside, at the reference temperature if there are polynomials of them."""
        if quantity not in self.polynomials:
            return readings
        warm = self.sensor.channel(TEMPERATURE).values(self.raw[inside])
        return self.polynomials[quantity].correct_to_reference(readings, warm)

    def temperature_c(self, inside: slice) -> float:
        """The mean of the samples inside, NaN of a sensor whose temperature nothing tells."""
        if not self.sensor.measures(TEMPERATURE):
            return float("nan")
        thermometer = self.sensor.channel(TEMPERATURE)
        return float(thermometer.in_unit(float(thermometer.counts(self.raw)[inside].mean())))


def on_the_arms_clock(raw: NDArray[Any], sensor: RecordedSensor, motion: KnownMotion) -> Stream:
    """Samples (n,) of a gyroscope in rad/s at the controller's times. Raises Fault as `estimate_time_base` does."""
    readings = sensor.channel(RATE).values(raw)
    return on_clock(raw, sensor, estimate_time_base(raw["board_time_us"] * 1e-6, readings, motion))


def on_clock(raw: NDArray[Any], sensor: RecordedSensor, clock: TimeBase) -> Stream:
    """Samples (n,) of a gyroscope in rad/s at the controller's times, by a board's clock that is known."""
    board_time_s = raw["board_time_us"] * 1e-6
    readings = sensor.channel(RATE).values(raw)
    return Stream(
        sensor,
        clock,
        clock.controller_time_s(board_time_s),
        board_time_s,
        readings,
        raw,
        steps=steps_of(raw, sensor, RATE),
    )


def steps_of(raw: NDArray[Any], sensor: RecordedSensor, quantity: Quantity) -> Steps:
    """The steps in which a quantity of all samples (n,) of a sensor comes: a board records the converter's counts."""
    channel = sensor.channel(quantity)
    return channel.steps(channel.values(raw), trusts_counts=sensor.on_board)


def between(stream: Stream, start_s: float, end_s: float) -> slice:
    """The samples taken between two controller times."""
    return slice(*np.searchsorted(stream.time_s, [start_s, end_s]).tolist())


def averaged(stream: Stream, inside: slice, window: Window, mean: Mean) -> Average:
    """The `mean` of the samples inside, and the window it is over, with when and how warm it was."""
    return Average(
        mean_rad_s=mean.mean,
        variance_rad2_s2=mean.variance,
        noise_rad_s=mean.noise,
        samples=mean.samples,
        start_s=window.start_s,
        end_s=window.end_s,
        temperature_c=stream.temperature_c(inside),
        freedom=mean.freedom,
        lines_hz=mean.cycles / (window.end_s - window.start_s),
        rounding_rad2_s2=mean.rounding,
    )

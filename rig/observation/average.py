"""A sensor's samples on the controller's clock, and averages of them with the variance of the mean."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import RATE, TEMPERATURE, Quantity
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.clocks.clock_estimate import estimate_time_base
from rig.observation.clocks.time_base import TimeBase
from rig.observation.motion.reference_motion import KnownMotion
from rig.observation.statistics.mean import Mean
from rig.observation.windows import Window

if TYPE_CHECKING:
    from rig.estimation.temperature.temperature_polynomials import OverTemperature

NO_STEPS = Steps(0.0)


@dataclass(frozen=True, slots=True)
class Average:
    """The average of a gyroscope's readings over a window, and its uncertainty.

    - mean_rad_s (3,): the mean.
    - variance_rad2_s2 (3,): variance of the mean, including bias drift and rounding.
    - noise_rad_s (3,): standard deviation of one sample.
    - start_s, end_s: the window on the controller's clock.
    - attitude (3, 3): mean rotation from the arm's base frame into the flange's; None without an arm.
    - drift_rad2_s2 (3,): the part of the variance due to bias drift from rest to rest.
    - dof (3,): degrees of freedom of `noise_rad2_s2`, infinite if the noise counts as known.
    - lines_hz (k,): frequencies of the vibrations removed from the mean.
    - rounding_rad2_s2, slow_lines_rad2_s2 (3,): the parts of the variance due to rounding, and to spectral lines that
      are too slow to remove.
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
    dof: Array | float = np.inf
    lines_hz: Array = field(default_factory=partial(np.zeros, 0))
    rounding_rad2_s2: Array | float = 0.0
    slow_lines_rad2_s2: Array | float = 0.0

    @property
    def duration_s(self) -> float:
        """Duration of the window, s."""
        return self.end_s - self.start_s

    @property
    def noise_rad2_s2(self) -> Array:
        """The part (3,) of the variance due to noise, (rad/s)²."""
        return self.variance_rad2_s2 - self.drift_rad2_s2 - self.rounding_rad2_s2 - self.slow_lines_rad2_s2

    @property
    def mean_std_rad_s(self) -> Array:
        """The standard deviation (3,) of the mean, rad/s."""
        std: Array = np.sqrt(self.variance_rad2_s2)
        return std


@dataclass(frozen=True, slots=True)
class Stream:
    """A sensor's n samples: its rates in physical units, and their times on the controller's clock.

    - time_s (n,): the times on the controller's clock, which `clock` converts from board_time_s (n,).
    - readings_rad_s (n, 3): the rates, corrected to one temperature if there are `polynomials` of the rate.
    - raw (n,): the samples as recorded.
    - polynomials: by quantity, the dependence of readings on temperature that is removed from them; empty if none is.
    - steps: the resolution of the recorded rates.
    """

    sensor: RecordedSensor
    clock: TimeBase
    time_s: Array
    board_time_s: Array
    readings_rad_s: Array
    raw: NDArray[Any]
    polynomials: Mapping[Quantity, "OverTemperature"] = field(default_factory=dict)
    steps: Steps = NO_STEPS

    def correct_to_reference(self, polynomials: Mapping[Quantity, "OverTemperature"]) -> "Stream":
        """Return the stream with its rates corrected to the polynomials' reference temperature."""
        stream = replace(self, polynomials=polynomials)
        return replace(stream, readings_rad_s=stream.correct_temperature(RATE, self.readings_rad_s, slice(None)))

    def correct_temperature(self, quantity: Quantity, readings: Array, inside: slice) -> Array:
        """Return a quantity's `readings` (n, 3), taken in the slice `inside`, corrected to the reference temperature.

        Without polynomials of this quantity, the readings are returned unchanged.
        """
        if quantity not in self.polynomials:
            return readings
        warm = self.sensor.channel(TEMPERATURE).values(self.raw[inside])
        return self.polynomials[quantity].correct_to_reference(readings, warm)

    def temperature_c(self, inside: slice) -> float:
        """Return the mean temperature in the slice `inside`; NaN if nothing measures the sensor's temperature."""
        if not self.sensor.measures(TEMPERATURE):
            return float("nan")
        thermometer = self.sensor.channel(TEMPERATURE)
        return float(thermometer.convert(float(thermometer.counts(self.raw)[inside].mean())))


def synchronize_stream(raw: NDArray[Any], sensor: RecordedSensor, motion: KnownMotion) -> Stream:
    """Return a gyroscope's samples (n,) in rad/s at controller times. Raise Fault as `estimate_time_base` does."""
    readings = sensor.channel(RATE).values(raw)
    return convert_stream(raw, sensor, estimate_time_base(raw["board_time_us"] * 1e-6, readings, motion))


def convert_stream(raw: NDArray[Any], sensor: RecordedSensor, clock: TimeBase) -> Stream:
    """Return a gyroscope's samples (n,) in rad/s at controller times, which the time base `clock` gives."""
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
    """Return the resolution steps of a quantity in a sensor's samples (n,).

    If a board reads the sensor, the steps are those of its analogue-to-digital converter.
    """
    channel = sensor.channel(quantity)
    return channel.steps(channel.values(raw), trusts_counts=sensor.on_board)


def slice_time(stream: Stream, start_s: float, end_s: float) -> slice:
    """Return the slice of the samples between two controller times."""
    return slice(*np.searchsorted(stream.time_s, [start_s, end_s]).tolist())


def build_average(stream: Stream, inside: slice, window: Window, mean: Mean) -> Average:
    """Return an `Average` over `window` from the `mean` of the samples in the slice `inside`, and their temperature."""
    return Average(
        mean_rad_s=mean.mean,
        variance_rad2_s2=mean.variance,
        noise_rad_s=mean.noise,
        samples=mean.samples,
        start_s=window.start_s,
        end_s=window.end_s,
        temperature_c=stream.temperature_c(inside),
        dof=mean.dof,
        lines_hz=mean.cycles / (window.end_s - window.start_s),
        rounding_rad2_s2=mean.rounding,
        slow_lines_rad2_s2=mean.slow_lines,
    )

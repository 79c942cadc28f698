"""Readings of one sensor in SI units on the arm's clock, of any quantity."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, FIELD, RATE, TEMPERATURE, Quantity, Scalar
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.notebook.frames import frame
from rig.notebook.html import table
from rig.observation.average import synchronize_stream
from rig.observation.motion.arm_motion import motion_of
from rig.observation.observed_run import one_clock, times_s
from rig.observation.windows import FinishedSweep, Window, swept

if TYPE_CHECKING:
    from pandas import DataFrame

    from rig.notebook.reading_plots import Plot

HEADINGS = ("sensor", "part", "serial number", "measures", "Hz", "samples", "readings")


class NoSuchSensor(Refused, KeyError):
    """The refusal of an unknown sensor; also a KeyError, so that `name in run` and `run.get(name)` work."""


@dataclass(frozen=True, eq=False)
class Signal:
    """A sensor's readings of one quantity, in its SI unit.

    `time_s` (n,) is on the arm's clock; `values` are (n, 3), for a temperature or a pressure (n,). `sweeps` are the
    windows of the arm's sweeps.
    """

    name: str
    quantity: Quantity | Scalar
    time_s: Array
    values: Array
    sweeps: Sequence[Window]

    @property
    def unit(self) -> str:
        """The unit of the values."""
        return self.quantity.unit

    def columns(self) -> dict[str, Array]:
        """Return columns (n,) by name and unit: `x_rad_s`, `y_rad_s`, `z_rad_s`."""
        values = self.values.reshape(len(self.time_s), -1)
        return {name: values[:, i] for i, name in enumerate(self.quantity.columns)}

    def to_frame(self) -> "DataFrame":
        """Return the columns as a pandas table over `time_s`. Raise Refused `missing_extra`."""
        return frame(self.columns(), self.time_s.tolist(), "time_s")

    def plot(self) -> "Plot":
        """Return a plot of the values over time, with the sweeps shaded. Raise Refused `missing_extra`."""
        from rig.notebook.reading_plots import plot_readings

        letters = getattr(self.quantity, "axes", ("",))
        by_axis = dict(zip(letters, self.columns().values(), strict=True))
        return plot_readings(self.time_s, by_axis, self.sweeps, f"{self.name}, {self.quantity.name} {self.unit}")

    def __repr__(self) -> str:
        return f"<{self.name}, {self.quantity.name}: {len(self.time_s)} readings in {self.unit}>"


@dataclass(frozen=True, eq=False)
class Readings:
    """One sensor's readings in all recordings of a movement, in their order.

    `rate`, `acceleration`, `field` and `temperature` are its signals, if it measures them; `signal` returns others.
    """

    name: str
    sensor: RecordedSensor
    recordings: Sequence[RunData]

    @property
    def quantities(self) -> tuple[str, ...]:
        """The names of the measured quantities; `on_arm_clock` and `plot` use the first one."""
        names = [channel.quantity for channel in self.sensor.channels]
        return tuple(sorted(names, key=lambda name: name != RATE.name))

    @property
    def rate(self) -> Signal:
        """The rates of a gyroscope, rad/s."""
        return self.signal(RATE.name)

    @property
    def acceleration(self) -> Signal:
        """The specific forces of an accelerometer in m/s²; at rest they point up."""
        return self.signal(ACCELERATION.name)

    @property
    def field(self) -> Signal:
        """The magnetic fields of a magnetometer in T."""
        return self.signal(FIELD.name)

    @property
    def temperature(self) -> Signal:
        """The temperatures of the sensor's own thermometer in °C."""
        return self.signal(TEMPERATURE.name)

    def signal(self, quantity: str) -> Signal:
        """Return the readings of `quantity`. Raise Refused `no_such_quantity`; Fault as `estimate_time_base` does."""
        channel = next((channel for channel in self.sensor.channels if channel.quantity == quantity), None)
        if channel is None:
            raise Refused(
                "no_such_quantity",
                f"the sensor {self.name} does not measure {quantity}",
                f"It measures {', '.join(self.quantities)}",
            )
        values = np.concatenate([channel.values(run.samples[self.name]) for run in self.recordings])
        return Signal(self.name, channel.measures, self._time_s, values, self._windows)

    def on_arm_clock(self) -> tuple[Array, Array]:
        """Return controller times (n,) in s and readings (n, 3) in SI units: rates if the sensor has them.

        Raise Fault as `estimate_time_base` does.
        """
        signal = self.signal(self.quantities[0])
        return signal.time_s, signal.values

    @property
    def samples(self) -> NDArray[Any]:
        """The samples (n,), SAMPLE_DTYPE: counts, board times and sequence numbers as sent by the board."""
        return np.concatenate([run.samples[self.name] for run in self.recordings])

    def to_frame(self, sweep: int | None = None) -> "DataFrame":
        """Return all quantities as a pandas table over `time_s`, SI units in the names, optionally of one `sweep`.

        Sweeps are numbered as in `result.json`; if a sweep was repeated, its last recording is used. Raise Refused
        `missing_extra`, `no_such_sweep`; Fault as `on_arm_clock` does.
        """
        columns: dict[str, Array] = {}
        for quantity in self.quantities:
            columns |= self.signal(quantity).columns()
        inside = np.ones(len(self._time_s), dtype=np.bool_)
        if sweep is not None:
            window = self._window(sweep)
            inside = (self._time_s >= window.start_s) & (self._time_s <= window.end_s)
        times = self._time_s[inside].tolist()
        return frame({name: column[inside] for name, column in columns.items()}, times, "time_s")

    def to_dict(self) -> dict[str, Any]:
        """Return the sensor's description as plain numbers and texts, without the samples."""
        return {"name": self.name, **asdict(self.sensor), "samples": len(self.samples)}

    def plot(self) -> "Plot":
        """Return a plot of the three axes over time, with the sweeps shaded. Raise Refused `missing_extra`."""
        return self.signal(self.quantities[0]).plot()

    def row(self) -> tuple[str, ...]:
        """Return the sensor in words, for the columns `HEADINGS`."""
        sensor, measures = self.sensor, ", ".join(self.quantities)
        rate = f"{sensor.rate_hz:g}"
        return self.name, sensor.part, sensor.serial_number, measures, rate, str(len(self.samples)), sensor.mode

    @cached_property
    def _time_s(self) -> Array:
        """The times (n,), s, of all samples, computed once; for readings from files, the times in the file."""
        if any(run.external is not None for run in self.recordings):
            times_of_file: Array = self.samples["host_time_s"]
            return times_of_file
        return np.concatenate([times_s(run, self.name, self._bases(run)) for run in self.recordings])

    def _bases(self, run: RunData) -> Mapping[str, Any]:
        """Return the time base of this sensor or else of a gyroscope on the same clock, by its name; empty if none."""
        gyroscopes = run.measuring(RATE)
        others = (name for name in gyroscopes if one_clock(run, self.name, name))
        source = self.name if self.name in gyroscopes else next(others, None)
        return (
            {}
            if source is None
            else {source: synchronize_stream(run.samples[source], gyroscopes[source], motion_of(run)).clock}
        )

    @cached_property
    def _finished_sweeps(self) -> Sequence[FinishedSweep]:
        return [finished for run in self.recordings for finished in swept(run)]

    @property
    def _windows(self) -> Sequence[Window]:
        return [finished.window for finished in self._finished_sweeps]

    def _window(self, sweep: int) -> Window:
        windows = {finished.sweep.index: finished.window for finished in self._finished_sweeps}
        if sweep not in windows:
            choices = f"Choose one of: {', '.join(map(str, sorted(windows)))}" if windows else "Leave the sweep out"
            raise Refused("no_such_sweep", f"no sweep {sweep} was finished in this recording", choices)
        return windows[sweep]

    def __repr__(self) -> str:
        name, part, serial_number, measures, rate_hz, samples, mode = self.row()
        return f"<{name}: {part} {serial_number}, {measures}, {samples} samples at {rate_hz} Hz, {mode}>"

    def _repr_html_(self) -> str:
        return table(self.name, HEADINGS, [self.row()])

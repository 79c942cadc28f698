"""The host end of a device that sends lines of text: a thread that reads, and a named error for each fault.

Nothing is sent to the device. It has no identification, so only its lines show that it is the configured one.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.config.sensors.lines_section import LinesSection
from rig.config.sensors.sensor_sections import OwnPortSection
from rig.config.units import UNITS
from rig.errors.quoting import quote
from rig.estimation.arrays import Array
from rig.sensors.errors import SensorError
from rig.sensors.lines.decoding import LineBatch, LineReader
from rig.sensors.lines.stamping import Stamper, is_coarse
from rig.sensors.lines.time_steps import find_time_step_s
from rig.sensors.own_port import OwnPort, PortFaults, closing_on_failure, open_device_port
from rig.sensors.port_silence import PATIENCE, Patience

MIN_RATE_SAMPLES, MIN_RATE_S = 50, 0.5  # and time by the device's clock, from which its rate is judged
QUOTED_CHARACTERS = 60  # of a line
MAX_UNPRINTABLE = 0.05  # fraction of bytes above which the baud rate is wrong
MAX_REJECTED = 0.5  # fraction of lines above which a stream is useless
MIN_REJECTED_LINES = 200  # for that
RATE_TOLERANCE = 0.03
TIME_UNITS = ("ns", "us", "ms", "s")
STAMP_ROUNDING_STEPS = 2.0  # error of a time interval: one step of the time stamps at either end
_CABLE = "Check its supply and cable, and whether another program has the port"

# Values (n, columns) as printed, their numbers (n,) from 0, their times (n,) in µs, and the time of the read.
OnValues = Callable[[Array, NDArray[np.int64], NDArray[np.int64], float], None]


@dataclass(slots=True)
class Counts:
    """Counts of samples, of comments, and of lines rejected before (`before`) and after (`damaged`) the first sample.

    `first_other`: the beginning of the first rejected line, empty if there is none.
    """

    samples: int = 0
    comments: int = 0
    before: int = 0
    damaged: int = 0
    first_other: bytes = b""

    def add(self, decoded: LineBatch) -> None:
        """Count the lines in a block of data that was read."""
        has_samples = self.samples > 0
        boot = 0 if has_samples else int(np.count_nonzero(decoded.samples_before == 0))
        self.before += boot
        self.damaged += len(decoded.samples_before) - boot
        self.samples += len(decoded.values)
        self.comments += decoded.comments
        self.first_other = self.first_other or decoded.first_rejected


class LinesDevice:
    """A device on a serial port or `socket://host:port`, which stays open until `close`.

    A thread reads the port and calls `on_values`. Errors are SensorErrors with names that begin with `lines_`; their
    messages name the configured `sensor`.
    """

    def __init__(
        self,
        sensor: str,
        line: OwnPortSection,
        section: LinesSection,
        rate_hz: float,
        on_values: OnValues | None = None,
        *,
        patience: Patience = PATIENCE,
    ) -> None:
        """Open the port, and read until samples come at the stated rate.

        Raise SensorError `no_port`, `lines_silent`, `lines_wrong_baud_rate`, `lines_other_format`, `lines_other_rate`,
        `lines_time_stands`, `lines_time_jumped`.
        """
        self._sensor, self._line, self._section, self._rate_hz = sensor, line, section, rate_hz
        self._on_values = on_values
        self._lines = LineReader(section)
        self.counts = Counts()
        self._stamper: Stamper | None = None  # while it streams
        self._skipped = 0  # rejected lines since the last sample
        self._first_blocks: list[Array] = []  # values before the stream starts
        faults = PortFaults(
            closed=SensorError("lines_link_lost", f"{self.where}: the port closed", _CABLE),
            silent=SensorError("lines_link_lost", f"{self.where} has sent no sample", _CABLE),
            not_taken=SensorError("lines_not_taken", self.where, "See the run's log"),
        )
        serial = open_device_port(line.port, line.baud, owner=f"sensors.{sensor}: ", setting="serial.port")
        self.own_port = OwnPort(serial, line.port, faults, self._take, patience=patience)
        self.own_port.begin()
        with closing_on_failure(self.close):
            self.rate_hz = self._look(patience.first_s)

    @property
    def where(self) -> str:
        """The device's name in messages."""
        return f"sensors.{self._sensor}: the device on {self._line.port}"

    @property
    def first_values(self) -> Array:
        """The values (n, columns) read before the stream starts."""
        return np.concatenate(self._first_blocks)

    @property
    def time_step_s(self) -> float:
        """The step, s, of the time in the device's lines; 0 if they contain none."""
        if self._section.time is None or not self._first_blocks:
            return 0.0
        printed = self.first_values[:, self._section.columns.index("time")]
        return find_time_step_s(printed, self._lines.time_decimals, self._section.time.unit)

    def start(self) -> None:
        """Pass values to `on_values`, beginning with the next line."""
        with self.own_port.news:
            self._stamper = Stamper(self._section, self._rate_hz, self.where, self.time_step_s)
            self._skipped = 0
            self.own_port.stream(2 / self._rate_hz)

    def close(self) -> None:
        """End the thread and close the port. May be called twice."""
        self.own_port.close()

    # -- the first lines -----------------------------------------------------------------------------------------
    def _look(self, timeout_s: float) -> float:
        """Wait for samples; return their rate by the device's own time, NaN if it sends none.

        Raise SensorError if no sample comes within `timeout_s`, or if the rate is not the configured one.
        """
        has_enough = self.own_port.wait(self._has_enough, timeout_s)
        if not has_enough and not self.counts.samples:
            raise self._why_no_sample(timeout_s)
        rate_hz = self._measure_rate_hz()
        if not self._is_stated(rate_hz):
            raise SensorError(
                "lines_other_rate",
                f"{self.where} sends {rate_hz:.4g} samples a second, but sensors.{self._sensor}.rate_hz is "
                f"{self._rate_hz:g}",
                self._advise_on_rate(rate_hz),
            )
        return rate_hz

    def _is_stated(self, rate_hz: float) -> bool:
        """Return whether the rate is the stated one, as far as the times show it; true for NaN."""
        return not abs(rate_hz / self._rate_hz - 1) > max(RATE_TOLERANCE, self._rate_error)

    def _advise_on_rate(self, rate_hz: float) -> str:
        """Return the remedy for samples at another rate: the times' unit, if in another one the rate is as stated."""
        if self._section.time is not None:
            size_s = UNITS[self._section.time.unit].size
            for unit in TIME_UNITS:
                if self._is_stated(rate_hz * size_s / UNITS[unit].size):
                    return f"If its times are in {unit}, the rate is as stated: set lines.time.unit to {unit}"
        return (
            "Set rate_hz to what it sends; if that is too little, its program prints for too long: raise the speed of "
            "the line, or print less"
        )

    def _has_enough(self) -> bool:
        """Return whether the samples suffice to judge the rate. At a low rate few suffice; coarse times need more."""
        if self._section.time is None:
            return self.counts.samples >= 3
        is_long_enough = self.counts.samples >= 5 and self._span_s() >= MIN_RATE_S
        return (is_long_enough or self.counts.samples >= MIN_RATE_SAMPLES) and self._rate_error <= RATE_TOLERANCE

    @property
    def _rate_error(self) -> float:
        """The relative error of the measured rate that the steps of coarse times cause; 0 if the times are fine."""
        step_s, span_s = self.time_step_s, self._span_s()
        if not is_coarse(step_s, self._rate_hz):
            return 0.0
        return STAMP_ROUNDING_STEPS * step_s / span_s if span_s > 0 else float("inf")

    def _span_s(self) -> float:
        if self._section.time is None or not self._first_blocks:
            return 0.0
        printed = np.concatenate(self._first_blocks)[:, self._section.columns.index("time")]
        passed = np.diff(printed)
        if self._section.time.wrap:
            passed %= self._section.time.wrap
        return float(passed.sum()) * UNITS[self._section.time.unit].size

    def _measure_rate_hz(self) -> float:
        """Return the sample rate, from the median step of the device's time or, if times are coarse, the total time.

        Raise SensorError `lines_time_stands`, `lines_time_jumped`.
        """
        time_section = self._section.time
        if time_section is None or self.counts.samples < 5:
            return float("nan")
        span_s, step_s = self._span_s(), self.time_step_s
        unit_s = UNITS[time_section.unit].size
        printed = self.first_values[:, self._section.columns.index("time")]
        steps = np.diff(printed)
        if not is_coarse(step_s, self._rate_hz):
            steps = steps[steps != 0]  # a line that is printed twice is one sample
        count = len(steps)
        typical_s = float(np.median(steps)) * unit_s if count else 0.0
        if span_s <= 0 and np.ptp(printed) > 0:
            raise SensorError(
                "lines_time_jumped",
                f"{self.where} prints times that go back, from {printed.max():.15g} to {printed.min():.15g}",
                "If its time starts again at zero, set lines.time.wrap to the number at which it does; else it was "
                "restarted: look at its supply",
            )
        if span_s <= 0:
            raise SensorError(
                "lines_time_stands",
                f"{self.where} prints the same time {printed[0]:.15g} again and again",
                "See which column is the time, and in which unit: `rig lines PORT` shows it",
            )
        coarse = typical_s < 50 * step_s
        return count / span_s if coarse else 1 / typical_s if typical_s > 0 else count / span_s

    def _why_no_sample(self, timeout_s: float) -> SensorError:
        """Return the error of a device without samples: silent, at another speed, or of another format."""
        reader, counts = self._lines, self.counts
        if not reader.byte_count:
            return SensorError("lines_silent", f"{self.where} has sent nothing within {timeout_s:g} s", _CABLE)
        if reader.unprintable > MAX_UNPRINTABLE * reader.byte_count or not (counts.before or counts.comments):
            return SensorError(
                "lines_wrong_baud_rate",
                f"{reader.byte_count} bytes came from {self.where} at {self._line.baud} Bd, but they are not lines of "
                "text",
                "Set serial.baud to what the device's program sets; `rig lines` finds it",
            )
        first = counts.first_other[:QUOTED_CHARACTERS].decode("ascii", "replace")
        return SensorError(
            "lines_other_format",
            f"{self.where} prints other lines than sensors.{self._sensor}.lines states, such as {quote(first)}",
            "Correct the section, or let `rig lines` write one; if it is another device, correct serial.port",
        )

    # -- the reader's thread ---------------------------------------------------------------------------------------
    def _take(self, data: bytes, host_time_s: float) -> None:
        """Decode received bytes, count their lines, and pass the samples on with numbers and times."""
        decoded = self._lines.feed(data)
        with self.own_port.news:
            self.own_port.silence.note(len(decoded.values))
            if not data:
                return
            self.counts.add(decoded)
            stamper = self._stamper
            if stamper is None and len(decoded.values):
                self._first_blocks.append(decoded.values)
            self.own_port.news.notify_all()
        if stamper is None:
            return
        self._refuse_damage()
        self._skipped += len(decoded.samples_before)
        if not len(decoded.values):
            return
        is_sample, numbers, times_us = stamper.stamp(decoded.values, self._skipped, host_time_s)
        self._skipped = 0
        if self._on_values is not None and len(numbers):
            self._on_values(decoded.values[is_sample], numbers, times_us, host_time_s)

    def _refuse_damage(self) -> None:
        """Raise SensorError `lines_damaged` if too many lines are not samples."""
        counts = self.counts
        if counts.damaged > MIN_REJECTED_LINES and counts.damaged > MAX_REJECTED * (counts.samples + counts.damaged):
            raise SensorError(
                "lines_damaged",
                f"{self.where}: {counts.damaged} of {counts.samples + counts.damaged} lines are not samples, such as "
                f"{quote(counts.first_other[:QUOTED_CHARACTERS].decode('ascii', 'replace'))}",
                "Check the cable and the speed of the line; see that nothing else prints there",
            )

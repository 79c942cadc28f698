"""What the board does for its sensors, for one without a board: its readings corrected before they are recorded.

So a KVH 1775 is verified by the same movement and the same comparison, though it cannot keep a calibration itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_host.client import Calibration
from rig.data.quantity import RATE
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.runner.board.sensors import corrected
from rig.sensors.source import OnSamples, SampleSource


@dataclass(frozen=True, slots=True)
class HostCorrected:
    """A source of sensors whose samples pass by `correcting` on their way, by their names."""

    source: SampleSource
    calibrations: Mapping[str, Calibration]

    @property
    def sensors(self) -> dict[str, RecordedSensor]:
        """Sensors as of `SampleSource`: rates in the same counts, corrected, no accelerations; fields as they come."""
        return {
            name: corrected(sensor, self.calibrations[name], sensor.channel(RATE).unit_per_count)
            if name in self.calibrations
            else sensor
            for name, sensor in self.source.sensors.items()
        }

    def start(self) -> None:
        """Start the source's samples, as of `SampleSource`."""
        self.source.start()

    def check(self, clock_s: float | None = None) -> None:
        """Check the source, as of `SampleSource`."""
        self.source.check(clock_s)


def correcting(name: str, raw: RecordedSensor, calibration: Calibration, on_samples: OnSamples) -> OnSamples:
    """Hands on M (m + b) for every reading m of the rates of the sensor `name`, and another's as they are."""
    per_count = raw.channel(RATE).unit_per_count
    described = corrected(raw, calibration, per_count)
    matrix, bias = np.array(calibration.matrix), np.array(calibration.bias_rad_s) / per_count
    rate, dtype = described.channel(RATE).column, described.sample_dtype

    def take(sensor: str, samples: NDArray[Any]) -> None:
        if sensor != name:
            on_samples(sensor, samples)
            return
        rates = np.zeros(len(samples), dtype)
        for field in dtype.names or ():
            rates[field] = samples[field]
        rates[rate] = np.rint((samples[rate] + bias) @ matrix.T)
        on_samples(sensor, rates)

    return take

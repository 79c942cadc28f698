"""The correction of readings on this computer, before recording, for a sensor without a board.

It serves to verify a KVH 1775, which cannot store a calibration.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_host.client import Calibration
from rig.data.quantity import RATE
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.runner.board.sensors import describe_corrected
from rig.sensors.sample_source import OnSamples, SampleSource


@dataclass(frozen=True, slots=True)
class HostCorrected:
    """A source whose samples pass through `correct_rates`; `calibrations` is by sensor name."""

    source: SampleSource
    calibrations: Mapping[str, Calibration]

    @property
    def sensors(self) -> dict[str, RecordedSensor]:
        """The source's sensors; the corrected ones have rates in counts of unchanged size, and no accelerations."""
        return {
            name: describe_corrected(sensor, self.calibrations[name], sensor.channel(RATE).unit_per_count)
            if name in self.calibrations
            else sensor
            for name, sensor in self.source.sensors.items()
        }

    def start(self) -> None:
        """Start the source's samples (see `SampleSource`)."""
        self.source.start()

    def check(self, clock_s: float | None = None) -> None:
        """Check the source (see `SampleSource`)."""
        self.source.check(clock_s)

    def catch_up(self) -> None:
        """Wait for the source's samples (see `SampleSource`)."""
        self.source.catch_up()


def correct_rates(name: str, raw: RecordedSensor, calibration: Calibration, on_samples: OnSamples) -> OnSamples:
    """Return a receiver that corrects the rates of the sensor `name`, and passes all samples on to `on_samples`.

    A rate m becomes M (m + b), with the matrix M and the bias b of `calibration`.
    """
    per_count = raw.channel(RATE).unit_per_count
    described = describe_corrected(raw, calibration, per_count)
    matrix, bias = np.array(calibration.matrix), np.array(calibration.bias_rad_s) / per_count
    column, dtype = described.channel(RATE).column, described.sample_dtype

    def take(sensor: str, samples: NDArray[Any]) -> None:
        if sensor != name:
            on_samples(sensor, samples)
            return
        corrected = np.zeros(len(samples), dtype)
        for field in dtype.names or ():
            corrected[field] = samples[field]
        corrected[column] = np.rint((samples[column] + bias) @ matrix.T)
        on_samples(sensor, corrected)

    return take

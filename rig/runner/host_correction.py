"""What the board does for its sensors, for one without a board: its readings corrected before they are recorded.

So a KVH 1775 is verified by the same movement and the same comparison, though it cannot keep a calibration itself.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_host.client import Calibration
from firmware_host.samples import FIELD_SAMPLE_DTYPE, SAMPLE_DTYPE
from rig.data.run_file import RecordedSensor
from rig.runner.sensors import corrected
from rig.sensors.source import OnSamples, Recorded, SampleSource


@dataclass(frozen=True, slots=True)
class HostCorrected:
    """A source of one sensor whose samples pass by `correcting` on their way."""

    source: SampleSource
    calibration: Calibration

    @property
    def sensors(self) -> dict[str, Recorded]:
        """Sensors as of `SampleSource`: rates in the same counts, corrected, no accelerations; fields as they come."""
        return {
            name: corrected(sensor, self.calibration, sensor.sensitivity_rad_s_per_count)
            if isinstance(sensor, RecordedSensor)
            else sensor
            for name, sensor in self.source.sensors.items()
        }

    def start(self) -> None:
        """Start the source's samples, as of `SampleSource`."""
        self.source.start()

    def check(self, clock_s: float | None = None) -> None:
        """Check the source, as of `SampleSource`."""
        self.source.check(clock_s)


def correcting(calibration: Calibration, sensitivity_rad_s: float, on_samples: OnSamples) -> OnSamples:
    """Hands on M (m + b) for every reading m of a rate, in counts of `sensitivity_rad_s`; a field as it is."""
    matrix, bias = np.array(calibration.matrix), np.array(calibration.bias_rad_s) / sensitivity_rad_s

    def take(sensor: str, samples: NDArray[Any]) -> None:
        if samples.dtype == FIELD_SAMPLE_DTYPE:
            on_samples(sensor, samples)
            return
        rates = np.zeros(len(samples), SAMPLE_DTYPE)
        for field in SAMPLE_DTYPE.names or ():
            rates[field] = samples[field]
        rates["counts"] = np.rint((samples["counts"] + bias) @ matrix.T)
        on_samples(sensor, rates)

    return take

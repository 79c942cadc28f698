"""What a magnetometer read in dwells: its mean readings, each with the attitude the arm stood in. Pure."""

from dataclasses import dataclass

import numpy as np

from rig.data.settings import ObservationThresholds
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.acceleration import check_complete
from rig.observation.average import Mean, mean_of
from rig.observation.observed_run import ObservedRun
from rig.observation.windows import Window


@dataclass(frozen=True, slots=True)
class FieldReading:
    """A dwell of the procedure, by its `index`: the mean reading in tesla; the rest as of a `DwellReading`."""

    index: int
    name: str
    reading: Mean
    attitude: Array
    window: Window


def field_readings(recording: ObservedRun, name: str, thresholds: ObservationThresholds) -> tuple[FieldReading, ...]:
    """What a magnetometer read in the dwells of the recording that an accelerometer was read in.

    The board's one clock stamps all its samples, so a gyroscope's time base serves; how late the magnetometer is beside
    that gyroscope does not matter to a mean at rest. Raises Fault `lost_samples`, `saturation`.
    """
    beside = next((sensor for sensor in recording.sensors.values() if sensor.dwells), None)
    if beside is None:
        return ()
    samples, magnetometer = recording.run.samples[name], recording.run.magnetometers[name]
    time_s = beside.time_base.controller_time_s(samples["board_time_us"] * 1e-6)
    found = []
    for dwell in beside.dwells:
        where = f"dwell {dwell.index} ({dwell.name}) of {name}"
        inside = samples[slice(*np.searchsorted(time_s, [dwell.window.start_s, dwell.window.end_s]).tolist())]
        check_complete(inside, where, thresholds)
        counts = inside["field_counts"].astype(np.int64)
        if np.any(np.abs(counts) >= magnetometer.full_scale_counts):
            raise Fault(
                "saturation",
                f"in {where} the field is beyond the magnetometer's range",
                "Choose a wider range_gauss, or take away the iron beside it",
            )
        per_count_t = magnetometer.sensitivity_t_per_count
        steady, known = np.zeros((len(counts), 1)), np.ones(len(counts), dtype=np.bool_)
        readings_t: Array = counts.astype(np.float64) * per_count_t
        reading = mean_of(readings_t, per_count_t, steady, known, as_before=False)
        found.append(FieldReading(dwell.index, dwell.name, reading, dwell.attitude, dwell.window))
    return tuple(found)

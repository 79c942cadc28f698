"""Placements from an arm's dwells, for the kinds of sensors that installed packages add. Pure functions."""

from collections.abc import Sequence

import numpy as np

from rig.data.quantity import Quantity
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.sensor_axes import nearest_rotation
from rig.observation.average import steps_of
from rig.observation.external.placements import Placements, RestMeans
from rig.observation.observed_run import ObservedRun
from rig.observation.reference.dwell_acceleration import check_complete, trim_dwell
from rig.observation.statistics.mean import Mean, even_mean
from rig.observation.windows import FinishedDwell, Window, dwelt, inside

NO_RESTS = RestMeans({}, {}, {}, (), ())


def placements_on_arm(
    recordings: Sequence[ObservedRun], name: str, quantity: Quantity, thresholds: ObservationThresholds
) -> Placements:
    """Return a sensor's mean readings and attitudes in all dwells; only the last recording of a repeated dwell counts.

    Raise Fault `no_attitudes`, `lost_samples` or `saturation`.
    """
    readings: dict[int, tuple[Window, Mean, Array]] = {}
    for recording in recordings:
        for finished in dwelt(recording.run):
            settled = trim_dwell(recording.run, finished)
            mean = _average_dwell(recording, name, quantity, settled, thresholds)
            readings[settled.dwell.index] = settled.window, mean, _sensor_attitude(recording, name, settled.window)
    if not readings:
        raise Fault(
            "no_attitudes",
            f"recorded only: without attitudes {name} is not calibrated",
            "Use the procedure static_attitudes or imu, which hold attitudes",
        )
    windows, means, attitudes = zip(*readings.values(), strict=True)
    dof = np.array([np.broadcast_to(mean.dof, mean.mean.shape) for mean in means])
    rested = RestMeans(
        {quantity: np.array([mean.mean for mean in means])},
        {quantity: np.array([mean.variance for mean in means])},
        {quantity: dof},
        windows,
        tuple(mean.samples for mean in means),
    )
    return Placements(rested, np.array(attitudes), None, NO_RESTS, 0)


def _average_dwell(
    recording: ObservedRun, name: str, quantity: Quantity, dwell: FinishedDwell, thresholds: ObservationThresholds
) -> Mean:
    """Return a sensor's mean reading in a dwell. Raise Fault `saturation`, and any Fault of `check_complete`."""
    where = f"dwell {dwell.dwell.index} ({dwell.dwell.name}) of {name}"
    channel, time_s = recording.run.sensors[name].channel(quantity), recording.time_s(name)
    samples = recording.run.samples[name][inside(time_s, dwell.window)]
    check_complete(recording.run.sensors[name], samples, where, thresholds)
    if channel.is_saturated(samples).any():
        raise Fault("saturation", f"in {where} the {quantity} is beyond the sensor's range", "Choose a wider range")
    steps = steps_of(recording.run.samples[name], recording.run.sensors[name], quantity)
    return even_mean(channel.values(samples), steps)


def _sensor_attitude(recording: ObservedRun, name: str, window: Window) -> Array:
    """Return the rotation (3, 3) from the sensor's nominal axes into the arm's base frame."""
    to_flange = nearest_rotation(recording.motion.attitude(window.start_s, window.end_s))
    attitude: Array = (np.array(recording.run.sensors[name].mounting) @ to_flange).T
    return attitude

"""Mean readings of an accelerometer in dwells, each with the arm's attitude."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds, Site
from rig.errors import Fault
from rig.errors.attempts import Attempts, attempt_each
from rig.estimation.arrays import Array
from rig.observation.arm_rests import MIN_SAMPLES_AT_REST
from rig.observation.average import Stream, slice_time, steps_of
from rig.observation.lost_samples import lost_samples
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.oscillation import MAX_TRAVEL_AT_REST_RAD
from rig.observation.statistics.mean import Mean
from rig.observation.statistics.vibration_noise import average_standstill
from rig.observation.windows import FinishedDwell, Window, dwelt

LEAVING_S = 0.05  # before a dwell's end: the board's times include the gyroscope's delay, which is the longer one


@dataclass(frozen=True, slots=True)
class DwellReading:
    """The mean reading, in m/s², in one dwell; `index` is the dwell's index in the procedure.

    `attitude` (3, 3) is the mean rotation from the arm's base frame into the flange's, weighted like the readings. The
    `window` is in controller times.
    """

    index: int
    name: str
    reading: Mean
    attitude: Array
    window: Window
    temperature_c: float


def dwell_readings(
    run: RunData, stream: Stream, motion: ArmMotion, settings: ObservationThresholds, superseded: Collection[int] = ()
) -> Iterator[DwellReading]:
    """Yield the average of each finished dwell of a sensor with accelerations, except those in `superseded`.

    Raise Fault `arm_moved_in_dwell`, `arm_states_lost`, `lost_samples`, `saturation` or `stuck_sensor`.
    """
    for finished in dwelt(run):
        if finished.dwell.index not in superseded:
            yield _dwell_reading(run, stream, motion, finished, settings)


def read_each_dwell(
    run: RunData, stream: Stream, motion: ArmMotion, settings: ObservationThresholds
) -> Attempts[int, DwellReading]:
    """Return the averages of finished dwells, and the faults of dwells without one, both by the dwell's index.

    A fault of one dwell does not affect the others. There are no averages and no faults without accelerations.
    """
    if not stream.sensor.measures(ACCELERATION):
        return Attempts()
    read = partial(_dwell_reading, run, stream, motion, settings=settings)
    return attempt_each({finished.dwell.index: partial(read, finished) for finished in dwelt(run)})


def accelerations(stream: Stream, inside: slice) -> Array:
    """Return the accelerations (n, 3), m/s², in the samples of the slice `inside`."""
    return stream.correct_temperature(
        ACCELERATION, stream.sensor.channel(ACCELERATION).values(stream.raw[inside]), inside
    )


def check_acceleration(stream: Stream, inside: slice, where: str, *, turning: bool = False) -> None:
    """Raise Fault `saturation` or `stuck_sensor` if the accelerometer's samples in the slice `inside` are unusable.

    `stuck_sensor` means that readings are all equal: on one axis while the arm is `turning`, at rest on all three.
    """
    channel, samples = stream.sensor.channel(ACCELERATION), stream.raw[inside]
    counts, saturated = channel.counts(samples), channel.is_saturated(samples)
    if saturated.any():
        raise Fault(
            "saturation",
            f"in {where} {int(saturated.sum())} accelerations are at the end of the sensor's range",
            "Choose a wider acceleration.range_g",
        )
    changing = np.any(counts != counts[0], axis=0) if len(counts) else np.ones(3, dtype=np.bool_)
    if not (changing.all() if turning else changing.any()) and _is_noisy(stream):
        raise Fault(
            "stuck_sensor",
            f"in {where} the accelerometer repeats one reading {len(counts)} times",
            "Check the sensor's supply and its bus wiring, then repeat the run",
        )


def _is_noisy(stream: Stream) -> bool:
    """Return whether most neighbouring samples differ, as they do with noise."""
    steps = np.abs(np.diff(stream.sensor.channel(ACCELERATION).counts(stream.raw), axis=0))
    return bool(len(steps)) and np.median(steps, axis=0).min() >= 1


def _dwell_reading(
    run: RunData, stream: Stream, motion: ArmMotion, finished: FinishedDwell, settings: ObservationThresholds
) -> DwellReading:
    """Return a dwell's mean acceleration, and the mean attitude with the same weights.

    The arm's oscillation changes both means alike, so it adds no noise.
    """
    dwell, window = finished.dwell, trim_dwell(run, finished).window
    where = f"dwell {dwell.index} ({dwell.name})"
    inside = slice_time(stream, window.start_s, window.end_s)
    _check_standstill(motion, window, where)
    check_complete(stream.sensor, stream.raw[inside], where, settings)
    check_acceleration(stream, inside, where)
    readings, time_s = accelerations(stream, inside), stream.time_s[inside]
    steps = steps_of(stream.raw, stream.sensor, ACCELERATION)
    attitudes = motion.attitudes(time_s)
    swing = gravity_difference(attitudes, attitudes.mean(axis=0), stream.sensor, run.settings.site)  # no noise
    reading, _ = average_standstill(readings - swing, time_s, window, steps)
    return DwellReading(
        index=dwell.index,
        name=dwell.name,
        reading=replace(reading, mean=reading.mean + reading.weights @ swing),
        attitude=np.tensordot(reading.weights, attitudes, axes=1),
        window=window,
        temperature_c=stream.temperature_c(inside),
    )


def gravity_difference(attitudes: Array, expected: Array, sensor: RecordedSensor, site: Site) -> Array:
    """Return gravity at actual attitudes minus gravity at expected ones (n, 3), m/s², in the sensor's nominal axes.

    `attitudes` (n, 3, 3): actual, from the arm's encoders; `expected` (n, 3, 3): assumed by the model of the readings.
    """
    difference: Array = (attitudes - expected) @ -site.down_m_s2 @ np.array(sensor.mounting).T
    return difference


def trim_dwell(run: RunData, finished: FinishedDwell) -> FinishedDwell:
    """Return the dwell without its last readings, which may include the start of the arm's next motion."""
    start_s, end_s = finished.window.start_s, finished.window.end_s
    return FinishedDwell(finished.dwell, Window(start_s, max(end_s - LEAVING_S, start_s)))


def _check_standstill(motion: ArmMotion, window: Window, where: str) -> None:
    """Raise Fault `arm_moved_in_dwell` or `arm_states_lost` unless the arm stood still in the window."""
    moved_rad = motion.travel_rad(window)
    if moved_rad is None:
        raise Fault(
            "arm_states_lost",
            f"in {where} the arm's states are missing",
            "Check the network to the robot and the load of this computer, then repeat the run",
        )
    if moved_rad > MAX_TRAVEL_AT_REST_RAD:
        raise Fault(
            "arm_moved_in_dwell",
            f"in {where} a joint moved by {np.degrees(moved_rad):.2f}°",
            "Make sure that nothing moves the arm while it stands, then repeat the run",
        )


def check_complete(sensor: RecordedSensor, samples: NDArray[Any], where: str, settings: ObservationThresholds) -> None:
    """Raise Fault `lost_samples` if a dwell has too few samples, or too many are missing."""
    count, lost = len(samples), 0
    if count:
        sequence = samples["sequence"].astype(np.int64)
        lost = int(sequence[-1] - sequence[0]) + 1 - count
    if count < MIN_SAMPLES_AT_REST or lost > settings.max_lost_fraction * (count + lost):
        what = (
            f"there are {count} samples, and {lost} are missing; {100 * settings.max_lost_fraction:g} % may be "
            f"missing, and at least {MIN_SAMPLES_AT_REST} samples are needed"
        )
        raise lost_samples(sensor, samples, where, what, "repeat the run, or dwell longer")

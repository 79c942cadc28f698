"""The noise of sensors at rest: the Allan deviation of all rests and dwells, or of another program's log."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rig.data.quantity import ACCELERATION, RATE, TEMPERATURE, Quantity
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.errors import Fault
from rig.errors.attempts import Attempts, attempt_each
from rig.estimation.arrays import Array
from rig.estimation.statistics.allan import AllanAxis, AllanCurve, allan_curve, read_axis, too_short
from rig.observation.arm_rests import still_samples
from rig.observation.average import Stream, synchronize_stream
from rig.observation.by_hand.steadiness import check_at_rest, contiguous_slices, fill_missing
from rig.observation.external.csv_samples import Samples
from rig.observation.motion.arm_motion import motion_of
from rig.observation.reference.dwell_acceleration import accelerations
from rig.observation.time_stamps.sampling import find_sampling

MIN_READINGS = 20  # fewer may be equal by chance


@dataclass(frozen=True, slots=True)
class QuantityNoise:
    """The Allan deviation of one quantity at rest, in its SI unit, and the noise parameters of each axis.

    - `intervals`: the number of intervals without a gap.
    - `longest_s`, `total_s`: the durations of the longest interval and of all together.
    - `temperature_c`: the lowest and the highest temperature, None without a thermometer.
    """

    curve: AllanCurve
    axes: tuple[AllanAxis, AllanAxis, AllanAxis]
    intervals: int
    longest_s: float
    total_s: float
    temperature_c: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class SensorAtRest:
    """The noise of each quantity of a sensor at rest, or the Fault that says why it is unknown.

    `sensor` is None for another program's log, which does not describe it. `notes` say what was left out of the log,
    and how its time stamps were read.
    """

    sensor: RecordedSensor | None
    quantities: Attempts[Quantity, QuantityNoise]
    notes: tuple[str, ...] = ()


def rest_noises(runs: Sequence[RunData]) -> dict[str, SensorAtRest]:
    """Return the noise of every sensor with rates, by name, over all recordings of a run.

    Readings corrected by the board are left out. Raise Fault as `motion_of` and `synchronize_stream` do.
    """
    motions = [motion_of(run) for run in runs]
    results = {}
    for name, sensor in runs[0].measuring(RATE).items():
        intervals = []
        for run, motion in zip(runs, motions, strict=True):
            stream = synchronize_stream(run.samples[name], sensor, motion)
            intervals.extend((stream, inside) for inside in still_samples(run, stream, motion))
        quantities = [RATE, ACCELERATION] if sensor.measures(ACCELERATION) else [RATE]
        results[name] = SensorAtRest(
            sensor,
            attempt_each({quantity: partial(_summarise_streams, intervals, quantity) for quantity in quantities}),
        )
    return results


def log_at_rest(samples: Samples) -> SensorAtRest:
    """Return the noise of a sensor at rest during another program's whole log. Raise Fault `not_at_rest`."""
    for quantity, readings in samples.readings.items():
        check_at_rest(samples.time_s, readings, quantity)
    sampling = samples.sampling or find_sampling(samples.time_s)
    intervals = [inside for inside in contiguous_slices(samples.time_s, sampling) if inside.stop - inside.start > 2]
    return SensorAtRest(
        None,
        attempt_each(
            {
                quantity: partial(
                    _summarise_noise,
                    [samples.time_s[interval] for interval in intervals],
                    [fill_missing(readings[interval], sampling.numbers[interval]) for interval in intervals],
                    quantity,
                )
                for quantity, readings in samples.readings.items()
            }
        ),
        (*(f"left out: {part}" for part in samples.omitted), *samples.notes),
    )


def _summarise_streams(intervals: Sequence[tuple[Stream, slice]], quantity: Quantity) -> QuantityNoise:
    long = [(stream, inside) for stream, inside in intervals if inside.stop - inside.start > 2]
    readings = [_readings(stream, inside, quantity) for stream, inside in long]
    summary = _summarise_noise([stream.time_s[inside] for stream, inside in long], readings, quantity)
    temperatures = [_temperatures(stream, inside) for stream, inside in long]
    return replace(summary, temperature_c=(min(low for low, _ in temperatures), max(high for _, high in temperatures)))


def _summarise_noise(times_s: Sequence[Array], readings: Sequence[Array], quantity: Quantity) -> QuantityNoise:
    """Return the noise of intervals at rest, each with times (nᵢ,) and readings (nᵢ, 3).

    Raise Fault `recording_too_short` without an interval, `stuck_sensor` if an axis repeats one number all the time.
    """
    if not readings:
        raise too_short("nothing stood still for longer than a few readings")
    if any(not np.ptp(reading, axis=0).all() for reading in readings if len(reading) > MIN_READINGS):
        raise Fault(
            "stuck_sensor",
            f"an axis repeats one {quantity} through a whole rest",
            "Check the sensor's supply and its wiring; if the sensor's noise is below its resolution, it has "
            "no such curve",
        )
    durations_s = [float(time_s[-1] - time_s[0]) for time_s in times_s]
    interval_s = float(np.sum(durations_s) / np.sum([len(reading) - 1 for reading in readings]))
    curve = allan_curve(readings, interval_s)
    return QuantityNoise(
        curve=curve,
        axes=(read_axis(curve, 0), read_axis(curve, 1), read_axis(curve, 2)),
        intervals=len(readings),
        longest_s=max(durations_s),
        total_s=float(np.sum(durations_s)),
        temperature_c=None,
    )


def _readings(stream: Stream, inside: slice, quantity: Quantity) -> Array:
    return stream.readings_rad_s[inside] if quantity == RATE else accelerations(stream, inside)


def _temperatures(stream: Stream, inside: slice) -> tuple[float, float]:
    degrees = stream.sensor.channel(TEMPERATURE).values(stream.raw[inside])
    return float(degrees.min()), float(degrees.max())

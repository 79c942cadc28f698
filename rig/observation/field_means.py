"""Averages of a magnetometer's readings in dwells, with the arm's attitude, and in rests at the home pose."""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import Any

from numpy.typing import NDArray

from rig.data.quantity import FIELD
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.arm_rests import MIN_SAMPLES_AT_REST
from rig.observation.average import steps_of
from rig.observation.observed_run import ObservedRun, one_clock
from rig.observation.reference.dwell_acceleration import DwellReading, check_complete
from rig.observation.statistics.mean import Mean, StaticReading, even_mean
from rig.observation.stuck_check import check_noise
from rig.observation.windows import Window, inside, iterate_rests

HOME_TOLERANCE_RAD = 1e-3  # angle from home, of any joint
SETTLING_S = 0.2  # time removed at either end of a rest


def find_companion(recording: ObservedRun, name: str) -> str | None:
    """Return the first sensor with accelerations in dwells that shares the magnetometer's clock, or None."""
    return find_dwelling_companion(
        recording.run, name, (sensor for sensor, observations in recording.sensors.items() if observations.dwells)
    )


def find_dwelling_companion(run: RunData, name: str, sensors: Iterable[str]) -> str | None:
    """Return the first of `sensors` that shares the clock of the magnetometer `name`, or None."""
    return next((sensor for sensor in sensors if one_clock(run, sensor, name)), None)


def field_readings(recording: ObservedRun, name: str, thresholds: ObservationThresholds) -> tuple[StaticReading, ...]:
    """Return a magnetometer's mean readings in the dwells in which an accelerometer with the same clock was read.

    The time base found for the accelerometer's sensor also serves the magnetometer. The delays of the two may differ,
    but a delay changes no mean at rest. Raise Fault `lost_samples`, `saturation`, `stuck_axis`.
    """
    other = find_companion(recording, name)
    if other is None:
        return ()
    time_s = recording.time_s(name, other)
    field_in_dwells = tuple(
        StaticReading(
            dwell.index,
            dwell.name,
            field_mean(recording.run, name, time_s, dwell, thresholds),
            dwell.attitude,
            dwell.window,
        )
        for dwell in recording.sensors[other].dwells
    )
    sensor, samples = recording.run.sensors[name], recording.run.samples[name]
    step_counts = steps_of(samples, sensor, FIELD).units / sensor.channel(FIELD).unit_per_count
    check_noise(name, [(dwell, counts) for dwell, counts, _ in read_field_in_dwells(recording, name)], step_counts)
    return field_in_dwells


def field_mean(run: RunData, name: str, time_s: Array, dwell: DwellReading, thresholds: ObservationThresholds) -> Mean:
    """Return a magnetometer's mean reading in a dwell, tesla; `time_s` (n,) are its samples' times on the arm's clock.

    Raise Fault `lost_samples` or `saturation`.
    """
    samples = _samples(run, name, time_s, dwell.window)
    return _mean(run, name, samples, f"dwell {dwell.index} ({dwell.name}) of {name}", thresholds)


def read_field_in_dwells(recording: ObservedRun, name: str) -> Iterator[tuple[DwellReading, NDArray[Any], Array]]:
    """Yield each dwell with the magnetometer's raw counts (n, 3) in it and their times (n,) on the arm's clock."""
    other = find_companion(recording, name)
    if other is not None:
        time_s, channel = recording.time_s(name, other), recording.run.sensors[name].channel(FIELD)
        for dwell in recording.sensors[other].dwells:
            samples = inside(time_s, dwell.window)
            yield dwell, channel.counts(recording.run.samples[name])[samples], time_s[samples]


def field_tests(
    recording: ObservedRun, name: str, thresholds: ObservationThresholds, home_q_rad: Sequence[float]
) -> tuple[Mean, ...]:
    """Return the magnetometer's mean reading, tesla, in each rest at the home pose, in the order of time.

    Raise Fault as `field_readings` does, but skip rests with fewer samples than a dwell needs, because the last samples
    of a run may arrive after its end.
    """
    other = find_companion(recording, name)
    if other is None:
        return ()
    time_s = recording.time_s(name, other)
    samples = partial(_samples, recording.run, name, time_s)
    windows = (Window(rest.start_s + SETTLING_S, rest.end_s - SETTLING_S) for rest in iterate_rests(recording.run))
    return tuple(
        _mean(recording.run, name, samples(window), f"a field test of {name}", thresholds)
        for window in windows
        if window.end_s > window.start_s
        and _is_at_home(recording, window, home_q_rad)
        and len(samples(window)) >= MIN_SAMPLES_AT_REST
    )


def _is_at_home(recording: ObservedRun, rest: Window, home_q_rad: Sequence[float]) -> bool:
    away_rad = recording.motion.max_distance_rad(rest, home_q_rad)
    return away_rad is not None and away_rad < HOME_TOLERANCE_RAD


def _mean(run: RunData, name: str, samples: NDArray[Any], where: str, thresholds: ObservationThresholds) -> Mean:
    """Return the mean field of samples in a dwell. Raise Fault `lost_samples` or `saturation`."""
    check_complete(run.sensors[name], samples, where, thresholds)
    channel = run.sensors[name].channel(FIELD)
    if channel.is_saturated(samples).any():
        raise Fault(
            "saturation",
            f"in {where} the field is beyond the magnetometer's range",
            "Choose a wider range_gauss, or remove iron near it",
        )
    return even_mean(channel.values(samples), steps_of(run.samples[name], run.sensors[name], FIELD))


def _samples(run: RunData, name: str, time_s: Array, window: Window) -> NDArray[Any]:
    """Return a sensor's samples (n,) in a window; `time_s` (N,) are the times of all its samples on the arm's clock."""
    samples: NDArray[Any] = run.samples[name]
    return samples[inside(time_s, window)]

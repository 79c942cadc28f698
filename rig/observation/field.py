"""What a magnetometer read at rest: its means in dwells, each with the attitude the arm stood in, and at home. Pure."""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import Any

from numpy.typing import NDArray

from rig.data.quantity import FIELD
from rig.data.recording.run_file import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.arm_rests import MIN_SAMPLES_AT_REST
from rig.observation.average import steps_of
from rig.observation.observed_run import ObservedRun, one_clock
from rig.observation.reference.acceleration import DwellReading, check_complete
from rig.observation.statistics.mean import Held, Mean, even_mean
from rig.observation.windows import Window, inside, rested

AT_HOME_RAD = 1e-3  # of any joint
SETTLING_S = 0.2  # kept away from either end of a rest


def beside(recording: ObservedRun, name: str) -> str | None:
    """The sensor whose clock stamps the samples of the magnetometer `name`, and whose accelerometer was read in dwells.

    None where there is none.
    """
    return dwelt_beside(recording.run, name, (sensor for sensor, found in recording.sensors.items() if found.dwells))


def dwelt_beside(run: RunData, name: str, dwelt: Iterable[str]) -> str | None:
    """The first of the sensors read in dwells whose clock stamps the samples of the magnetometer, as of `beside`."""
    return next((sensor for sensor in dwelt if one_clock(run, sensor, name)), None)


def field_readings(recording: ObservedRun, name: str, thresholds: ObservationThresholds) -> tuple[Held, ...]:
    """What a magnetometer read in the dwells of the recording that an accelerometer was read in.

    One clock stamps the samples of both, so the gyroscope's time base serves; how late the magnetometer is beside that
    gyroscope does not matter to a mean at rest. Raises Fault `lost_samples`, `saturation`.
    """
    other = beside(recording, name)
    if other is None:
        return ()
    time_s = recording.time_s(name, other)
    return tuple(
        Held(
            dwell.index,
            dwell.name,
            field_mean(recording.run, name, time_s, dwell, thresholds),
            dwell.attitude,
            dwell.window,
        )
        for dwell in recording.sensors[other].dwells
    )


def field_mean(run: RunData, name: str, time_s: Array, dwell: DwellReading, thresholds: ObservationThresholds) -> Mean:
    """The mean reading of a magnetometer in a dwell, tesla; `time_s` (n,) are its samples' times on the arm's clock.

    Raises Fault `lost_samples`, `saturation`.
    """
    samples = _samples(run, name, time_s, dwell.window)
    return _mean(run, name, samples, f"dwell {dwell.index} ({dwell.name}) of {name}", thresholds)


def dwelt_field(recording: ObservedRun, name: str) -> Iterator[tuple[DwellReading, NDArray[Any], Array]]:
    """The field's readings in each dwell as recorded (n, 3), and their times (n,) on the arm's clock."""
    other = beside(recording, name)
    if other is not None:
        time_s, channel = recording.time_s(name, other), recording.run.sensors[name].channel(FIELD)
        for dwell in recording.sensors[other].dwells:
            held = inside(time_s, dwell.window)
            yield dwell, channel.counts(recording.run.samples[name])[held], time_s[held]


def field_tests(
    recording: ObservedRun, name: str, thresholds: ObservationThresholds, home_q_rad: Sequence[float]
) -> tuple[Mean, ...]:
    """The mean readings in tesla of the rests at home, in their order. Raises as `field_readings`.

    One of fewer samples than a dwell needs is none: the last samples of a run may still be on their way when it ends.
    """
    other = beside(recording, name)
    if other is None:
        return ()
    time_s = recording.time_s(name, other)
    samples = partial(_samples, recording.run, name, time_s)
    windows = (Window(rest.start_s + SETTLING_S, rest.end_s - SETTLING_S) for rest in rested(recording.run))
    return tuple(
        _mean(recording.run, name, samples(window), f"a field test of {name}", thresholds)
        for window in windows
        if window.end_s > window.start_s
        and _at_home(recording, window, home_q_rad)
        and len(samples(window)) >= MIN_SAMPLES_AT_REST
    )


def _at_home(recording: ObservedRun, rest: Window, home_q_rad: Sequence[float]) -> bool:
    away_rad = recording.motion.away_rad(rest, home_q_rad)
    return away_rad is not None and away_rad < AT_HOME_RAD


def _mean(run: RunData, name: str, samples: NDArray[Any], where: str, thresholds: ObservationThresholds) -> Mean:
    check_complete(run.sensors[name], samples, where, thresholds)
    channel = run.sensors[name].channel(FIELD)
    if channel.saturated(samples).any():
        raise Fault(
            "saturation",
            f"in {where} the field is beyond the magnetometer's range",
            "Choose a wider range_gauss, or take away the iron beside it",
        )
    return even_mean(channel.values(samples), steps_of(run.samples[name], run.sensors[name], FIELD))


def _samples(run: RunData, name: str, time_s: Array, window: Window) -> NDArray[Any]:
    """The samples (n,) of a sensor in a window of the arm's clock, by the times (N,) of all of them on it."""
    samples: NDArray[Any] = run.samples[name]
    return samples[inside(time_s, window)]

"""A gyroscope's readings beside those of a reference: sample by sample, and turn by turn.

The reference's readings, corrected with its own calibration, are turned into the frame of the sensor under test and
interpolated at that sensor's times. Each sensor stands on the arm's clock by its own time base, so the delays of their
filters cancel. What is left is the sensor's error, plus both parts' noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis.gyroscope.alignment import mean_rates
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.cubic_spline import CubicSpline
from rig.observation.arm_rests import MIN_SAMPLES_AT_REST
from rig.observation.average import Stream
from rig.observation.consistency.movement_masks import mask_movement
from rig.observation.observe import Observation
from rig.observation.observed_run import Delay, ObservedRun

MAX_DELAY_S = 0.2  # between the filters of two sensors; more means that their time stamps do not belong together
MAX_GAP = 2.5  # sampling intervals of the reference across which it is interpolated
MIN_COVERED = 0.9  # of the samples of the movement


@dataclass(frozen=True, slots=True)
class Reference:
    """The sensor `name` whose calibration is known: rate = scale (3,) × (reading + bias_rad_s (3,))."""

    name: str
    scale: Array
    bias_rad_s: Array

    @property
    def correction_matrix(self) -> Array:
        """(3, 3) matrix K that corrects readings."""
        return np.diag(self.scale)


def turns_of(sensor: str, recordings: Sequence[ObservedRun]) -> list[Observation]:
    """All revolutions as a sensor saw them."""
    return [turn for recording in recordings for turn in recording.sensors[sensor].revolutions]


@dataclass(frozen=True, slots=True)
class Deviation:
    """Reading less reference over a number of samples, axis by axis: mean, RMS and largest magnitude, (3,) rad/s."""

    samples: int
    mean_rad_s: Array
    rms_rad_s: Array
    max_rad_s: Array

    @property
    def mse_rad2_s2(self) -> Array:
        """(3,) the mean square, (rad/s)²."""
        mean_square: Array = self.rms_rad_s**2
        return mean_square


@dataclass(frozen=True, slots=True)
class RevolutionError:
    """Mean reading less mean reference over one whole turn, (3,) rad/s, and what noise leaves uncertain of it.

    Or over an arc: `angle_rad` is how far the joint turned. `gravity_rad_s` (3,) is what of it gravity adds to the
    reading, None where no calibration tells.
    """

    sweep: int
    joint_name: str | None
    direction: str | None
    error_rad_s: Array
    std_rad_s: Array
    gravity_rad_s: Array | None
    angle_rad: float | None = None


@dataclass(frozen=True, slots=True)
class Comparison:
    """A sensor's readings beside the reference's, over the whole movement: sweeps, rests, and the ways between.

    `time_s` (n,) is controller time; `reading_rad_s` and `reference_rad_s` (n, 3) are in the sensor's frame. `movement`
    counts all n samples, `sweeps` those of the sweeps with their ramps. `noise_rad_s` (3,) is the standard deviation of
    the difference while the arm rests: both parts' noise, the RMS of a perfect calibration; None without rests.
    `delay_s` is by how much the sensor's filter lags the reference's, one for each recording, with `delay_std_s`; there
    are none where no one clock stamps the samples of both.
    """

    time_s: Array
    reading_rad_s: Array
    reference_rad_s: Array
    movement: Deviation
    sweeps: Deviation
    noise_rad_s: Array | None
    revolutions: tuple[RevolutionError, ...]
    delay_s: tuple[float, ...]
    delay_std_s: tuple[float, ...]


def compare(
    recordings: Sequence[ObservedRun],
    sensor: str,
    reference: Reference,
    rotation: Array,
    gravity_rad_s: Array | None = None,
) -> Comparison:
    """The readings of `sensor` as they were recorded beside the reference's; `rotation` (3, 3) turns the latter.

    `gravity_rad_s` (N, 3) is what gravity adds to the readings of each revolution, where that is known.
    Raises Fault `no_overlap`, `different_clocks`.
    """
    parts = [_part(recording, sensor, reference, rotation) for recording in recordings]
    return Comparison(
        time_s=np.concatenate([part.time_s for part in parts]),
        reading_rad_s=np.concatenate([part.reading for part in parts]),
        reference_rad_s=np.concatenate([part.reference for part in parts]),
        movement=_deviation([part.error[part.sweeping | part.resting] for part in parts]),
        sweeps=_deviation([part.error[part.sweeping] for part in parts]),
        noise_rad_s=_noise([part.error[rest] for part in parts for rest in part.still]),
        revolutions=_revolution_errors(recordings, sensor, reference, rotation, gravity_rad_s),
        delay_s=tuple(part.delay.delay_s for part in parts if part.delay),
        delay_std_s=tuple(part.delay.std_s for part in parts if part.delay),
    )


@dataclass(frozen=True, slots=True)
class _Part:
    """One recording's share of a comparison, with masks (n,): of all sweeps, all rests, and the middle of each rest."""

    time_s: Array
    reading: Array
    reference: Array
    sweeping: NDArray[np.bool_]
    resting: NDArray[np.bool_]
    still: tuple[NDArray[np.bool_], ...]
    delay: Delay | None

    @property
    def error(self) -> Array:
        difference: Array = self.reading - self.reference
        return difference


def _part(recording: ObservedRun, sensor: str, reference: Reference, rotation: Array) -> _Part:
    delay = _delay(recording, sensor, reference.name)
    tested, known = recording.stream(sensor), recording.stream(reference.name)
    movement = mask_movement(recording.run, tested.time_s)
    used = movement.moving & _surrounded(tested.time_s, known.time_s)
    if not used.sum() > MIN_COVERED * movement.moving.sum():
        raise Fault(
            "no_overlap",
            f"the reference was recorded during {used.sum()} of the sensor's {movement.moving.sum()} samples of the "
            "movement",
            "Check the reference's wiring and its data-ready line, then repeat the verification",
        )
    time_s = tested.time_s[used]
    return _Part(
        time_s=time_s,
        reading=tested.readings_rad_s[used],
        reference=_interpolated(known, reference, time_s) @ rotation.T,
        sweeping=movement.sweeping[used],
        resting=movement.resting[used],
        still=tuple(rest[used] for rest in movement.still),
        delay=delay,
    )


def _delay(recording: ObservedRun, sensor: str, reference: str) -> Delay | None:
    found = recording.delay(sensor, behind=reference)
    if found is not None and abs(found.delay_s) > MAX_DELAY_S:
        raise Fault(
            "different_clocks",
            f"the time stamps of sensor and reference are {abs(found.delay_s):.2f} s apart for one movement",
            "Record both with the same board",
        )
    return found


def _surrounded(time_s: Array, by_s: Array) -> NDArray[np.bool_]:
    """Which times (n,) have one of `by_s` (m,) closely before and after them."""
    after = np.searchsorted(by_s, time_s)
    gaps = np.diff(by_s, prepend=-np.inf, append=np.inf)
    close: NDArray[np.bool_] = gaps[after] <= MAX_GAP * np.median(gaps)
    return close


def _interpolated(known: Stream, reference: Reference, time_s: Array) -> Array:
    """(n, 3) the reference's corrected rate at other times: a cubic spline, for a chord cuts the vibration's crests."""
    rate = reference.scale * (known.readings_rad_s + reference.bias_rad_s)
    return CubicSpline(known.time_s, rate)(time_s)


def _deviation(errors: Sequence[Array]) -> Deviation:
    error = np.concatenate(errors)
    return Deviation(
        samples=len(error),
        mean_rad_s=error.mean(axis=0),
        rms_rad_s=np.sqrt(np.mean(error**2, axis=0)),
        max_rad_s=np.abs(error).max(axis=0),
    )


def _noise(rests: Sequence[Array]) -> Array | None:
    """Standard deviation (3,) within the rests, each about its own mean."""
    long_enough = [rest for rest in rests if len(rest) >= MIN_SAMPLES_AT_REST]
    if not long_enough:
        return None
    squares = np.sum([np.sum((rest - rest.mean(axis=0)) ** 2, axis=0) for rest in long_enough], axis=0)
    noise: Array = np.sqrt(squares / sum(len(rest) - 1 for rest in long_enough))
    return noise


def _revolution_errors(
    recordings: Sequence[ObservedRun], sensor: str, reference: Reference, rotation: Array, gravity_rad_s: Array | None
) -> tuple[RevolutionError, ...]:
    turns = turns_of(sensor, recordings)
    tested, known = mean_rates(turns), mean_rates(turns_of(reference.name, recordings), reference).turned(rotation)
    errors = tested.rate_rad_s - known.rate_rad_s
    stds = np.sqrt(np.diagonal(tested.covariance_rad2_s2 + known.covariance_rad2_s2, axis1=1, axis2=2))
    held = [None] * len(turns) if gravity_rad_s is None else gravity_rad_s
    return tuple(
        RevolutionError(turn.sweep, turn.joint_name, turn.direction, error, std, gravity, turn.angle_rad)
        for turn, error, std, gravity in zip(turns, errors, stds, held, strict=True)
    )

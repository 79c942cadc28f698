"""The comparison of a gyroscope's readings with those of a reference, sample by sample and revolution by revolution.

The reference's readings, corrected by its own calibration, are rotated into the frame of the sensor under test and
interpolated at that sensor's times. Every sensor has its own time base to the arm's clock, which cancels its filter's
delay. The difference is the sensor's error, plus the noise of both.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis.gyroscope.alignment import collect_mean_rates
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.cubic_spline import CubicSpline
from rig.observation.arm_rests import MIN_SAMPLES_AT_REST
from rig.observation.average import Stream
from rig.observation.consistency.movement_masks import mask_movement
from rig.observation.observe import Observation
from rig.observation.observed_run import Delay, ObservedRun

MAX_DELAY_S = 0.2  # between the filters of two sensors: if it is larger, their time stamps do not belong together
MAX_GAP_INTERVALS = 2.5  # of the reference: longer gaps are not interpolated
MIN_COVERED_FRACTION = 0.9  # of the samples in motion, by the reference


@dataclass(frozen=True, slots=True)
class Reference:
    """The sensor `name` with its calibration: rate = scale (3,) × (reading + bias_rad_s (3,))."""

    name: str
    scale: Array
    bias_rad_s: Array

    @property
    def correction_matrix(self) -> Array:
        """The matrix K (3, 3) that corrects readings."""
        return np.diag(self.scale)


def list_revolutions(sensor: str, recordings: Sequence[ObservedRun]) -> list[Observation]:
    """Return the observations of a sensor in all revolutions."""
    return [turn for recording in recordings for turn in recording.sensors[sensor].revolutions]


@dataclass(frozen=True, slots=True)
class Deviation:
    """Reading minus reference over several samples: mean, RMS and largest magnitude of each axis, (3,) rad/s."""

    samples: int
    mean_rad_s: Array
    rms_rad_s: Array
    max_rad_s: Array

    @property
    def mse_rad2_s2(self) -> Array:
        """The mean square (3,) in (rad/s)²."""
        mean_square: Array = self.rms_rad_s**2
        return mean_square


@dataclass(frozen=True, slots=True)
class RevolutionError:
    """Mean reading minus mean rate of the reference, over one revolution or arc.

    - `sweep`: its index in the plan; `joint_name`, `direction`: the joint that turns, and which way.
    - `angle_rad`: the angle turned, 2π for a whole revolution.
    - `error_rad_s`, `std_rad_s` (3,): the difference, and its standard deviation due to noise.
    - `gravity_rad_s` (3,): the part of the error that gravity explains, None if no calibration determines it.
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
    """A sensor's readings and the reference's over the whole movement: sweeps, rests and transfers.

    - time_s (n,): times of the samples on the controller's clock.
    - reading_rad_s, reference_rad_s (n, 3): readings and the reference's rates, in the sensor's frame.
    - movement: the deviation over all sweeps and rests.
    - sweeps: the deviation over the sweeps with their ramps.
    - noise_rad_s (3,): standard deviation of the difference at rest, due to the noise of both sensors; None without
      rests. The RMS of a perfect calibration would be the same.
    - revolutions: the error of each revolution.
    - delay_s, delay_std_s: for each recording, the delay of the sensor's filter relative to the reference's, and its
      standard deviation; empty if no common clock stamps the samples.
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
    """Return the comparison of a sensor's recorded readings with the reference's.

    `rotation` (3, 3) takes vectors from the reference's frame into the sensor's. `gravity_rad_s` (N, 3) is the part of
    the difference in each revolution that gravity explains, None if unknown. Raise Fault `no_overlap`,
    `different_clocks`.
    """
    parts = [_align_recording(recording, sensor, reference, rotation) for recording in recordings]
    return Comparison(
        time_s=np.concatenate([part.time_s for part in parts]),
        reading_rad_s=np.concatenate([part.reading for part in parts]),
        reference_rad_s=np.concatenate([part.reference for part in parts]),
        movement=_summarise_errors([part.error[part.sweeping | part.resting] for part in parts]),
        sweeps=_summarise_errors([part.error[part.sweeping] for part in parts]),
        noise_rad_s=_estimate_noise([part.error[rest] for part in parts for rest in part.still]),
        revolutions=_compare_revolutions(recordings, sensor, reference, rotation, gravity_rad_s),
        delay_s=tuple(part.delay.delay_s for part in parts if part.delay),
        delay_std_s=tuple(part.delay.std_s for part in parts if part.delay),
    )


@dataclass(frozen=True, slots=True)
class _AlignedRecording:
    """One recording's part of a comparison, with masks (n,) of all sweeps, all rests, and the middle of each rest."""

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


def _align_recording(recording: ObservedRun, sensor: str, reference: Reference, rotation: Array) -> _AlignedRecording:
    """Return both sensors' samples during movement, at the tested sensor's times. Raise Fault `no_overlap`."""
    delay = _find_delay(recording, sensor, reference.name)
    tested, reference_stream = recording.stream(sensor), recording.stream(reference.name)
    movement = mask_movement(recording.run, tested.time_s)
    used = movement.moving & _mask_covered(tested.time_s, reference_stream.time_s)
    if not used.sum() > MIN_COVERED_FRACTION * movement.moving.sum():
        raise Fault(
            "no_overlap",
            f"the reference was recorded during {used.sum()} of the sensor's {movement.moving.sum()} samples of the "
            "movement",
            "Check the reference's wiring and its data-ready line, then repeat the verification",
        )
    time_s = tested.time_s[used]
    return _AlignedRecording(
        time_s=time_s,
        reading=tested.readings_rad_s[used],
        reference=_interpolate(reference_stream, reference, time_s) @ rotation.T,
        sweeping=movement.sweeping[used],
        resting=movement.resting[used],
        still=tuple(rest[used] for rest in movement.still),
        delay=delay,
    )


def _find_delay(recording: ObservedRun, sensor: str, reference: str) -> Delay | None:
    """Return the delay of the sensor behind the reference. Raise Fault `different_clocks` if it is implausibly long."""
    delay = recording.delay(sensor, behind=reference)
    if delay is not None and abs(delay.delay_s) > MAX_DELAY_S:
        raise Fault(
            "different_clocks",
            f"the time stamps of sensor and reference are {abs(delay.delay_s):.2f} s apart for one movement",
            "Record both with the same board",
        )
    return delay


def _mask_covered(time_s: Array, by_s: Array) -> NDArray[np.bool_]:
    """Return a mask (n,) of the times within the range of the times `by_s` (m,), but not in a gap of `by_s`."""
    after = np.searchsorted(by_s, time_s)
    gaps = np.diff(by_s, prepend=-np.inf, append=np.inf)
    close: NDArray[np.bool_] = gaps[after] <= MAX_GAP_INTERVALS * np.median(gaps)
    return close


def _interpolate(stream: Stream, reference: Reference, time_s: Array) -> Array:
    """Return the reference's corrected rate (n, 3) at times (n,), by a cubic spline, which keeps vibrations."""
    rate = reference.scale * (stream.readings_rad_s + reference.bias_rad_s)
    return CubicSpline(stream.time_s, rate)(time_s)


def _summarise_errors(errors: Sequence[Array]) -> Deviation:
    error = np.concatenate(errors)
    return Deviation(
        samples=len(error),
        mean_rad_s=error.mean(axis=0),
        rms_rad_s=np.sqrt(np.mean(error**2, axis=0)),
        max_rad_s=np.abs(error).max(axis=0),
    )


def _estimate_noise(rests: Sequence[Array]) -> Array | None:
    """Return the standard deviation (3,) of errors about their mean in a rest; None if all rests are too short."""
    long_enough = [rest for rest in rests if len(rest) >= MIN_SAMPLES_AT_REST]
    if not long_enough:
        return None
    squares = np.sum([np.sum((rest - rest.mean(axis=0)) ** 2, axis=0) for rest in long_enough], axis=0)
    noise: Array = np.sqrt(squares / sum(len(rest) - 1 for rest in long_enough))
    return noise


def _compare_revolutions(
    recordings: Sequence[ObservedRun], sensor: str, reference: Reference, rotation: Array, gravity_rad_s: Array | None
) -> tuple[RevolutionError, ...]:
    """Return the error of the sensor in each sweep: its mean rate minus the reference's, in the sensor's axes."""
    turns = list_revolutions(sensor, recordings)
    tested = collect_mean_rates(turns)
    expected = collect_mean_rates(list_revolutions(reference.name, recordings), reference).rotate(rotation)
    errors = tested.rate_rad_s - expected.rate_rad_s
    stds = np.sqrt(np.diagonal(tested.covariance_rad2_s2 + expected.covariance_rad2_s2, axis1=1, axis2=2))
    gravity_effects = [None] * len(turns) if gravity_rad_s is None else gravity_rad_s
    return tuple(
        RevolutionError(turn.sweep, turn.joint_name, turn.direction, error, std, gravity, turn.angle_rad)
        for turn, error, std, gravity in zip(turns, errors, stds, gravity_effects, strict=True)
    )

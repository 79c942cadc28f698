"""The known systematic errors of arm and sensor in the segments of a recording: one pattern for each error.

A pattern is the effect of one standard deviation of one error on all readings, as in the model of common errors
(`rig.estimation.gyroscope.common_errors`). The arm's rate about the swept axis errs only by clock, encoders and times.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.consistency.gyroscope_checks import ErrorPatterns
from rig.analysis.consistency.state_errors import build_reading_patterns, build_time_patterns
from rig.analysis.environment import MeasurementEnvironment
from rig.analysis.gyroscope.segment_table import Segments
from rig.analysis.gyroscope.vector_inputs import WAVE_RATIO, list_uncertainties
from rig.config.judging.judging_keys import ExternalResult
from rig.data.recording.settings import Uncertainty
from rig.estimation.arrays import Array, distinct
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.gyroscope.nonlinearity import CUBE_DEVIATION, curvature, nonlinear_effects
from rig.estimation.gyroscope.own_errors import SensorProperties, list_own_errors, rounding_errors
from rig.motion.geometry import AXIS_ERRORS, WAVES, WRIST_1, WRIST_2, WRIST_3
from rig.observation.consistency.raw_readings import REST
from rig.observation.consistency.segments import MotionInterval
from rig.observation.consistency.transfers import STILL_RAD
from rig.observation.motion.arm_motion import ArmMotion

if TYPE_CHECKING:
    from rig.analysis.gyroscope.calibration import SensorResult
    from rig.estimation.gyroscope.earth_rate import EarthRate

# The waves of wrist 1 rotate no axis, but change its own speed.
ANGLE_ERRORS = (*AXIS_ERRORS, *(f"{wave} of wrist_1" for wave in WAVES))
FIRST_WAVE_INDEX = {WRIST_1: ANGLE_ERRORS.index("cos of wrist_1"), WRIST_2: ANGLE_ERRORS.index("cos of wrist_2"),
            WRIST_3: ANGLE_ERRORS.index("cos of wrist_3")}  # fmt: skip
# The joint of each zero, counted from the last.
JOINT_OF_ZERO = {ANGLE_ERRORS.index("zero of wrist_2"): -2, ANGLE_ERRORS.index("zero of wrist_3"): -1}
# The odd and the even part of the nonlinearity.
NONLINEARITY_KEYS: tuple[ExternalResult, ExternalResult] = ("nonlinearity_percent", "asymmetry_percent")
TRANSFER_STEPS = 24  # directions count as constant within one


@dataclass(frozen=True, slots=True)
class NonlinearityPrior:
    """The prior of a sensor's nonlinearity, one part of which grows as the rate's cube, the other as its square.

    `cube` and `square` are the standard deviations of these parts at full scale, as fractions of full scale. If `free`,
    they are not used: the nonlinearity is unknown, and may have a kink at zero.
    """

    cube: float
    square: float
    full_scale_rad_s: float
    free: bool = False


@dataclass(frozen=True, slots=True)
class KnownErrors:
    """The standard uncertainties of arm, site and sensor.

    - angles_rad (17,): sizes of the errors named in `ANGLE_ERRORS`.
    - repeatability_rad: error of the angle of a joint that was moved away and back.
    - encoder_rad: encoder error at an angle of a joint; zero if all sweeps are whole turns.
    - mount_rad: mounting error of an item that was remounted, about each axis.
    - jitter_s: jitter of the times of the arm's states.
    - reading_rad: noise of one reading of a joint's angle.
    - earth_rad_s (3, k): error of the Earth's rate in the base's frame, a column for each unknown direction; k = 0 if
      the rate is known.
    - curve: prior of the sensor's nonlinearity.
    - sensor: the sensor's properties from the data sheet, None if unknown.
    - temperature_times_s: the times of the sensor's temperatures.
    - stamp_s: error of the times of the sensor's samples.
    """

    angles_rad: Array
    repeatability_rad: float
    encoder_rad: float
    mount_rad: float
    jitter_s: float
    reading_rad: float
    earth_rad_s: Array
    curve: NonlinearityPrior
    sensor: SensorProperties | None
    temperature_times_s: Array
    stamp_s: float = 0.0


def collect_known_errors(
    environment: MeasurementEnvironment, name: str, result: "SensorResult", stamp_std_s: float | None = None
) -> KnownErrors:
    """Return the standard uncertainties of gyroscope and arm, from the configuration and the recording.

    If the solution estimates the nonlinearity, as at several speeds, the nonlinearity counts as unknown, and the
    configuration's value is not used. `stamp_std_s` is the standard deviation of the time stamps of the samples, None
    if unknown.
    """
    sensor, explained = result.sensor, result.explained
    return build_known_errors(
        environment.uncertainty,
        name,
        sensor.range_rad_s or 0.0,
        finds_curve=explained is not None and explained.nonlinearity is not None,
        arcs=any(observation.arc_rad is not None for observation in result.observations),
        jitter_s=environment.state_jitter_s,
        reading_rad=environment.reading_noise_rad,
        earth_rad_s=_earth(environment, name, result.earth),
        sensor=None if explained is None else explained.inputs.sensor,
        temperature_times_s=np.zeros(0) if explained is None else explained.inputs.windows_s.mean(axis=1),
        stamp_s=stamp_std_s or 0.0,
    )


def build_known_errors(
    uncertainty: Uncertainty,
    name: str,
    full_scale_rad_s: float,
    *,
    finds_curve: bool,
    arcs: bool,
    jitter_s: float,
    reading_rad: float,
    earth_rad_s: Array,
    sensor: SensorProperties | None,
    temperature_times_s: Array,
    stamp_s: float = 0.0,
) -> KnownErrors:
    """Return the standard uncertainties of all modelled error sources of gyroscope `name` with the given full scale.

    `finds_curve`: whether the solution estimates the nonlinearity; `arcs`: whether any sweep is an arc, not a whole
    turn. The other keywords are as in `KnownErrors`.
    """
    steady = np.array([angle.startswith(("twist", "zero")) for angle in ANGLE_ERRORS])
    cube, square = (uncertainty.find_stated_size(what, name) / 100 / np.sqrt(3) for what in NONLINEARITY_KEYS)
    return KnownErrors(
        angles_rad=np.radians(uncertainty.axis_deg) / np.sqrt(3) * np.where(steady, 1.0, WAVE_RATIO),
        repeatability_rad=uncertainty.repeatability_std_rad,
        encoder_rad=uncertainty.angle_std_rad if arcs else 0.0,
        mount_rad=float(np.radians(uncertainty.mount_deg) / np.sqrt(3)),
        jitter_s=jitter_s,
        reading_rad=reading_rad,
        earth_rad_s=earth_rad_s,
        curve=NonlinearityPrior(float(cube / CUBE_DEVIATION), float(square), full_scale_rad_s, free=finds_curve),
        sensor=sensor,
        temperature_times_s=temperature_times_s,
        stamp_s=stamp_s,
    )


def build_error_patterns(
    known_errors: KnownErrors, segments: Segments, transfers: Segments, matrix: Array
) -> ErrorPatterns:
    """Return the patterns of known errors in the means of a sensor with matrix F (3, 3).

    `transfers` are `segments` followed by the transfers between them. In their patterns the even part of the
    nonlinearity counts as unknown, because transfers are faster than sweeps.
    """
    on_transfers = replace(known_errors, curve=replace(known_errors.curve, square=1.0))
    instability_rad_s = 0.0 if known_errors.sensor is None else known_errors.sensor.instability_rad_s
    return ErrorPatterns(
        patterns(segments, matrix, known_errors),
        _encoder_patterns(segments, known_errors.encoder_rad) @ matrix.T,
        transfers,
        patterns(transfers, matrix, on_transfers),
        instability_rad_s,
    )


def _earth(environment: MeasurementEnvironment, name: str, earth_rate: "EarthRate | None") -> Array:
    """Return the uncertainty of the Earth's rate as k independent errors (3, k), rad/s, of one standard deviation."""
    unknown = list_uncertainties(environment, name, earth_rate)
    if unknown.earth_covariance_rad2_s2 is not None:
        size, directions = np.linalg.eigh(unknown.earth_covariance_rad2_s2)
        return np.asarray(directions * np.sqrt(size.clip(min=0.0)), dtype=np.float64)
    return unknown_earth_rate(is_known=not unknown.earth_rate)


def unknown_earth_rate(*, is_known: bool) -> Array:
    """Return `KnownErrors.earth_rad_s` (3, k) for an unknown Earth's rate; k = 0 if the rate is known."""
    return np.asarray(EARTH_RATE_RAD_S / np.sqrt(3) * np.eye(3)[:, : 0 if is_known else 3], dtype=np.float64)


def patterns(segments: Segments, matrix: Array, known_errors: KnownErrors) -> Array:
    """Return the patterns (P, N, 3) rad/s in the readings of segments, for a sensor with matrix F (3, 3)."""
    arm_patterns = np.concatenate(
        [
            _angle_patterns(segments, known_errors),
            _encoder_patterns(segments, known_errors.encoder_rad),
            build_time_patterns(segments, known_errors.jitter_s),
            build_reading_patterns(segments, known_errors.reading_rad),
            _stamp_patterns(segments, known_errors.stamp_s),
            *_speed_patterns(segments),
            *_mount_patterns(segments, known_errors.mount_rad),
            np.moveaxis(segments.attitudes @ known_errors.earth_rad_s, -1, 0),
        ]
    )
    sensor_patterns = [
        _nonlinearity_patterns(segments.intervals, matrix, known_errors.curve),
        *_temperature_patterns(segments, matrix, known_errors),
        *_rounding_patterns(segments),
    ]
    all_patterns = np.concatenate([arm_patterns @ matrix.T, *sensor_patterns])
    return np.asarray(all_patterns[all_patterns.any(axis=(1, 2))], dtype=np.float64)


def _angle_patterns(segments: Segments, known_errors: KnownErrors) -> Array:
    """Return the patterns of the arm's angle errors: shared ones, and independent ones of each sweep and transfer."""
    by_angle = np.zeros((len(ANGLE_ERRORS), *segments.means_rad_s.shape))
    repeats = []
    for chosen, steps in ((segments.sweep > REST, 1), (segments.sweep < REST, TRANSFER_STEPS)):
        parts = np.flatnonzero(chosen).tolist()
        for motion in {segments.intervals[part].motion for part in parts}:
            of_motion = [part for part in parts if segments.intervals[part].motion is motion]
            by_angle[:, of_motion] = rate_errors([segments.intervals[part] for part in of_motion], steps)
    for row, (sweep, interval) in enumerate(zip(segments.sweep, segments.intervals, strict=True)):
        if sweep < REST:
            for ends in _end_patterns(interval):
                repeats.append(np.zeros(segments.means_rad_s.shape))
                unseen_rad = np.hypot(interval.unseen_rad, known_errors.encoder_rad)
                repeats[-1][row] = np.hypot(known_errors.repeatability_rad, unseen_rad) * ends
    for zero, joint in JOINT_OF_ZERO.items():
        for alike in (
            _sweeps_between_moves(segments, joint) if by_angle[zero].any() else ()
        ):  # a servo has no such joint
            rows = np.isin(segments.sweep, alike)[:, None]
            repeats.append(known_errors.repeatability_rad * np.where(rows, by_angle[zero], 0.0))
    return np.concatenate(
        [known_errors.angles_rad[:, None, None] * by_angle, np.reshape(repeats, (-1, *segments.means_rad_s.shape))]
    )


def _encoder_patterns(segments: Segments, encoder_rad: float) -> Array:
    """Return the patterns of encoder errors, one for each angle of a joint at which arcs begin or end.

    Angles of a joint that differ by less than a quarter of an arc count as the same angle, with one error, because a
    sweep back passes the same encoder marks.
    """
    marks: list[tuple[int, float]] = []
    patterns_by_mark: list[Array] = []
    for row, (sweep, interval) in enumerate(zip(segments.sweep, segments.intervals, strict=True)):
        if sweep <= REST or not encoder_rad:
            continue
        q_rad = interval.motion.angles(np.array([interval.start_s, interval.end_s]))
        moved = q_rad[1] - q_rad[0]
        joint = int(np.argmax(np.abs(moved)))
        axis = interval.motion.axes(q_rad[0])[:, joint] / (interval.end_s - interval.start_s)
        for end, angle in zip((-1.0, 1.0), q_rad[:, joint], strict=True):
            apart = [abs(mark_rad - angle) if owner == joint else np.inf for owner, mark_rad in marks]
            mark = next((index for index, by in enumerate(apart) if by < abs(moved[joint]) / 4), len(marks))
            if mark == len(marks):
                marks.append((joint, float(angle)))
                patterns_by_mark.append(np.zeros(segments.means_rad_s.shape))
            patterns_by_mark[mark][row] += end * encoder_rad * axis
    return np.array(patterns_by_mark).reshape(-1, *segments.means_rad_s.shape)


def _sweeps_between_moves(segments: Segments, joint: int) -> list[list[int]]:
    """Return lists of consecutive sweeps and transfers, by index; a new list begins whenever a joint has moved.

    `joint` is counted from the end of the chain, −1 being the last joint. A sweep or transfer that moves the joint
    begins a list. Because transfers may be missing, a changed angle or another recording also begins one.
    """
    sweeps, firsts = np.unique(segments.sweep, return_index=True)
    between_moves: list[list[int]] = []
    motion, stood_rad = None, np.nan
    for first in sorted(firsts[sweeps != REST], key=lambda first: float(segments.times_s[first, 0])):
        interval = segments.intervals[first]
        start_rad, end_rad = interval.motion.angles(np.array([interval.start_s, interval.end_s]))[:, joint]
        stands = max(abs(start_rad - stood_rad), abs(end_rad - start_rad)) < STILL_RAD
        if not stands or interval.motion is not motion:
            between_moves.append([])
        between_moves[-1].append(int(segments.sweep[first]))
        motion, stood_rad = interval.motion, end_rad
    return between_moves


def rate_errors(intervals: Sequence[MotionInterval], steps: int) -> Array:
    """Return the errors (17, n, 3) rad/s of the flange's mean rate, per radian of each of `ANGLE_ERRORS`.

    The n intervals belong to one motion; each is integrated in the given number of `steps`.
    """
    motion, ends_s = intervals[0].motion, np.array([(interval.start_s, interval.end_s) for interval in intervals])
    q_rad = motion.angles(np.linspace(ends_s[:, 0], ends_s[:, 1], steps + 1, axis=1))  # (n, steps + 1, joints)
    middle, moved = (q_rad[:, 1:] + q_rad[:, :-1]) / 2, np.diff(q_rad, axis=1)
    axes = motion.axes(middle)
    errors = np.zeros((len(intervals), len(ANGLE_ERRORS), 3))
    for joint, first in _wave_indices(motion).items():
        moving = np.ptp(q_rad[..., joint], axis=1) >= STILL_RAD
        if not moving.any():
            continue
        by_axis = np.moveaxis(motion.axis_errors(middle[moving], joint), 1, -2)  # (n, 13, steps, 3)
        errors[moving, : len(AXIS_ERRORS)] += (moved[moving, None, None, :, joint] @ by_axis)[..., 0, :]
        waves = [wave(times * q_rad[moving, :, joint]) for times in (1, 2) for wave in (np.cos, np.sin)]
        errors[moving, first : first + len(WAVES)] += np.diff(waves).swapaxes(0, 1) @ axes[moving, :, :, joint]
    return np.swapaxes(errors / np.diff(ends_s)[:, :, None], 0, 1)


def _wave_indices(motion: ArmMotion) -> dict[int, int]:
    """Return for each of the last three joints (wrists) the index in `ANGLE_ERRORS` of its first angle harmonic."""
    beyond = motion.kinematics.joints - 1 - WRIST_3
    return {joint + beyond: first for joint, first in FIRST_WAVE_INDEX.items() if joint + beyond >= 0}


def _end_patterns(interval: MotionInterval) -> list[Array]:
    """Return a transfer's rate errors (3,), rad/s, per radian of angle error of each moved joint at either end."""
    q_rad = interval.motion.angles(np.array([interval.start_s, interval.end_s]))
    axes = interval.motion.axes(q_rad) / (interval.end_s - interval.start_s)
    moved = [joint for joint in _wave_indices(interval.motion) if np.ptp(q_rad[:, joint]) >= STILL_RAD]
    return [end[:, joint] for joint in moved for end in axes]


def _stamp_patterns(segments: Segments, stamp_s: float) -> Array:
    """Return a pattern for each transfer, due to errors of the time stamps of its first and last sample."""
    transfers = np.flatnonzero((segments.sweep < REST) & (stamp_s > 0))
    by_transfer = np.zeros((len(transfers), *segments.means_rad_s.shape))
    lasting_s = np.diff(segments.times_s[transfers])
    by_transfer[np.arange(len(transfers)), transfers] = (
        np.sqrt(2) * stamp_s * segments.rates_rad_s[transfers] / lasting_s
    )
    return by_transfer


def _speed_patterns(segments: Segments) -> list[Array]:
    """Return a pattern for each sweep: the change of its rates by one standard deviation of its speed."""
    errors = segments.speed_std[:, None] * segments.rates_rad_s
    return [np.where((segments.sweep == sweep)[:, None], errors, 0.0)[None] for sweep in distinct(segments.sweep)]


def _mount_patterns(segments: Segments, mount_rad: float) -> list[Array]:
    """Return for every stage except the first the three patterns (3, N, 3) of errors of the item's mount."""
    mounts = [interval.motion.mount.tobytes() for interval in segments.intervals]
    errors = mount_rad * np.cross(np.eye(3)[:, None, :], segments.rates_rad_s)
    _, *others = dict.fromkeys(mounts)
    return [np.where(np.array([mount == other for mount in mounts])[:, None], errors, 0.0) for other in others]


def _nonlinearity_patterns(intervals: Sequence[MotionInterval], matrix: Array, curve: NonlinearityPrior) -> Array:
    """Return the effects (6, N, 3) of nonlinearity on the means of N intervals.

    They are the effects of the odd parts of axes x, y, z, then of their even parts, each with the size of one prior
    standard deviation.
    """
    ends_s = np.array([(interval.start_s, interval.end_s) for interval in intervals])
    edges_s = np.linspace(ends_s[:, 0], ends_s[:, 1], TRANSFER_STEPS + 1, axis=1)
    middles_s = (edges_s[:, 1:] + edges_s[:, :-1]) / 2
    rates = np.empty((*middles_s.shape, 3))
    for motion in {interval.motion for interval in intervals}:
        of_motion = np.array([interval.motion is motion for interval in intervals])
        rates[of_motion] = motion.rate(middles_s[of_motion])
    steps = rates.reshape(-1, 3)
    bent = curvature(matrix, steps) if curve.free else nonlinear_effects(matrix, steps, curve.full_scale_rad_s)
    sizes = np.ones(6) if curve.free else np.repeat([curve.cube, curve.square], 3)
    return np.asarray(sizes[:, None, None] * bent.reshape(6, *middles_s.shape, 3).mean(axis=2), dtype=np.float64)


def _temperature_patterns(segments: Segments, matrix: Array, known_errors: KnownErrors) -> list[Array]:
    """Return the patterns (k, N, 3) of the temperature coefficients of bias and scale; empty if these are unknown."""
    if known_errors.sensor is None:
        return []
    inside, order = segments.times_s.mean(axis=1), np.argsort(known_errors.temperature_times_s)
    warm = replace(
        known_errors.sensor,
        temperature_c=np.interp(
            inside, known_errors.temperature_times_s[order], known_errors.sensor.temperature_c[order]
        ),
    )
    turns = np.where((segments.sweep == REST)[:, None], 0.0, segments.rates_rad_s)
    return [error.patterns / np.sqrt(3) for error in list_own_errors(warm, matrix, turns, segments.times_s, ())]


def _rounding_patterns(segments: Segments) -> list[Array]:
    """Return the patterns of rounding errors that several segments share."""
    rounded = rounding_errors(segments.means_rad_s, segments.roundings_rad_s, segments.variances_rad2_s2)
    return [error.patterns / np.sqrt(3) for error in rounded]

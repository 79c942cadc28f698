"""What arm and sensor may be off by in the segments of a recording: a pattern for each thing that is not known.

Each pattern is what one standard deviation of one thing does to all readings at once, as in the model of common errors
(`rig.estimation.gyroscope.common_errors`), so that what they have in common excuses nothing that they do not. Nothing
is allowed along the swept axis but what the arm's clock, encoders and times can do there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.consistency.gyroscope_checks import Allowance
from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.gyroscope.segments import Segments
from rig.analysis.gyroscope.vector_inputs import WAVE_SHARE, unknown_of
from rig.analysis.surroundings import Surroundings
from rig.config.judging.judged_by import OfSensor
from rig.data.recording.settings import Uncertainty
from rig.estimation.arrays import Array
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.gyroscope.earth_rate import EarthRate
from rig.estimation.gyroscope.nonlinearity import CUBE_MISSED, bending, curvature
from rig.estimation.gyroscope.own_errors import KnownSensor, own_errors, rounding_errors
from rig.motion.geometry import AXIS_ERRORS, WAVES, WRIST_1, WRIST_2, WRIST_3
from rig.observation.consistency.raw_readings import REST
from rig.observation.consistency.segments import MotionInterval
from rig.observation.consistency.transfers import STANDS_RAD
from rig.observation.motion.arm_motion import ArmMotion

ANGLES = (*AXIS_ERRORS, *(f"{wave} of wrist_1" for wave in WAVES))  # those of wrist 1 turn no axis, but its own speed
WAVES_OF = {WRIST_1: ANGLES.index("cos of wrist_1"), WRIST_2: ANGLES.index("cos of wrist_2"),
            WRIST_3: ANGLES.index("cos of wrist_3")}  # fmt: skip
ZEROS = {ANGLES.index("zero of wrist_2"): -2, ANGLES.index("zero of wrist_3"): -1}  # and which joint's, from the end
CURVE: tuple[OfSensor, OfSensor] = ("nonlinearity_percent", "asymmetry_percent")  # its odd and its even part
STEPS = 24  # of a way, in which directions are taken to stand still


@dataclass(frozen=True, slots=True)
class Curve:
    """A sensor's nonlinearity: standard deviations of its `cube` and `square` at `full_scale_rad_s`, as shares of that.

    Where it is `free`, nothing is known of it, not even that it has no kink at zero.
    """

    cube: float
    square: float
    full_scale_rad_s: float
    free: bool = False


@dataclass(frozen=True, slots=True)
class Allowed:
    """What is known of arm, site and sensor, each as a standard deviation.

    `angles_rad` (17,) of each of `ANGLES`; `repeatability_rad` of a joint that was moved away and back; and of its
    angle about what its encoder tells at one mark, `encoder_rad`, zero where all sweeps are whole turns; `jitter_s` of
    the times of the arm's states, `stamp_s` of those of the sensor's samples; `mount_rad` of an item that was mounted
    anew, about each axis; `earth_rad_s` (3, k) of the Earth's rate in the base's frame, for each way in which it is not
    known; `curve` is the sensor's nonlinearity, `sensor` how warm it was at times `at_s` and what that does.
    """

    angles_rad: Array
    repeatability_rad: float
    encoder_rad: float
    mount_rad: float
    jitter_s: float
    earth_rad_s: Array
    curve: Curve
    sensor: KnownSensor | None
    at_s: Array
    stamp_s: float = 0.0


def allowed(surroundings: Surroundings, name: str, result: SensorResult, stamp_std_s: float | None = None) -> Allowed:
    """What is allowed of a gyroscope and the arm, by what the configuration states and the recording tells.

    A solve that finds the curve, from several speeds, takes nothing of it as known. One of a single speed states one
    scale factor for either way, which an even part makes two: it excuses no more than what is stated of that alone.
    `stamp_std_s` is as of `RecordedSensor`.
    """
    sensor, explained = result.sensor, result.explained
    return allowed_of(
        surroundings.uncertainty,
        name,
        sensor.range_rad_s or 0.0,
        finds_curve=explained is not None and explained.nonlinearity is not None,
        arcs=any(each.arc_rad is not None for each in result.observations),
        jitter_s=surroundings.state_jitter_s,
        earth_rad_s=_earth(surroundings, name, result.earth),
        sensor=None if explained is None else explained.seen.sensor,
        at_s=np.zeros(0) if explained is None else explained.seen.windows_s.mean(axis=1),
        stamp_s=stamp_std_s or 0.0,
    )


def allowed_of(
    uncertainty: Uncertainty,
    name: str,
    full_scale_rad_s: float,
    *,
    finds_curve: bool,
    arcs: bool,
    jitter_s: float,
    earth_rad_s: Array,
    sensor: KnownSensor | None,
    at_s: Array,
    stamp_s: float = 0.0,
) -> Allowed:
    """Return what is allowed of the sensor `name` of that range."""
    steady = np.array([each.startswith(("twist", "zero")) for each in ANGLES])
    cube, square = (uncertainty.of(what, name) / 100 / np.sqrt(3) for what in CURVE)
    return Allowed(
        angles_rad=np.radians(uncertainty.axis_deg) / np.sqrt(3) * np.where(steady, 1.0, WAVE_SHARE),
        repeatability_rad=uncertainty.repeatability_std_rad,
        encoder_rad=uncertainty.angle_std_rad if arcs else 0.0,
        mount_rad=float(np.radians(uncertainty.mount_deg) / np.sqrt(3)),
        jitter_s=jitter_s,
        earth_rad_s=earth_rad_s,
        curve=Curve(float(cube / CUBE_MISSED), float(square), full_scale_rad_s, free=finds_curve),
        sensor=sensor,
        at_s=at_s,
        stamp_s=stamp_s,
    )


def allow(known: Allowed, segments: Segments, ways: Segments, matrix: Array) -> Allowance:
    """What the means of a sensor of that F (3, 3) may contradict each other by.

    What is even of its curve is left free on the ways, which are faster than sweeps: it is no change with time.
    """
    on_ways = replace(known, curve=replace(known.curve, square=1.0))
    unstable = 0.0 if known.sensor is None else known.sensor.instability_rad_s
    return Allowance(patterns(segments, matrix, known), ways, patterns(ways, matrix, on_ways), unstable)


def _earth(surroundings: Surroundings, name: str, earth_rate: EarthRate | None) -> Array:
    unknown = unknown_of(surroundings, name, earth_rate)
    if unknown.earth_covariance_rad2_s2 is not None:
        size, way = np.linalg.eigh(unknown.earth_covariance_rad2_s2)
        return np.asarray(way * np.sqrt(size.clip(min=0.0)), dtype=np.float64)
    return any_earth_rate(known=not unknown.earth_rate)


def any_earth_rate(*, known: bool) -> Array:
    """(3, k) rad/s as in `Allowed`, of the Earth's rate where the site says it, and where it does not."""
    return np.asarray(EARTH_RATE_RAD_S / np.sqrt(3) * np.eye(3)[:, : 0 if known else 3], dtype=np.float64)


def patterns(segments: Segments, matrix: Array, known: Allowed) -> Array:
    """(P, N, 3) rad/s in the readings of segments, for a sensor of that F (3, 3)."""
    of_the_arm = np.concatenate(
        [
            _of_angles(segments, known),
            _of_marks(segments, known.encoder_rad),
            _of_times(segments, known.jitter_s),
            _of_stamps(segments, known.stamp_s),
            *_of_speeds(segments),
            *_of_mounts(segments, known.mount_rad),
            np.moveaxis(segments.attitudes @ known.earth_rad_s, -1, 0),
        ]
    )
    of_the_sensor = [
        _curved(segments.intervals, matrix, known.curve),
        *_of_temperature(segments, matrix, known),
        *_of_rounding(segments),
    ]
    found = np.concatenate([of_the_arm @ matrix.T, *of_the_sensor])
    return np.asarray(found[found.any(axis=(1, 2))], dtype=np.float64)


def _of_angles(segments: Segments, known: Allowed) -> Array:
    """Patterns of the arm's angles, and of those that do not come back to where they were, for each sweep and way."""
    each = np.zeros((len(ANGLES), *segments.means_rad_s.shape))
    again = []
    for place, (sweep, interval) in enumerate(zip(segments.sweep, segments.intervals, strict=True)):
        if sweep == REST:
            continue
        each[:, place] = turned_by(interval, 1 if sweep > REST else STEPS)
        if sweep < REST:
            for ends in _ends(interval):
                again.append(np.zeros(segments.means_rad_s.shape))
                unseen_rad = np.hypot(interval.unseen_rad, known.encoder_rad)
                again[-1][place] = np.hypot(known.repeatability_rad, unseen_rad) * ends
    for zero, joint in ZEROS.items():
        for alike in _off_alike(segments, joint) if each[zero].any() else ():  # a servo has no such joint
            there = np.isin(segments.sweep, alike)[:, None]
            again.append(known.repeatability_rad * np.where(there, each[zero], 0.0))
    return np.concatenate(
        [known.angles_rad[:, None, None] * each, np.reshape(again, (-1, *segments.means_rad_s.shape))]
    )


def _of_marks(segments: Segments, encoder_rad: float) -> Array:
    """Patterns of what a joint's encoder errs at each angle where parts of sweeps begin or end.

    Marks that lie within a part's quarter are one: a sweep back has the same as the sweep there.
    """
    marks: list[tuple[int, float]] = []
    found: list[Array] = []
    for place, (sweep, interval) in enumerate(zip(segments.sweep, segments.intervals, strict=True)):
        if sweep <= REST or not encoder_rad:
            continue
        q_rad = interval.motion.angles(np.array([interval.start_s, interval.end_s]))
        moved = q_rad[1] - q_rad[0]
        joint = int(np.argmax(np.abs(moved)))
        axis = interval.motion.axes(q_rad[0])[:, joint] / (interval.end_s - interval.start_s)
        for end, angle in zip((-1.0, 1.0), q_rad[:, joint], strict=True):
            apart = [abs(at - angle) if of == joint else np.inf for of, at in marks]
            mark = next((each for each, by in enumerate(apart) if by < abs(moved[joint]) / 4), len(marks))
            if mark == len(marks):
                marks.append((joint, float(angle)))
                found.append(np.zeros(segments.means_rad_s.shape))
            found[mark][place] += end * encoder_rad * axis
    return np.array(found).reshape(-1, *segments.means_rad_s.shape)


def _off_alike(segments: Segments, joint: int) -> list[list[int]]:
    """Sweeps and ways from one move of a joint to its next; a way on which it moves is among those after it.

    The joint is counted from the end of the chain. Where a way is missing, another angle or recording says that it was
    moved.
    """
    sweeps, firsts = np.unique(segments.sweep, return_index=True)
    found: list[list[int]] = []
    motion, stood_rad = None, np.nan
    for first in sorted(firsts[sweeps != REST], key=lambda first: float(segments.times_s[first, 0])):
        interval = segments.intervals[first]
        start_rad, end_rad = interval.motion.angles(np.array([interval.start_s, interval.end_s]))[:, joint]
        stands = max(abs(start_rad - stood_rad), abs(end_rad - start_rad)) < STANDS_RAD
        if not stands or interval.motion is not motion:
            found.append([])
        found[-1].append(int(segments.sweep[first]))
        motion, stood_rad = interval.motion, end_rad
    return found


def turned_by(interval: MotionInterval, steps: int) -> Array:
    """(17, 3) rad/s by which the mean rate of the flange is off in an interval, for a radian of each of `ANGLES`."""
    motion = interval.motion
    q_rad = motion.angles(np.linspace(interval.start_s, interval.end_s, steps + 1))
    middle, moved = (q_rad[1:] + q_rad[:-1]) / 2, np.diff(q_rad, axis=0)
    axes = motion.axes(middle)
    off = np.zeros((len(ANGLES), 3))
    for joint, first in _waves_of(motion).items():
        if np.ptp(q_rad[:, joint]) < STANDS_RAD:
            continue
        off[: len(AXIS_ERRORS)] += np.tensordot(moved[:, joint], motion.axis_errors(middle, joint), axes=1)
        waves = [wave(times * q_rad[:, joint]) for times in (1, 2) for wave in (np.cos, np.sin)]
        off[first : first + len(WAVES)] += np.diff(waves) @ axes[:, :, joint]
    return off / (interval.end_s - interval.start_s)


def _waves_of(motion: ArmMotion) -> dict[int, int]:
    """Where in `ANGLES` the waves of a joint begin, by its place: of an arm its wrists, of any chain its last three."""
    beyond = motion.kinematics.joints - 1 - WRIST_3
    return {joint + beyond: first for joint, first in WAVES_OF.items() if joint + beyond >= 0}


def _ends(interval: MotionInterval) -> list[Array]:
    """(3,) rad/s for a radian by which one joint that moved was elsewhere before a way, or after it; for each."""
    q_rad = interval.motion.angles(np.array([interval.start_s, interval.end_s]))
    axes = interval.motion.axes(q_rad) / (interval.end_s - interval.start_s)
    moved = [joint for joint in _waves_of(interval.motion) if np.ptp(q_rad[:, joint]) >= STANDS_RAD]
    return [end[:, joint] for joint in moved for end in axes]


def _of_times(segments: Segments, jitter_s: float) -> Array:
    """Patterns of the times at which one part of a sweep ends and the next begins: what one gains the other loses."""
    edges = [
        (sweep, time_s)
        for sweep in np.unique(segments.sweep[segments.sweep > REST])
        for time_s in np.unique(segments.times_s[segments.sweep == sweep].round(6))
    ]
    lengths = np.diff(segments.times_s)
    found = np.zeros((len(edges), *segments.means_rad_s.shape))
    for place, (sweep, time_s) in enumerate(edges):
        start, end = (np.abs(segments.times_s - time_s) < 1e-5).T & (segments.sweep == sweep)
        found[place] = jitter_s * (end.astype(np.float64) - start)[:, None] * segments.rates_rad_s / lengths
    return found


def _of_stamps(segments: Segments, stamp_s: float) -> Array:
    """Patterns of how long each way lasted by its first and last sample; the mean of a steady turn takes no harm."""
    ways = np.flatnonzero((segments.sweep < REST) & (stamp_s > 0))
    found = np.zeros((len(ways), *segments.means_rad_s.shape))
    lasting_s = np.diff(segments.times_s[ways])
    found[np.arange(len(ways)), ways] = np.sqrt(2) * stamp_s * segments.rates_rad_s[ways] / lasting_s
    return found


def _of_speeds(segments: Segments) -> list[Array]:
    """Patterns of sweeps whose ends lie between arm states that are far apart."""
    off = segments.speed_std[:, None] * segments.rates_rad_s
    return [np.where((segments.sweep == sweep)[:, None], off, 0.0)[None] for sweep in np.unique(segments.sweep)]


def _of_mounts(segments: Segments, mount_rad: float) -> list[Array]:
    """Patterns of an item that sits a little off in every stage but the first, against which they all are held."""
    mounts = [interval.motion.mount.tobytes() for interval in segments.intervals]
    off = mount_rad * np.cross(np.eye(3)[:, None, :], segments.rates_rad_s)
    _, *others = dict.fromkeys(mounts)
    return [np.where(np.array([each == other for each in mounts])[:, None], off, 0.0) for other in others]


def _curved(intervals: Sequence[MotionInterval], matrix: Array, curve: Curve) -> Array:
    """(6, N, 3) patterns of the curve's cube and square, one standard deviation each, from moment to moment."""
    found = []
    for interval in intervals:
        edges = np.linspace(interval.start_s, interval.end_s, STEPS + 1)
        rates = interval.motion.rate((edges[1:] + edges[:-1]) / 2)
        bent = curvature(matrix, rates) if curve.free else bending(matrix, rates, curve.full_scale_rad_s)
        found.append(bent.mean(axis=1))
    sizes = np.ones(6) if curve.free else np.repeat([curve.cube, curve.square], 3)
    return np.asarray(sizes[:, None, None] * np.stack(found, axis=1), dtype=np.float64)


def _of_temperature(segments: Segments, matrix: Array, known: Allowed) -> list[Array]:
    """Patterns of one standard deviation of what warming does to bias and scale."""
    if known.sensor is None:
        return []
    inside, order = segments.times_s.mean(axis=1), np.argsort(known.at_s)
    warm = replace(known.sensor, temperature_c=np.interp(inside, known.at_s[order], known.sensor.temperature_c[order]))
    turns = np.where((segments.sweep == REST)[:, None], 0.0, segments.rates_rad_s)
    return [each.patterns / np.sqrt(3) for each in own_errors(warm, matrix, turns, segments.times_s, ())]


def _of_rounding(segments: Segments) -> list[Array]:
    """Patterns of one standard deviation of what rounding does to segments alike."""
    rounded = rounding_errors(segments.means_rad_s, segments.roundings_rad_s, segments.variances_rad2_s2)
    return [each.patterns / np.sqrt(3) for each in rounded]

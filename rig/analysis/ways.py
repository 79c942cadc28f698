"""The ways between sweeps and rests, each as one piece: the only turns that some axes make at another time.

Each axis is swept in one stretch of time, so that the sweeps alone do not show that its scale factor changed before or
after. On the ways the wrists turn by half a turn, from standing to standing, two of them at a time: so the sensor's
mean reading is as well known by the arm as in a sweep, about axes that are not being swept.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rig.analysis.allowance import STANDS_RAD
from rig.analysis.cut_recording import FEWEST_AT_REST, REST, Pieces, Stretch
from rig.analysis.vector_inputs import since_first_s
from rig.data.quantity import RATE
from rig.data.run_file import RunData
from rig.estimation.arrays import Array
from rig.estimation.rounding import rounding_left
from rig.estimation.vector_fit import Explained
from rig.motion.geometry import flange_attitude, flange_pose
from rig.observation.arm_motion import ArmMotion
from rig.observation.average import Stream, between
from rig.observation.known_motion import MIN_RATE_RAD_S
from rig.observation.lines import fitted, unit_columns
from rig.observation.observed_run import ObservedRun
from rig.observation.tapered_weights import noise_at_zero
from rig.observation.windows import rested, swept

BEYOND_S = 0.1  # before it moves and after, in which an arm stands still that was slower than can be told
SHORTEST_S, LONGEST_S = 0.5, 30.0
SPARSE_S = 0.0105  # samples that are farther apart miss what the servo's vibration does while it grows faster
# Samples add up to a way but for the corners of its rate: each by its change of slope times dt² B₂(x) / 2, where in the
# interval it may lie (Euler and Maclaurin); B₂, Bernoulli's second polynomial, is √(1/180) RMS, and either end has two.
CORNERS = (2 / 180) ** 0.5 / 2
LOST = 0.01  # of the samples, at most, by a rate that a part keeps so well
GAP = 1.5  # of the interval between samples: one is missing, and with it so much of the way
STEPS = 48
WRISTS = 3  # whose ways count, the last joints
LOW = 0.0  # of the data rate: no more low frequencies than the fewest, for a servo's vibration is near


def with_ways(pieces: Pieces, name: str, recordings: Sequence[ObservedRun], explained: Explained) -> Pieces:
    """The pieces, and all ways on which only the wrists turned; their places count down from below `REST`.

    Their noise is that of the other pieces, for as long as they last, or their own where that is more, and what a
    vibration leaves of which the rests beside either end tell. (No lines are sought on a way: it is short, and the
    servo's own vibration grows faster and slower on it. Where it passes the data rate it stands still in the samples,
    and their mean is off by it.)
    """
    found = [
        (way, stream, since_s, each.run.settings, each.run.settings.site)
        for each, since_s in zip(recordings, since_first_s(recordings), strict=True)
        for stream in [each.stream(name)]
        for way in _ways(each.run, stream, each.motion)
    ]
    if not found:
        return pieces
    of_noise = pieces.variances_rad2_s2 - np.square(pieces.roundings_rad_s)
    density = np.median(of_noise * np.diff(pieces.times_s), axis=0)
    means, rates, attitudes, pulls, roundings, scatters = [], [], [], [], [], []
    for way, stream, _, settings, site in found:
        inside = between(stream, way.start_s, way.end_s)
        readings = stream.readings_rad_s[inside]
        moving = way.motion.rate(stream.time_s[inside]) @ explained.solution.matrix.T
        roundings.append(rounding_left(readings, stream.steps, moving, stream.steps.variance))
        attitude = way.motion.attitude(way.start_s, way.end_s)
        scatters.append(_scatter(readings, stream.time_s[inside], way.motion, site.down_m_s2))
        means.append(readings.mean(axis=0))
        rates.append(way.motion.mean_rate(way.start_s, way.end_s) + attitude @ explained.seen.earth_rate_rad_s)
        attitudes.append(attitude)
        pulls.append(pull_m_s2(way, site.down_m_s2, np.array(settings.extension_m)))
    times_s = np.array([(way.start_s + since_s, way.end_s + since_s) for way, _, since_s, *_ in found])
    lasting_s, count = np.diff(times_s), len(found)
    swing_rad2 = _swings(pieces, name, recordings, times_s)
    noise = np.maximum(density / lasting_s, scatters)
    return replace(
        pieces,
        sweep=np.concatenate([pieces.sweep, REST - 1 - np.arange(count)]),
        place=np.concatenate([pieces.place, np.zeros(count)]),
        means_rad_s=np.concatenate([pieces.means_rad_s, means]),
        variances_rad2_s2=np.concatenate([pieces.variances_rad2_s2, noise + swing_rad2 / lasting_s**2 + roundings]),
        roundings_rad_s=np.concatenate(
            [np.broadcast_to(pieces.roundings_rad_s, pieces.means_rad_s.shape), np.sqrt(roundings)]
        ),
        rates_rad_s=np.concatenate([pieces.rates_rad_s, rates]),
        pull_m_s2=np.concatenate([pieces.pull_m_s2, pulls]),
        attitudes=np.concatenate([pieces.attitudes, attitudes]),
        speed_std=np.concatenate([pieces.speed_std, np.zeros(count)]),
        times_s=np.concatenate([pieces.times_s, times_s]),
        stretches=(*pieces.stretches, *(way for way, *_ in found)),
    )


def _scatter(readings: Array, time_s: Array, motion: ArmMotion, down_m_s2: Array) -> Array:
    """Return (3,) the variance of the mean of readings (n, 3) on a way, by what neither the arm nor gravity explains.

    A sensor that lags reads how the rate changes. A ripple that is faster than readings and states come looks like
    noise, at low frequencies too.
    """
    rates = motion.sampled_rates(time_s)
    felt = flange_attitude(motion.angles(time_s), motion.kinematics) @ down_m_s2
    columns = unit_columns(np.column_stack([np.ones(len(rates)), rates, np.gradient(rates, axis=0), felt]))
    variance: Array = noise_at_zero(readings - columns @ fitted(columns, readings), LOW) / len(readings)
    return variance


def _swings(pieces: Pieces, name: str, recordings: Sequence[ObservedRun], times_s: Array) -> Array:
    """(M, 3) rad² by which what vibrates differs from the start to the end of M ways, by the rest nearest to either."""
    rests = [
        (rest, since_s)
        for each, since_s in zip(recordings, since_first_s(recordings), strict=True)
        for rest in each.sensors[name].rests
    ]
    windows = [window for window in pieces.windows if window.sweep == REST]
    told = [
        ((rest.start_s + rest.end_s) / 2 + since_s, window.swing_rad2)
        for (rest, since_s), window in zip(rests, windows, strict=True)
        if rest.samples >= FEWEST_AT_REST  # fewer do not show what vibrates
    ]
    if not told:
        return np.zeros((len(times_s), 3))
    rests_s, swings_rad2 = (np.array(each) for each in zip(*told, strict=True))
    nearest = np.abs(times_s[:, :, None] - rests_s).argmin(axis=2)
    found: Array = swings_rad2[nearest].mean(axis=1)
    return found


def _ways(run: RunData, stream: Stream, motion: ArmMotion) -> Iterator[Stretch]:
    """Every one, from before the arm moves to when it stands, in which nothing is missing.

    There is none of a shaft whose encoder is known over whole turns alone: a way is a part of one.
    """
    if not motion.tells_parts_of_turns:
        return
    windows = sorted([*(each.window for each in swept(run)), *rested(run)], key=lambda window: window.start_s)
    for before, after in pairwise(windows):
        yield from _moved(before.end_s, after.start_s, stream, motion)
    if windows:
        yield from _moved(float(motion.time_s[0]), windows[0].start_s, stream, motion)
        yield from _moved(windows[-1].end_s, float(motion.time_s[-1]), stream, motion)


def moved(motion: ArmMotion, start_s: float, end_s: float) -> Stretch | None:
    """The stretch from before the arm moves to when it stands again; None where it does not move in this time."""
    inside = (motion.time_s >= start_s) & (motion.time_s <= end_s)
    moving = motion.time_s[inside][np.linalg.norm(motion.rate(motion.time_s[inside]), axis=1) > MIN_RATE_RAD_S]
    if not len(moving):
        return None
    return Stretch(motion, max(start_s, float(moving[0]) - BEYOND_S), min(end_s, float(moving[-1]) + BEYOND_S))


def by_the_wrists(way: Stretch) -> bool:
    """Whether it is one that counts: neither too short nor too long, and no other joint turns."""
    before = max(way.motion.kinematics.joints - WRISTS, 0)  # of any chain the last three joints are its wrists
    others = way.motion.angles(np.linspace(way.start_s, way.end_s, STEPS))[:, :before]
    turned_rad = np.ptp(others, axis=0).max(initial=0.0)
    return bool(SHORTEST_S < way.end_s - way.start_s < LONGEST_S and turned_rad < STANDS_RAD)


def _moved(start_s: float, end_s: float, stream: Stream, motion: ArmMotion) -> Iterator[Stretch]:
    way = moved(motion, start_s, end_s)
    if way is None:
        return
    samples = between(stream, way.start_s, way.end_s)
    time_s = stream.time_s[samples]
    if len(time_s) < 2 or np.diff(time_s).mean() > SPARSE_S:
        return
    step_s = float(time_s[-1] - time_s[0]) / (len(time_s) - 1)
    turning = motion.time_s[(motion.time_s >= way.start_s) & (motion.time_s <= way.end_s)]
    unseen_rad = float(np.linalg.norm(motion.rate(turning, 1), axis=1).max() * CORNERS * step_s**2)
    way = Stretch(motion, float(time_s[0]) - step_s / 2, float(time_s[-1]) + step_s / 2, unseen_rad)
    whole = len(time_s) >= (1 - LOST) * (way.end_s - way.start_s) * stream.sensor.rate_hz
    whole &= bool(np.diff(time_s).max() < GAP * step_s)
    ends = np.linalg.norm(motion.rate(np.array([way.start_s, way.end_s])), axis=1)
    in_range = not stream.sensor.channel(RATE).saturated(stream.raw[samples]).any()
    stands = ends.max() < 2 * MIN_RATE_RAD_S
    if by_the_wrists(way) and whole and in_range and stands and motion.covered(time_s).all():
        yield way


def pull_m_s2(way: Stretch, down_m_s2: Array, extension_m: Array) -> Array:
    """(3,) what is felt as gravity in the mean: gravity less the acceleration of where the sensors sit."""
    time_s, step_s = np.linspace(way.start_s, way.end_s, STEPS, retstep=True)
    pose = flange_pose(way.motion.angles(time_s), way.motion.kinematics)
    place_m = pose[:, :3, 3] + pose[:, :3, :3] @ extension_m
    acceleration = np.diff(place_m, n=2, axis=0) / step_s**2
    felt = np.einsum("nji,nj->ni", pose[1:-1, :3, :3], down_m_s2 - acceleration)
    return np.asarray(way.motion.mount @ felt.mean(axis=0), dtype=np.float64)

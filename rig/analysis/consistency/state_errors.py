"""The errors of the times and joint angles of the arm's states, in the segments of a recording.

A mean rate is a difference of two angles, so an error at the edge between two segments of a sweep increases one rate
and decreases the next. The encoder noise of the turning joint is part of the jitter of the times.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rig.analysis.gyroscope.segment_table import Segments
from rig.estimation.arrays import Array, distinct
from rig.observation.consistency.raw_readings import REST
from rig.observation.consistency.transfers import STILL_RAD

TIME_TOLERANCE_S = 1e-5  # times that differ by more belong to different edges


def build_time_patterns(segments: Segments, jitter_s: float) -> Array:
    """Return the patterns (P, N, 3) rad/s of errors of the times at which the segments of sweeps begin and end."""
    lengths = np.diff(segments.times_s)
    by_rate = jitter_s * segments.rates_rad_s / lengths
    effects = [
        effect for sweep in distinct(segments.sweep[segments.sweep > REST]) for effect in _edges(segments, sweep)
    ]
    return np.reshape([effect[:, None] * by_rate for effect in effects], (-1, *segments.means_rad_s.shape))


def build_reading_patterns(segments: Segments, noise_rad: float) -> Array:
    """Return the patterns (P, N, 3) rad/s of noise of the joint angles at the edges of segments.

    In sweeps, only the vibrating joints are included, because the noise of the turning joint is part of the time
    jitter, and joints at rest have no noise. In transfers all joints are included, because none turns at the ends.
    Each edge has one pattern for each independent direction of the axes of these joints, three at most.
    """
    lengths = np.diff(segments.times_s)
    patterns = []
    for sweep in distinct(segments.sweep[(segments.sweep != REST) & (noise_rad > 0)]):
        rows = np.flatnonzero(segments.sweep == sweep)
        first, last = segments.intervals[rows[0]], segments.intervals[rows[-1]]
        counted = np.ones(len(first.motion.names), dtype=np.bool_)
        if sweep > REST:
            q_rad = first.motion.angles(np.array([first.start_s, last.end_s]))
            counted = first.motion.is_moving(first.start_s, last.end_s) & (np.abs(q_rad[1] - q_rad[0]) < STILL_RAD)
        for effect in _edges(segments, sweep):
            interval = segments.intervals[np.flatnonzero(effect)[0]]
            at_s = interval.end_s if effect[effect != 0][0] > 0 else interval.start_s
            directions, sizes, _ = np.linalg.svd(interval.motion.axes(interval.motion.angles(at_s))[:, counted])
            patterns.extend(
                noise_rad * effect[:, None] / lengths * axis for axis in (directions[:, : len(sizes)] * sizes).T
            )
    return np.reshape(patterns, (-1, *segments.means_rad_s.shape))


def _edges(segments: Segments, sweep: int) -> Iterator[NDArray[np.float64]]:
    """Yield an array (N,) for each edge of a sweep's segments: 1 for the one ending there, −1 for the next, else 0."""
    inside = segments.sweep == sweep
    times_s = np.sort(segments.times_s[inside].ravel())
    for time_s in times_s[np.append(True, np.diff(times_s) > TIME_TOLERANCE_S)]:
        start, end = (np.abs(segments.times_s - time_s) < TIME_TOLERANCE_S).T & inside
        yield end.astype(np.float64) - start

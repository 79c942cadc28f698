"""The board's own average of each sweep, compared with the computer's mean of the same turn. Pure.

Both come from the same samples, but by other weights: the board's are even, over whole blocks of readings, so its
window begins and ends a little before or after the turn; the computer's leave nothing of the lines it found. What the
arm turned under the board's weights is known, and so is what these keep of the lines. The rest must agree.
"""

from collections.abc import Sequence

import numpy as np

from rig.data.recording.events import BoardObserved
from rig.estimation.arrays import Array
from rig.observation.average import Stream
from rig.observation.observe import Observation
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.lines import fitted, turning, waves
from rig.observation.turn_mean import lag_columns

NEXT_S = 1e-7  # rounding of a sample's time


def compare_board_means(sensor: str, recordings: Sequence[ObservedRun]) -> dict[int, float]:
    """Return how far the board's average of each sweep is from the computer's mean, by the sweep's index.

    In standard deviations of the computer's mean, of the axis where it is farthest. Nothing of sweeps that the board
    did not average.
    """
    deviations = dict[int, float]()
    for recording in recordings:
        observed = {
            recorded.event.sweep: recorded.event
            for recorded in recording.run.events
            if isinstance(recorded.event, BoardObserved) and recorded.event.sensor == sensor
        }
        stream = recording.stream(sensor) if observed else None
        for turn in recording.sensors[sensor].revolutions:
            if stream is not None and turn.sweep in observed:
                deviations[turn.sweep] = _deviation(recording, stream, turn, observed[turn.sweep])
    return deviations


def _deviation(recording: ObservedRun, stream: Stream, turn: Observation, observed: BoardObserved) -> float:
    """Return how far the board's average is from what the computer's makes of its window, in standard deviations."""
    zero, average, seen = stream.clock.zero_rate_rad_s, turn.average, observed.observation
    axis = turn.axis_flange
    across = np.array(stream.sensor.mounting) @ (np.eye(3) - np.outer(axis, axis))  # what sways there is small
    by_rate = np.outer(average.mean_rad_s - zero, axis) / turn.speed_rad_s + across
    own = np.searchsorted(stream.time_s, [average.start_s, average.end_s])
    boards = np.searchsorted(stream.board_time_s, np.array([seen.start_us, seen.end_us]) * 1e-6 - NEXT_S)
    first, last = int(min(own[0], boards[0])), int(max(own[1], boards[1]))
    of_turn, of_board = slice(*(own - first).tolist()), slice(*(boards - first).tolist())
    time_s = stream.time_s[first:last]
    rates = recording.motion.sampled_rates(time_s)
    passing = _passing(time_s, turn, rates @ axis)
    left = (stream.readings_rad_s[first:last] - zero - rates @ by_rate.T)[of_turn]
    columns = np.column_stack([np.ones(len(left)), passing[of_turn]])
    kept = passing[of_board].mean(axis=0) @ fitted(columns, left)[1:]
    apart = np.array(seen.mean_rad_s) - zero - by_rate @ rates[of_board].mean(axis=0) - kept
    return float(np.max(np.abs(apart) / average.mean_std_rad_s))


def _passing(time_s: Array, turn: Observation, along_rad_s: Array) -> Array:
    """Return columns (n, k) that the computer's mean is free of, at times (n,) with such rates (n,) along the axis.

    They are what comes once and twice in a turn, its lines, and what a sensor that lags reads of a slow ripple.
    """
    average = turn.average
    share = (time_s - average.start_s) / average.duration_s
    angle_rad = 2 * np.pi if turn.angle_rad is None else turn.angle_rad
    of_turn = turning(angle_rad * share, 2 * turn.beats)
    if turn.arc_rad is not None:
        of_turn -= turning(angle_rad * np.linspace(0.0, 1.0, len(share)), 2 * turn.beats).mean(axis=0)
    lines = waves(average.lines_hz * average.duration_s, share, turn.beats)
    if turn.arc_rad is not None:
        return np.column_stack([of_turn, lines])
    columns = np.column_stack([np.ones(len(share)), of_turn, lines])
    return np.column_stack([of_turn, lines, lag_columns(along_rad_s, columns, share)])

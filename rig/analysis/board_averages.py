"""The board's own average of each sweep, held against the computer's mean of the same turn. Pure.

Both come from the same samples, but by other weights: the board's are even, over whole blocks of readings, so its
window begins and ends a little before or after the turn; the computer's leave nothing of the lines it found. What the
arm turned under the board's weights is known, and so is what these keep of the lines. The rest must agree: a mean of
readings beside a mean rate that does not belong to it shows here, and nowhere in the residuals.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from rig.analysis.check import Check, fitness
from rig.data.events import BoardObserved
from rig.estimation.arrays import Array
from rig.observation.average import Stream
from rig.observation.lines import fitted, turning, waves
from rig.observation.observe import Observation
from rig.observation.observed_run import ObservedRun
from rig.observation.turn_mean import lagging

NAME = "board_average"
NEXT_S = 1e-7  # rounding of a sample's time
LIMIT = 6.0  # standard deviations of the mean; both have its noise in common, and differ by a tenth of it as a rule


def board_averages(sensor: str, recordings: Sequence[ObservedRun]) -> tuple[Check, ...]:
    """Return the checks of every sweep whose averages contradict each other, or one of all of them.

    None where the board averaged nothing. The value is the largest difference of the three axes over the standard
    deviation of the computer's mean.
    """
    found = {turn.sweep: _apart(*compared) for turn, compared in _compared(sensor, recordings)}
    if not found:
        return ()
    beyond = [sweep for sweep, value in found.items() if not value <= LIMIT]
    return tuple(fitness(sensor, "rate", NAME, found[sweep], LIMIT, sweep=sweep) for sweep in sorted(beyond)) or (
        fitness(sensor, "rate", NAME, max(found.values()), LIMIT),
    )


def _compared(
    sensor: str, recordings: Sequence[ObservedRun]
) -> Iterator[tuple[Observation, tuple[ObservedRun, Stream, Observation, BoardObserved]]]:
    for recording in recordings:
        observed = {
            recorded.event.sweep: recorded.event
            for recorded in recording.run.events
            if isinstance(recorded.event, BoardObserved) and recorded.event.sensor == sensor
        }
        stream = recording.stream(sensor) if observed else None
        for turn in recording.sensors[sensor].revolutions:
            if stream is not None and turn.sweep in observed:
                yield turn, (recording, stream, turn, observed[turn.sweep])


def _apart(recording: ObservedRun, stream: Stream, turn: Observation, observed: BoardObserved) -> float:
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
    """(n, k) what the computer's mean is free of at times (n,), where the arm's rate along the axis is known (n,).

    What comes once and twice in a turn, its lines, and what a sensor that lags reads of a slow ripple.
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
    return np.column_stack([of_turn, lines, lagging(along_rad_s, columns, share)])

"""The board's own average of each sweep, compared with the computer's mean of the same turn. Pure functions.

The comparison shows an error that no residual shows: a mean reading that is paired with a wrong mean rate.

Board and computer average the same samples, with different weights. The board's weights are equal over whole blocks of
readings, so its window begins and ends a little before or after the turn; the computer's weights cancel the spectral
lines that the computer found. So the computer's mean is corrected for the other rotation, and for the spectral lines,
that the board's window contains. The board's average must agree with the corrected mean.
"""

from collections.abc import Sequence

import numpy as np

from rig.data.recording.recorded_events import BoardObserved
from rig.estimation.arrays import Array
from rig.observation.average import Stream
from rig.observation.observe import Observation
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.spectral_lines import fit_columns, harmonics, waves
from rig.observation.turn_mean import lag_columns, line_variance, slow_columns

TIME_ROUNDING_S = 1e-7  # at most


def compare_board_means(sensor: str, recordings: Sequence[ObservedRun]) -> dict[int, float]:
    """Return how much the board's average of each sweep deviates from the computer's mean, by the sweep's index.

    A deviation is that of the worst axis, in standard deviations of the computer's mean. Sweeps that the board did not
    average are absent.
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
    """Return the largest deviation of the board's average from its prediction on any axis, in standard deviations.

    The computer's mean predicts the board's average, after two corrections for the board's different window and
    weights. The reading due to the rotation, which is the mean minus the reading at zero rate, is scaled to the arm's
    mean rate in the board's window. The average of the spectral lines in that window is added.

    The frequencies of slow spectral lines are uncertain, so the variance includes the effect that these lines, with
    random phases, have on the board's average.
    """
    zero, average, board = stream.clock.zero_rate_rad_s, turn.average, observed.observation
    axis = turn.axis_flange
    # From the flange's rate to readings: along the axis by the computer's mean; across it, where the rate is small, by
    # the nominal mounting.
    across = np.array(stream.sensor.mounting) @ (np.eye(3) - np.outer(axis, axis))
    by_rate = np.outer(average.mean_rad_s - zero, axis) / turn.speed_rad_s + across
    edges = np.searchsorted(stream.time_s, [average.start_s, average.end_s])
    boards = np.searchsorted(stream.board_time_s, np.array([board.start_us, board.end_us]) * 1e-6 - TIME_ROUNDING_S)
    first, last = int(min(edges[0], boards[0])), int(max(edges[1], boards[1]))
    of_turn, of_board = slice(*(edges - first).tolist()), slice(*(boards - first).tolist())
    time_s = stream.time_s[first:last]
    rates = recording.motion.rates_at_samples(time_s)
    regressors = _nuisance_columns(time_s, turn, rates @ axis)
    residuals = (stream.readings_rad_s[first:last] - zero - rates @ by_rate.T)[of_turn]
    columns = np.column_stack([np.ones(len(residuals)), regressors[of_turn]])
    sizes, of_columns = fit_columns(columns, residuals)[1:], regressors[of_board].mean(axis=0)
    # The prediction is zero + by_rate @ mean rate + means of the nuisance columns.
    deviation = np.array(board.mean_rad_s) - zero - by_rate @ rates[of_board].mean(axis=0) - of_columns @ sizes
    is_slow = np.flatnonzero(slow_columns(average.lines_hz * average.duration_s, turn.sidebands))
    by_lines = line_variance(sizes[is_slow], of_columns[is_slow])
    return float(np.max(np.abs(deviation) / np.sqrt(average.mean_std_rad_s**2 + by_lines)))


def _nuisance_columns(time_s: Array, turn: Observation, rates_rad_s: Array) -> Array:
    """Return the columns (n, k), at times (n,), that the computer's mean of a turn cancels and the board's does not.

    The columns are, in this order, the spectral lines, the turn's harmonics and, for whole turns, the effect of a slow
    ripple on a lagging sensor. `rates_rad_s` (n,) are the rates about the turn's axis.
    """
    average = turn.average
    fraction = (time_s - average.start_s) / average.duration_s
    angle_rad = 2 * np.pi if turn.angle_rad is None else turn.angle_rad
    of_turn = harmonics(angle_rad * fraction, 2 * turn.sidebands)
    if turn.arc_rad is not None:
        of_turn -= harmonics(angle_rad * np.linspace(0.0, 1.0, len(fraction)), 2 * turn.sidebands).mean(axis=0)
    lines = waves(average.lines_hz * average.duration_s, fraction, turn.sidebands)
    if turn.arc_rad is not None:
        return np.column_stack([lines, of_turn])
    columns = np.column_stack([np.ones(len(fraction)), of_turn, lines])
    return np.column_stack([lines, of_turn, lag_columns(rates_rad_s, columns, fraction)])

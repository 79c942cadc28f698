"""Host and board solve the same observations: what the board found, held against double precision. Pure.

Both average the very same samples (the board says which it used) and are told the same speeds, so what differs is only
the board's arithmetic. Where a sample was lost on the way to the host, which would outweigh that, the board's own mean
stands in. The run's own calibration is another matter: it weighs, takes the vibration out and knows the rests
(`rig.analysis.gyroscope.calibration`).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis.check import Check, fitness
from rig.data.quantity import RATE
from rig.data.recording.events import BoardNotObserved, BoardObserved, BoardRecalled, BoardSolved, OfTheBoard
from rig.data.recording.run_file import RunData
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator
from rig.observation.onboard_window import find_board_averages

SCALE_LIMIT = 1e-4  # relative
BIAS_LIMIT_RAD_S = 1e-5


@dataclass(frozen=True, slots=True)
class Agreement:
    """A sensor's calibration by the board beside the same in double precision; None where either has no solution.

    `solutions` are the board's by method. `scale_difference` is relative, `bias_difference_rad_s`
    absolute, each the largest of three axes, for the closed form. `not_observed` says which sweeps the board has no
    observation of, and why.
    """

    solutions: Mapping[str, BoardSolved]
    not_observed: tuple[str, ...]
    host_scale: Array | None
    host_bias_rad_s: Array | None
    scale_difference: float | None
    bias_difference_rad_s: float | None

    def checks(self, sensor: str) -> tuple[Check, ...]:
        """The two checks of the verdict: no board may be trusted whose arithmetic was not seen to be right."""
        scale, bias = self.scale_difference, self.bias_difference_rad_s
        return (
            fitness(sensor, "rate", "board_scale", scale, SCALE_LIMIT, parameter="scale"),
            fitness(sensor, "rate", "board_bias", bias, BIAS_LIMIT_RAD_S, unit="rad/s", parameter="bias"),
        )


def agreement(runs: Sequence[RunData], sensor: str) -> Agreement:
    """Compare for one sensor over all recordings of a run, of which the last holds the board's solutions."""
    solutions = {event.solution.method: event for event in _of(runs[-1], sensor) if isinstance(event, BoardSolved)}
    not_observed = _not_observed(runs[-1], sensor)
    host = _solve(_observations(runs, sensor))
    board = solutions.get("closed_form")
    if host is None or board is None or board.solution.status != "solved":
        scale, bias = (None, None) if host is None else host
        return Agreement(solutions, not_observed, scale, bias, None, None)
    scale, bias = host
    return Agreement(
        solutions,
        not_observed,
        scale,
        bias,
        float(np.max(np.abs(np.array(board.solution.scale) / scale - 1))),
        float(np.max(np.abs(np.array(board.solution.bias_rad_s) - bias))),
    )


def check_observed(run: RunData, sensors: Iterable[str]) -> None:
    """Raise Fault `board_missed_sweep` if the board has no observation of a sweep: a resumed run repeats it."""
    for sensor in sensors:
        if missed := _not_observed(run, sensor):
            raise Fault(
                "board_missed_sweep",
                f"the board could not average, for {sensor}, {'; '.join(missed)}",
                "Resume the run to repeat these",
            )


def _not_observed(run: RunData, sensor: str) -> tuple[str, ...]:
    return tuple(
        f"sweep {event.sweep}: {event.reason}" for event in _of(run, sensor) if isinstance(event, BoardNotObserved)
    )


@dataclass(frozen=True, slots=True)
class _Observation:
    """What the board solved from: mean reading (3,) and speed; `averaged` when the host averaged the reading itself."""

    mean_rad_s: Array
    speed_rad_s: float
    averaged: bool


def _observations(runs: Sequence[RunData], sensor: str) -> list[_Observation]:
    """Every observation the board solved from, by the recorded samples."""
    found: list[_Observation] = []
    for event in _of(runs[-1], sensor):
        if isinstance(event, BoardObserved):
            found.append(_observation(runs[-1], event))
        elif isinstance(event, BoardRecalled):
            found.append(_recalled(runs[:-1], event))
    return found


def _recalled(earlier: Sequence[RunData], recalled: BoardRecalled) -> _Observation:
    """What the newest of the earlier recordings says of it; a mean that is not a number where none does."""
    for run in reversed(earlier):
        if seen := find_board_averages([run], recalled.sensor, (recalled.sweep,)):
            return _observation(run, seen[recalled.sweep])
    return _Observation(np.full(3, np.nan), np.nan, averaged=False)


def _observation(run: RunData, seen: BoardObserved) -> _Observation:
    samples, observed = run.samples[seen.sensor], seen.observation
    times_us = samples["board_time_us"]
    used = slice(*np.searchsorted(times_us, [observed.start_us, observed.end_us]).tolist())
    missing = observed.samples - (used.stop - used.start)
    if 0 < missing <= _lost(samples["sequence"][max(used.start - 1, 0) : used.stop + 1]):
        return _Observation(np.array(observed.mean_rad_s), seen.speed_rad_s, averaged=False)
    gyroscope = run.sensors[seen.sensor].channel(RATE)
    counts = gyroscope.counts(samples)[used]
    mean = counts.mean(axis=0) if missing == 0 and len(counts) else np.full(3, np.nan)
    return _Observation(gyroscope.convert(mean), seen.speed_rad_s, averaged=True)


def _of(run: RunData, sensor: str) -> Iterator[OfTheBoard]:
    """What a recording says of the board's own calibration of a sensor, in order."""
    for recorded in run.events:
        if isinstance(recorded.event, OfTheBoard) and recorded.event.sensor == sensor:
            yield recorded.event


def _lost(sequence: NDArray[np.uint32]) -> int:
    """How many numbers are missing in a sequence, which is counted modulo 2³²."""
    return int(np.sum(np.diff(sequence).astype(np.int64) - 1))


def _solve(observations: Sequence[_Observation]) -> tuple[Array, Array] | None:
    """Scale and bias as the board computes them, every observation with the same weight.

    None where that cannot be: too few observations, other samples than the board says it used, or not one mean that
    the host could check.
    """
    accumulated = Accumulator.empty()
    if not any(observation.averaged for observation in observations):
        return None
    try:
        for seen in observations:
            accumulated = accumulated.add(seen.mean_rad_s, np.ones(3), seen.speed_rad_s, weight=1.0)
        solution = accumulated.solve()
    except Fault:
        return None
    return solution.scale, solution.bias_rad_s

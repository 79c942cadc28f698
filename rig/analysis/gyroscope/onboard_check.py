"""The comparison of the board's own solution with a double-precision one from the same observations. Pure functions.

Board and host average the same samples (the board reports which) and use the same speeds, so that only the arithmetic
differs. If a sample was lost on its way to the host, the board's own mean replaces the host's. The run's calibration
differs from both solutions, because it has weights, removes vibration and uses rests
(`rig.analysis.gyroscope.calibration`).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis.check import Check, fitness
from rig.data.quantity import RATE
from rig.data.recording.recorded_events import BoardEvent, BoardNotObserved, BoardObserved, BoardRecalled, BoardSolved
from rig.data.recording.run_data import RunData
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator
from rig.observation.onboard_window import find_board_averages

SCALE_LIMIT = 1e-4  # relative
BIAS_LIMIT_RAD_S = 1e-5


@dataclass(frozen=True, slots=True)
class Agreement:
    """A sensor's calibration by the board, compared with the host's in double precision.

    - `solutions`: the board's solutions, by method.
    - `not_observed`: a phrase for each sweep that the board could not average, with the reason.
    - `host_scale`, `host_bias_rad_s` (3,): the host's solution, None if there is none.
    - `scale_difference` (relative), `bias_difference_rad_s`: the largest difference on any axis between the host's
      solution and the board's solution in closed form; None if either is missing.
    """

    solutions: Mapping[str, BoardSolved]
    not_observed: tuple[str, ...]
    host_scale: Array | None
    host_bias_rad_s: Array | None
    scale_difference: float | None
    bias_difference_rad_s: float | None

    def checks(self, sensor: str) -> tuple[Check, ...]:
        """Return the checks of the board's scale and bias, which fail if there is nothing to compare."""
        scale, bias = self.scale_difference, self.bias_difference_rad_s
        return (
            fitness(sensor, "rate", "board_scale", scale, SCALE_LIMIT, parameter="scale"),
            fitness(sensor, "rate", "board_bias", bias, BIAS_LIMIT_RAD_S, unit="rad/s", parameter="bias"),
        )


def check_arithmetic(runs: Sequence[RunData], sensor: str) -> Agreement:
    """Return how the board's solution for a sensor, in the last of the recordings `runs`, agrees with the host's."""
    solutions = {event.solution.method: event for event in _events(runs[-1], sensor) if isinstance(event, BoardSolved)}
    not_observed = _list_unobserved(runs[-1], sensor)
    host = _solve(_list_observations(runs, sensor))
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
    """Raise Fault `board_missed_sweep` if the board could not average a sweep, which a resumed run repeats."""
    for sensor in sensors:
        if missed := _list_unobserved(run, sensor):
            raise Fault(
                "board_missed_sweep",
                f"the board could not average, for {sensor}, {'; '.join(missed)}",
                "Follow what is said there, then resume the run, which repeats these sweeps",
            )


def _list_unobserved(run: RunData, sensor: str) -> tuple[str, ...]:
    return tuple(
        f"sweep {event.sweep}: {event.reason}" for event in _events(run, sensor) if isinstance(event, BoardNotObserved)
    )


@dataclass(frozen=True, slots=True)
class _BoardObservation:
    """The mean reading (3,) of a sweep that the board observed, and its speed.

    `averaged`: whether the mean is the host's. If not, it is the board's own, or NaN if the sweep was not recorded.
    """

    mean_rad_s: Array
    speed_rad_s: float
    averaged: bool


def _list_observations(runs: Sequence[RunData], sensor: str) -> list[_BoardObservation]:
    """Return the observations from which the board solved, each as `_average_observation` computes it."""
    observations: list[_BoardObservation] = []
    for event in _events(runs[-1], sensor):
        if isinstance(event, BoardObserved):
            observations.append(_average_observation(runs[-1], event))
        elif isinstance(event, BoardRecalled):
            observations.append(_recall_observation(runs[:-1], event))
    return observations


def _recall_observation(earlier: Sequence[RunData], recalled: BoardRecalled) -> _BoardObservation:
    """Return an observation that the board recalled, from the newest recording that contains it; NaN if none does."""
    for run in reversed(earlier):
        if earlier_observations := find_board_averages([run], recalled.sensor, (recalled.sweep,)):
            return _average_observation(run, earlier_observations[recalled.sweep])
    return _BoardObservation(np.full(3, np.nan), np.nan, averaged=False)


def _average_observation(run: RunData, event: BoardObserved) -> _BoardObservation:
    """Return the host's mean of the samples that the board averaged; if some were lost on the way, the board's mean.

    The mean is NaN if the host has other samples than those that the board reports.
    """
    samples, observed = run.samples[event.sensor], event.observation
    times_us = samples["board_time_us"]
    used = slice(*np.searchsorted(times_us, [observed.start_us, observed.end_us]).tolist())
    missing = observed.samples - (used.stop - used.start)
    if 0 < missing <= _count_missing(samples["sequence"][max(used.start - 1, 0) : used.stop + 1]):
        return _BoardObservation(np.array(observed.mean_rad_s), event.speed_rad_s, averaged=False)
    gyroscope = run.sensors[event.sensor].channel(RATE)
    counts = gyroscope.counts(samples)[used]
    mean = counts.mean(axis=0) if missing == 0 and len(counts) else np.full(3, np.nan)
    return _BoardObservation(gyroscope.convert(mean), event.speed_rad_s, averaged=True)


def _events(run: RunData, sensor: str) -> Iterator[BoardEvent]:
    """Yield the events of the board's own calibration of a sensor, in order."""
    for recorded in run.events:
        if isinstance(recorded.event, BoardEvent) and recorded.event.sensor == sensor:
            yield recorded.event


def _count_missing(sequence: NDArray[np.uint32]) -> int:
    """Return how many numbers are missing in `sequence`, which counts modulo 2³²."""
    return int(np.sum(np.diff(sequence).astype(np.int64) - 1))


def _solve(observations: Sequence[_BoardObservation]) -> tuple[Array, Array] | None:
    """Return scale and bias by the board's method, with equal weights.

    Return None if there are too few observations, if a mean is unknown, or if the host has averaged no observation.
    """
    accumulated = Accumulator.empty()
    if not any(observation.averaged for observation in observations):
        return None
    try:
        for observation in observations:
            accumulated = accumulated.add(observation.mean_rad_s, np.ones(3), observation.speed_rad_s, weight=1.0)
        solution = accumulated.solve()
    except Fault:
        return None
    return solution.scale, solution.bias_rad_s

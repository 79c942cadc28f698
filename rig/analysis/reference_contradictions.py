"""What accelerometers and magnetometers are held against: their readings' bits and noise, their dwells, their model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis.acceleration import AccelerometerResult
from rig.analysis.magnetic_field import MagnetometerResult
from rig.analysis.pieces import Window
from rig.analysis.readings import judge_readings
from rig.analysis.reference_budgets import drift_patterns, lag_pattern
from rig.analysis.reference_consistency import Read, reference_consistency
from rig.analysis.reference_readings import (
    Dwelt,
    acceleration_dwells,
    acceleration_sweeps,
    field_dwells,
    knocked,
    resting,
)
from rig.analysis.seen import since_first_s
from rig.analysis.suspicion import Statistic
from rig.estimation.arrays import Array
from rig.estimation.felt import DELAY, LEVER, NO_SWEEPS, PARAMETERS, SECOND, Movement
from rig.observation.observed_run import ObservedRun

DISTURBED_DWELL, DISTURBED_SWEEP = "disturbed_dwell", "disturbed_sweep"


@dataclass(frozen=True, slots=True)
class ReadInReference:
    """One sensor's readings: `counts` (n, 3) of each recording, the windows and dwells cut from them, and the model.

    `pieces` name the dwells and sweeps of `read`, in its order.
    """

    counts: Sequence[NDArray[np.int64]]
    dwells: Sequence[Dwelt]
    sweeps: Sequence[Window]
    read: Read
    pieces: Sequence[str]


def of_accelerometer(name: str, recordings: Sequence[ObservedRun], result: AccelerometerResult) -> ReadInReference:
    """From all recordings of a run, in the order its solution was made from."""
    timed = list(zip(recordings, since_first_s(recordings), strict=True))
    dwells = [(dwell, since_s) for each, since_s in timed for dwell in acceleration_dwells(name, each)]
    used = {dwell.index for dwell in result.dwells}
    stood = [
        (f"{DISTURBED_DWELL}.{dwell.index}", dwell.middle_s + since_s)
        for dwell, since_s in dwells
        if dwell.index in used
    ]
    turned = [
        (f"{DISTURBED_SWEEP}.{turn.sweep}", (turn.average.start_s + turn.average.end_s) / 2 + since_s)
        for each, since_s in timed
        for turn in each.sensors[name].revolutions
        if turn.acceleration is not None
    ]
    pieces, solution, movement = [*stood, *turned], result.solution, result.movement
    settings = recordings[0].run.settings
    lag_s = 0.0 if settings.uncertainty is None else 1e-3 * settings.uncertainty.acceleration_lag_ms
    theta = _theta(solution.matrix, solution.reference_m_s2, solution.bias_m_s2)
    if solution.lever_arm_m is not None:
        theta[LEVER], theta[DELAY] = solution.lever_arm_m, solution.delay_s
    if solution.second_order_s2_m is not None:
        theta[SECOND] = solution.second_order_s2_m
    return ReadInReference(
        counts=[recording.run.samples[name]["acceleration_counts"].astype(np.int64) for recording in recordings],
        dwells=[dwell for dwell, _ in dwells],
        sweeps=[sweep for each in recordings for sweep in acceleration_sweeps(name, each)],
        read=Read(
            theta=theta,
            movement=movement,
            known=lag_pattern(movement.dwells, movement.sweeps, lag_s) / np.sqrt(3),
            times_s=np.array([time_s for _, time_s in pieces]),
            second_order=solution.second_order_s2_m is not None,
        ),
        pieces=[piece for piece, _ in pieces],
    )


def of_magnetometer(name: str, recordings: Sequence[ObservedRun], result: MagnetometerResult) -> ReadInReference:
    """The same: a magnetometer in attitudes is an accelerometer that nothing swept."""
    solution, movement = result.solution, Movement(result.seen, NO_SWEEPS)
    patterns, _ = drift_patterns(solution.matrix, result.seen.attitudes, result.drift)
    timed = zip(recordings, since_first_s(recordings), strict=True)
    dwells = [(dwell, since_s) for each, since_s in timed for dwell in field_dwells(name, each)]
    return ReadInReference(
        counts=[recording.run.samples[name]["field_counts"].astype(np.int64) for recording in recordings],
        dwells=[dwell for dwell, _ in dwells],
        sweeps=(),
        read=Read(
            theta=_theta(solution.matrix, solution.field_table_t, solution.bias_t),
            movement=movement,
            known=patterns / (np.sqrt(3) if result.drift is None else 1.0),
            times_s=np.array([dwell.middle_s + since_s for dwell, since_s in dwells]),
            second_order=False,
        ),
        pieces=[f"{DISTURBED_DWELL}.{dwell.index}" for dwell, _ in dwells],
    )


def reference_statistics(held: ReadInReference, rate: float, *, drifting: bool) -> dict[str, Statistic]:
    """Every statistic with its limit, by the name of its check; `rate` is that of false alarms for each."""
    found = reference_consistency(held.read, rate, drifting=drifting)
    named = {held.pieces[place]: statistic for place, statistic in sorted(found.disturbed.items())}
    windows = [*resting(held.dwells), *held.sweeps]
    return {
        **(named or {DISTURBED_DWELL if held.read.dwells else DISTURBED_SWEEP: found.piece}),
        **found.statistics,
        **knocked(held.dwells, rate),
        **judge_readings(held.counts, windows, rate),
    }


def _theta(matrix: Array, reference: Array, bias: Array) -> Array:
    """(22,) as `rig.estimation.felt` orders it, of what dwells tell."""
    theta = np.zeros(PARAMETERS)
    theta[: LEVER.start] = np.concatenate([matrix.ravel(), reference, bias])
    return theta

"""What accelerometers and magnetometers are held against: their readings' bits and noise, their dwells, their model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis.consistency.knocked_dwells import hold_halves_together
from rig.analysis.consistency.readings import COUNTS, Digits, digits_of, judge_readings
from rig.analysis.consistency.reference_alternatives import Read
from rig.analysis.consistency.reference_checks import reference_consistency
from rig.analysis.consistency.residual_tests import Statistic
from rig.analysis.reference.acceleration import AccelerometerResult
from rig.analysis.reference.accelerometer_errors import pieces_of
from rig.analysis.reference.arm_patterns import Known, Stood, arm_patterns
from rig.analysis.reference.magnetic_field import MagnetometerResult
from rig.analysis.reference.reference_budgets import drift_patterns, lag_pattern
from rig.data.quantity import ACCELERATION, FIELD
from rig.data.recording.settings import Uncertainty
from rig.estimation.earth import MICRO_G_M_S2
from rig.estimation.reference.accelerometer_model import LEVER, NO_SWEEPS, PARAMETERS, Movement
from rig.observation.consistency.raw_dwells import (
    RawDwell,
    raw_acceleration_dwells,
    raw_acceleration_sweeps,
    raw_field_dwells,
    rests_of_dwells,
)
from rig.observation.consistency.raw_readings import RawReadings
from rig.observation.observed_run import ObservedRun

DISTURBED_DWELL, DISTURBED_SWEEP = "disturbed_dwell", "disturbed_sweep"


@dataclass(frozen=True, slots=True)
class Place:
    """A `sweep` or a `dwell` of the plan, by index; of neither where the one that fits worst does not contradict."""

    what: str
    sweep: int | None = None
    dwell: int | None = None


def _at_dwell(index: int) -> Place:
    return Place(DISTURBED_DWELL, dwell=index)


@dataclass(frozen=True, slots=True)
class ReadInReference:
    """One sensor's readings: `counts` (n, 3) of each recording, the windows and dwells cut from them, and the model.

    `pieces` are the dwells and sweeps of `read`, in its order; `flicker_counts` is the least Allan deviation of the
    bias, by which the halves of a dwell differ beside their noise. `digits`: see `judge_readings`.
    """

    counts: Sequence[NDArray[np.int64]]
    dwells: Sequence[RawDwell]
    sweeps: Sequence[RawReadings]
    read: Read
    pieces: Sequence[Place]
    flicker_counts: float = 0.0
    digits: Digits = COUNTS


@dataclass(frozen=True, slots=True)
class ReferenceStatistics:
    """Every statistic with its limit; the size from which on it is told, by what happens.

    `pieces` are the dwells and sweeps that contradict the others, or the one that does most; `statistics` what is told
    of all of them, by the name of its check.
    """

    pieces: list[tuple[Place, Statistic]]
    statistics: dict[str, Statistic]
    told_from: dict[str, float]


def of_accelerometer(
    name: str, recordings: Sequence[ObservedRun], result: AccelerometerResult, known: Uncertainty
) -> ReadInReference:
    """What an accelerometer read in a run, in the order of its solution; `known` is of what no recording shows."""
    matrix = result.solution.matrix
    dwells = [dwell for recording in recordings for dwell in raw_acceleration_dwells(name, recording, matrix)]
    pieces = pieces_of(name, recordings, result.dwells)
    solution, movement, theta = result.solution, result.movement, result.solution.theta
    sensor, channel = result.sensor, result.sensor.channel(ACCELERATION)
    flicker_m_s2 = MICRO_G_M_S2 * known.of("acceleration_bias_instability_ug", name)
    lag = lag_pattern(movement, 1e-3 * known.acceleration_lag_ms) / np.sqrt(3)
    off_rad = solution.attitude_error.std_rad
    arm = Known(recordings[0].motion.kinematics, known.axis_deg, np.array(sensor.mounting), off_rad)
    return ReadInReference(
        digits=digits_of(sensor, ACCELERATION, [recording.run.samples[name] for recording in recordings]),
        counts=[channel.counts(recording.run.samples[name]).astype(np.int64) for recording in recordings],
        dwells=dwells,
        sweeps=[sweep for each in recordings for sweep in raw_acceleration_sweeps(name, each)],
        read=Read(
            theta=theta,
            movement=movement,
            known=np.concatenate([lag, arm_patterns(theta, movement, [each.stood for each in pieces], arm)]),
            times_s=np.array([each.window_s for each in pieces]).mean(axis=1),
            second_order=solution.second_order_s2_m is not None,
        ),
        pieces=[
            _at_dwell(each.number) if each.stood.wrist is None else Place(DISTURBED_SWEEP, sweep=each.number)
            for each in pieces
        ],
        flicker_counts=flicker_m_s2 / channel.unit_per_count,
    )


def of_magnetometer(
    name: str, recordings: Sequence[ObservedRun], result: MagnetometerResult, known: Uncertainty
) -> ReadInReference:
    """What a magnetometer read, as of an accelerometer that nothing swept."""
    solution, movement = result.solution, Movement(result.seen, NO_SWEEPS)
    channel = result.sensor.channel(FIELD)
    dwells = [dwell for recording in recordings for dwell in raw_field_dwells(name, recording)]
    theta = np.zeros(PARAMETERS)
    theta[: LEVER.start] = solution.theta
    drift, _ = drift_patterns(solution.matrix, result.seen.attitudes, result.drift)
    mounting = np.array(result.sensor.mounting)
    arm = Known(recordings[0].motion.kinematics, known.axis_deg, mounting, solution.attitude_std_rad)
    of_arm = arm_patterns(theta, movement, [Stood(each.q_rad) for each in dwells], arm)
    return ReadInReference(
        digits=digits_of(result.sensor, FIELD, [recording.run.samples[name] for recording in recordings]),
        counts=[channel.counts(recording.run.samples[name]).astype(np.int64) for recording in recordings],
        dwells=dwells,
        sweeps=(),
        read=Read(
            theta=theta,
            movement=movement,
            known=np.concatenate([drift / (np.sqrt(3) if result.drift is None else 1.0), of_arm]),
            times_s=np.array([each.middle_s + each.clock_offset_s for each in dwells]),
            second_order=False,
        ),
        pieces=[_at_dwell(each.index) for each in dwells],
    )


def reference_statistics(held: ReadInReference, rate: float, *, drifting: bool) -> ReferenceStatistics:
    """`rate` is that of false alarms for each."""
    found = reference_consistency(held.read, rate, drifting=drifting)
    named = [(held.pieces[place], statistic) for place, statistic in sorted(found.disturbed.items())]
    worst = Place(DISTURBED_DWELL if held.read.dwells else DISTURBED_SWEEP)
    windows = [*rests_of_dwells(held.dwells), *held.sweeps]
    statistics = {
        **found.statistics,
        **hold_halves_together(held.dwells, held.flicker_counts, rate, held.digits.steps),
        **judge_readings(held.counts, windows, rate, digits=held.digits),
    }
    return ReferenceStatistics(named or [(worst, found.piece)], statistics, found.told_from)

"""The checks of accelerometers and magnetometers: bits and noise of readings, halves of dwells, fit of the model."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rig.analysis.consistency.converter_tests import CONVERTER_DIGITS, Digits, find_digits, judge_readings
from rig.analysis.consistency.gyroscope_checks import DISTURBED_SWEEP
from rig.analysis.consistency.knocked_dwells import compare_dwell_halves
from rig.analysis.consistency.reference_alternatives import ReferenceModel
from rig.analysis.consistency.reference_checks import check_reference
from rig.analysis.consistency.residual_tests import Statistic
from rig.analysis.reference.arm_patterns import Posture, StatedArm, arm_patterns
from rig.analysis.reference.datasheet_errors import list_windows
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

if TYPE_CHECKING:
    from rig.analysis.reference.accelerometer import AccelerometerResult
    from rig.analysis.reference.magnetometer import MagnetometerResult

DISTURBED_DWELL = "disturbed_dwell"


@dataclass(frozen=True, slots=True)
class SegmentName:
    """The name `what` of a check of one sweep or dwell, and the plan's index of this `sweep` or `dwell`.

    Both indices are None in the name of the single check that is made if all sweeps and dwells agree.
    """

    what: str
    sweep: int | None = None
    dwell: int | None = None


def _name_dwell(index: int) -> SegmentName:
    """Return the name of the check of the dwell with this index in the plan."""
    return SegmentName(DISTURBED_DWELL, dwell=index)


@dataclass(frozen=True, slots=True)
class ReferenceReadings:
    """One sensor's readings: all `counts` (n, 3) of each recording, raw `dwells` and `sweeps`, and the fitted `model`.

    - `segments`: the names of the checks of the dwells and sweeps in `model`, in its order.
    - `flicker_counts`: the Allan deviation of the bias' flicker, which makes the halves of a dwell differ.
    - `digits`: the resolution of the counts.
    """

    counts: Sequence[NDArray[np.int64]]
    dwells: Sequence[RawDwell]
    sweeps: Sequence[RawReadings]
    model: ReferenceModel
    segments: Sequence[SegmentName]
    flicker_counts: float = 0.0
    digits: Digits = CONVERTER_DIGITS


@dataclass(frozen=True, slots=True)
class ReferenceStatistics:
    """The statistics of a sensor with their critical values, and the detection limits by fault mode.

    - `segments`: the check and statistic of each dwell or sweep that contradicts the others; if all agree, only those
      of the worst one.
    - `statistics`: all other statistics, by the check's name.
    """

    segments: list[tuple[SegmentName, Statistic]]
    statistics: dict[str, Statistic]
    detection_limits: dict[str, float]


def read_accelerometer(
    name: str, recordings: Sequence[ObservedRun], result: "AccelerometerResult", uncertainty: Uncertainty
) -> ReferenceReadings:
    """Return an accelerometer's readings in a run; the stated `uncertainty` gives the sizes of the known errors."""
    matrix = result.solution.matrix
    dwells = [dwell for recording in recordings for dwell in raw_acceleration_dwells(name, recording, matrix)]
    segments = list_windows(name, recordings, result.dwells)
    solution, movement, theta = result.solution, result.movement, result.solution.theta
    sensor, channel = result.sensor, result.sensor.channel(ACCELERATION)
    flicker_m_s2 = MICRO_G_M_S2 * uncertainty.find_stated_size("acceleration_bias_instability_ug", name)
    lag = lag_pattern(movement, 1e-3 * uncertainty.acceleration_lag_ms) / np.sqrt(3)
    delta_rad = solution.attitude_error.std_rad
    arm = StatedArm(recordings[0].motion.kinematics, uncertainty.axis_deg, np.array(sensor.mounting), delta_rad)
    return ReferenceReadings(
        digits=find_digits(sensor, ACCELERATION, [recording.run.samples[name] for recording in recordings]),
        counts=[channel.counts(recording.run.samples[name]).astype(np.int64) for recording in recordings],
        dwells=dwells,
        sweeps=[sweep for recording in recordings for sweep in raw_acceleration_sweeps(name, recording)],
        model=ReferenceModel(
            theta=theta,
            movement=movement,
            error_patterns=np.concatenate(
                [lag, arm_patterns(theta, movement, [segment.posture for segment in segments], arm)]
            ),
            times_s=np.array([segment.window_s for segment in segments]).mean(axis=1),
            second_order=solution.second_order_s2_m is not None,
        ),
        segments=[
            _name_dwell(segment.number)
            if segment.posture.wrist is None
            else SegmentName(DISTURBED_SWEEP, sweep=segment.number)
            for segment in segments
        ],
        flicker_counts=flicker_m_s2 / channel.unit_per_count,
    )


def read_magnetometer(
    name: str, recordings: Sequence[ObservedRun], result: "MagnetometerResult", uncertainty: Uncertainty
) -> ReferenceReadings:
    """Return a magnetometer's readings in the dwells of a run; readings in sweeps are not used."""
    solution, movement = result.solution, Movement(result.measurements, NO_SWEEPS)
    channel = result.sensor.channel(FIELD)
    dwells = [dwell for recording in recordings for dwell in raw_field_dwells(name, recording)]
    theta = np.zeros(PARAMETERS)
    theta[: LEVER.start] = solution.theta
    drift, _ = drift_patterns(solution.matrix, result.measurements.attitudes, result.drift)
    mounting = np.array(result.sensor.mounting)
    arm = StatedArm(recordings[0].motion.kinematics, uncertainty.axis_deg, mounting, solution.attitude_std_rad)
    patterns_of_arm = arm_patterns(theta, movement, [Posture(dwell.q_rad) for dwell in dwells], arm)
    return ReferenceReadings(
        digits=find_digits(result.sensor, FIELD, [recording.run.samples[name] for recording in recordings]),
        counts=[channel.counts(recording.run.samples[name]).astype(np.int64) for recording in recordings],
        dwells=dwells,
        sweeps=(),
        model=ReferenceModel(
            theta=theta,
            movement=movement,
            error_patterns=np.concatenate([drift / (np.sqrt(3) if result.drift is None else 1.0), patterns_of_arm]),
            times_s=np.array([dwell.middle_s + dwell.clock_offset_s for dwell in dwells]),
            second_order=False,
        ),
        segments=[_name_dwell(dwell.index) for dwell in dwells],
    )


def compute_reference_statistics(
    readings: ReferenceReadings, false_alarm_probability: float, *, drifting: bool
) -> ReferenceStatistics:
    """Return the statistics of a sensor's readings, each with the given false-alarm probability."""
    tested = check_reference(readings.model, false_alarm_probability, drifting=drifting)
    disturbed = [(readings.segments[index], statistic) for index, statistic in sorted(tested.disturbed.items())]
    worst = SegmentName(DISTURBED_DWELL if readings.model.dwells else DISTURBED_SWEEP)
    windows = [*rests_of_dwells(readings.dwells), *readings.sweeps]
    statistics = {
        **tested.statistics,
        **compare_dwell_halves(
            readings.dwells, readings.flicker_counts, false_alarm_probability, readings.digits.steps
        ),
        **judge_readings(readings.counts, windows, false_alarm_probability, digits=readings.digits),
    }
    return ReferenceStatistics(disturbed or [(worst, tested.worst)], statistics, tested.detection_limits)

"""The verification of calibrated readings by a reference sensor, as in the paper SIX, Section IV-B, Tables IV and V.

Only the rotation between the two sensors is removed, as determined in the calibration's revolutions. The
non-orthogonality that the board's correction leaves, and the cross-axis errors of both sensors, remain.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.analysis.gyroscope.alignment import LinearCalibration, RelativeRotation, collect_mean_rates, fit_rotation
from rig.analysis.gyroscope.comparison import Comparison, Reference, compare, list_revolutions
from rig.data.recording.run_data import RunData
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.finished_steps import complete_sweeps
from rig.observation.observed_run import ObservedRun


@dataclass(frozen=True, slots=True)
class Verification:
    """The comparison of a sensor's readings with a reference, without and with the calibration.

    - `reference_error_rad_s`: the largest error of the magnitude of the reference's mean rate in a revolution or rest;
      the arm shows the true rate.
    - `rotation`: the rotation from the reference's frame into the sensor's.
    - `before`: the comparison of uncalibrated readings, None if not recorded; `after`: that of calibrated readings.
    """

    sensor: str
    reference: Reference
    reference_error_rad_s: float
    rotation: RelativeRotation
    before: Comparison | None
    after: Comparison


def verify(
    sensor: str,
    reference: Reference,
    after: Sequence[ObservedRun],
    before: Sequence[ObservedRun] = (),
    calibration: LinearCalibration | None = None,
    *,
    gravity_rad_s: tuple[Array, Array] | None = None,
) -> Verification:
    """Return the comparison of the readings that the board has calibrated (`after`) with those of the reference.

    - `before`: the recordings of raw readings from which the `calibration` was estimated. They determine the rotation
      between the sensors; without them, `after` does.
    - `gravity_rad_s`: the effects (N, 3) of gravity on the corrected readings of the sensor and on those of the
      reference in the revolutions of `after`, None if not estimated.

    Raise Fault `sensor_missing`, `wrong_mode`, `nothing_to_compare`, `incomplete_verification`, `no_overlap`,
    `different_clocks`, and what `fit_rotation` raises.
    """
    if not after:
        raise Fault("nothing_to_compare", "no sweep was finished in the recording", "Let the whole movement finish")
    for recordings, readings in ((after, "calibrated"), (before, "raw")):
        for recording in recordings:
            _check_recorded(recording.run, sensor, readings)
            _check_recorded(recording.run, reference.name, "raw")
    _check_complete([recording.run for recording in after])
    rotation = fit_mounting(sensor, reference, before or after, calibration if before else None)
    return Verification(
        sensor,
        reference,
        _find_reference_error(after, reference),
        rotation,
        compare(before, sensor, reference, rotation.matrix) if before else None,
        compare(after, sensor, reference, rotation.matrix, _gravity_difference(gravity_rad_s, rotation.matrix)),
    )


def _gravity_difference(gravity_rad_s: tuple[Array, Array] | None, rotation: Array) -> Array | None:
    """Return gravity's effect (N, 3) on the difference of sensor and reference; None if it was not estimated."""
    if gravity_rad_s is None:
        return None
    on_sensor, on_reference = gravity_rad_s
    difference: Array = on_sensor - on_reference @ rotation.T
    return difference


def fit_mounting(
    sensor: str, reference: Reference, recordings: Sequence[ObservedRun], calibration: LinearCalibration | None
) -> RelativeRotation:
    """Return the rotation from reference to sensor, fitted to the revolutions of the recordings.

    `calibration` corrects the sensor's readings; it is None if the board has corrected them already. Raise Fault as
    `fit_rotation` does.
    """
    described = recordings[0].run.sensors
    return fit_rotation(
        collect_mean_rates(list_revolutions(sensor, recordings), calibration),
        collect_mean_rates(list_revolutions(reference.name, recordings), reference),
        np.array(described[sensor].mounting) @ np.array(described[reference.name].mounting).T,
    )


def _check_complete(runs: Sequence[RunData]) -> None:
    """Raise Fault `incomplete_verification` unless all planned sweeps were finished."""
    planned = len(runs[0].settings.planned_sweeps)
    done = len(frozenset[int]().union(*map(complete_sweeps, runs)))
    if done < planned:
        raise Fault(
            "incomplete_verification",
            f"{done} of {planned} sweeps were finished while the readings were calibrated",
            "Go on with `rig resume RUN_DIR`, or run the verification again",
        )


def _find_reference_error(recordings: Sequence[ObservedRun], reference: Reference) -> float:
    """Return the largest difference, rad/s, between the magnitudes of the reference's and the arm's rates."""
    turns = list_revolutions(reference.name, recordings)
    rates_rad_s = np.linalg.norm(collect_mean_rates(turns, reference).rate_rad_s, axis=1)
    in_sweeps = rates_rad_s - [turn.speed_rad_s for turn in turns]
    means = [rest.mean_rad_s for recording in recordings for rest in recording.sensors[reference.name].rests]
    at_rest = np.linalg.norm(reference.scale * (np.reshape(means, (-1, 3)) + reference.bias_rad_s), axis=1)
    return float(np.abs([*in_sweeps, *at_rest]).max())


def _check_recorded(run: RunData, sensor: str, mode: str) -> None:
    """Raise Fault `sensor_missing` or `wrong_mode` unless the run has the sensor's readings in this mode."""
    if sensor not in run.sensors:
        raise Fault(
            "sensor_missing", f"the recording contains nothing of {sensor}", "Name it under sensors and run again"
        )
    if run.sensors[sensor].mode != mode:
        raise Fault(
            "wrong_mode",
            f"{sensor} was recorded in {run.sensors[sensor].mode} mode where {mode} readings are needed",
            "Give the recordings of a calibration and of its verification",
        )

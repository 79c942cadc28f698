"""Calibrated readings against a sensor that is known: SIX, Section IV-B, Tables IV and V.

How the two sensors sit to each other comes from the calibration's revolutions, so that the verification stays a test of
them. Only a rotation is taken out: what the board's correction leaves of axes that are not at right angles, and
cross-axis errors of either part, stay in.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.analysis.gyroscope.alignment import AlignedCalibration, RelativeRotation, mean_rates, relative_rotation
from rig.analysis.gyroscope.comparison import Comparison, Reference, compare, turns_of
from rig.data.recording.run_file import RunData
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.finished import finished_sweeps
from rig.observation.observed_run import ObservedRun


@dataclass(frozen=True, slots=True)
class Verification:
    """The sensor before its calibration (None where that was not recorded) and with it, by one relative rotation.

    `reference_error_rad_s` is the largest by which the reference itself misses the arm: the magnitude of its mean rate
    over a revolution against 2π/T, and over a rest against zero.
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
    calibration: AlignedCalibration | None = None,
    *,
    gravity_rad_s: tuple[Array, Array] | None = None,
) -> Verification:
    """Judge the readings that the board has calibrated (`after`) by the reference beside it.

    `before` are the recordings of raw readings that the `calibration` was made from; they tell how the two sensors sit
    to each other. Without them `after` itself tells it. `gravity_rad_s` (N, 3) is what gravity adds to the corrected
    readings of sensor and reference in the revolutions of `after`, where the calibration found it.

    Raises Fault `sensor_missing`, `wrong_mode`, `nothing_to_compare`, `incomplete_verification`, `no_overlap`,
    `different_clocks`, and as `relative_rotation` does.
    """
    if not after:
        raise Fault("nothing_to_compare", "no sweep was finished in the recording", "Let the whole movement finish")
    for recordings, readings in ((after, "calibrated"), (before, "raw")):
        for recording in recordings:
            _check_recorded(recording.run, sensor, readings)
            _check_recorded(recording.run, reference.name, "raw")
    _check_complete([recording.run for recording in after])
    rotation = relative_mounting(sensor, reference, before or after, calibration if before else None)
    return Verification(
        sensor,
        reference,
        _against_the_arm(after, reference),
        rotation,
        compare(before, sensor, reference, rotation.matrix) if before else None,
        compare(after, sensor, reference, rotation.matrix, _apart(gravity_rad_s, rotation.matrix)),
    )


def _apart(gravity_rad_s: tuple[Array, Array] | None, rotation: Array) -> Array | None:
    """(N, 3) how far gravity takes the sensor's readings from the reference's."""
    if gravity_rad_s is None:
        return None
    of_sensor, of_reference = gravity_rad_s
    apart: Array = of_sensor - of_reference @ rotation.T
    return apart


def relative_mounting(
    sensor: str, reference: Reference, recordings: Sequence[ObservedRun], calibration: AlignedCalibration | None
) -> RelativeRotation:
    """How a sensor sits to the reference, by the revolutions of these recordings; None is for calibrated readings.

    Raises Fault as `relative_rotation` does.
    """
    described = recordings[0].run.sensors
    return relative_rotation(
        mean_rates(turns_of(sensor, recordings), calibration),
        mean_rates(turns_of(reference.name, recordings), reference),
        np.array(described[sensor].mounting) @ np.array(described[reference.name].mounting).T,
    )


def _check_complete(runs: Sequence[RunData]) -> None:
    """A movement that was broken off has not verified the directions it never turned in."""
    planned = len(runs[0].settings.planned_sweeps)
    done = len(frozenset[int]().union(*map(finished_sweeps, runs)))
    if done < planned:
        raise Fault(
            "incomplete_verification",
            f"{done} of {planned} sweeps were finished while the readings were calibrated",
            "Go on with `rig resume RUN_DIR`, or run the verification again",
        )


def _against_the_arm(recordings: Sequence[ObservedRun], reference: Reference) -> float:
    """How far the reference is off at most, by what the arm did; magnitudes, for its mounting does not matter here."""
    turns = turns_of(reference.name, recordings)
    of_turns = np.linalg.norm(mean_rates(turns, reference).rate_rad_s, axis=1) - [turn.speed_rad_s for turn in turns]
    means = [rest.mean_rad_s for seen in recordings for rest in seen.sensors[reference.name].rests]
    of_rests = np.linalg.norm(reference.scale * (np.reshape(means, (-1, 3)) + reference.bias_rad_s), axis=1)
    return float(np.abs([*of_turns, *of_rests]).max())


def _check_recorded(run: RunData, sensor: str, mode: str) -> None:
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

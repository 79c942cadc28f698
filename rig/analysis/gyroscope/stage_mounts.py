"""The mount of the item in each stage of a run: estimated from the sweeps, then kept fixed.

All sensors are on one item. The first stage defines the frame: its mount counts as exact, and its error is part of the
sensors' own mountings, as with an item that is mounted once.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.analysis.environment import find_environment
from rig.analysis.gyroscope.calibration import observe_recordings
from rig.analysis.gyroscope.vector_inputs import collect_inputs
from rig.config.procedures.stage_section import rotation_by
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import RunSettings
from rig.errors.attempts import attempt_each
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_fit import VectorFit, explain
from rig.observation.observed_run import ObservedRun


@dataclass(frozen=True, slots=True)
class EstimatedMount:
    """The mount of the item in a `stage`, counted from 0.

    - `rotation_rad` (3,): the rotation from the nominal mount to this one, as a rotation vector in the item's axes.
    - `std_rad` (3,): its standard deviations, which are the stated ones if sweeps do not determine it.
    """

    stage: int
    rotation_rad: Array
    std_rad: Array

    @property
    def rotation(self) -> Array:
        """The matrix (3, 3) from components in the nominal frame to components in the item's frame."""
        return rotation_by(-self.rotation_rad)


def observe_as_mounted(
    runs: Sequence[RunData], settings: RunSettings
) -> tuple[tuple[ObservedRun, ...], tuple[EstimatedMount, ...]]:
    """Return the observations of one calibration, computed with the item's estimated mounts, and these mounts.

    Errors of second order remain, which the solution of each sensor estimates. Raise as `observe_recordings` does.
    """
    recordings = observe_recordings(runs)
    mounts = _estimate_mounts(recordings, settings)
    if not mounts:
        return recordings, ()
    rotations: Mapping[int, Array] = {mount.stage: mount.rotation for mount in mounts}
    return observe_recordings(runs, rotations), mounts


def _estimate_mounts(recordings: Sequence[ObservedRun], settings: RunSettings) -> tuple[EstimatedMount, ...]:
    """Return the mounts of all stages except the first, from the sensor that shows mounts best; empty if none does."""
    stages = list(dict.fromkeys(recording.run.settings.stage for recording in recordings))
    if len(stages) < 2:
        return ()
    environment, run = find_environment(recordings, settings), recordings[0].run
    attempts = {
        name: partial(explain, collect_inputs(recordings, name, environment), np.array(run.sensors[name].mounting))
        for name in settings.to_calibrate
    }
    fits = list(attempt_each(attempts).results.values())
    if not fits:
        return ()
    best = min(fits, key=lambda fit: float(np.trace(fit.mounts_covariance)))
    std_rad = float(np.radians(environment.uncertainty.mount_deg)) / np.sqrt(3)
    return tuple(
        EstimatedMount(stage, *(std_rad * part for part in _rotation_in_stage(best, index)))
        for index, stage in enumerate(stages[1:])
    )


def _rotation_in_stage(fit: VectorFit, index: int) -> tuple[Array, Array]:
    """Return the item's rotation (3,) in a stage relative to the first, and its standard deviations.

    Both are in units of the stated standard deviation of a mount.
    """
    size = len(fit.mounts)  # three for each later stage, and last the first stage's three
    pick = np.zeros((3, size))
    pick[:, 3 * index : 3 * index + 3] = np.eye(3)
    pick[:, size - 3 :] = -np.eye(3)
    covariance = pick @ fit.mounts_covariance @ pick.T
    # The fitted mounts are rotations of the sensed rates, which turn opposite to the item.
    return -pick @ fit.mounts, np.sqrt(np.diag(covariance))

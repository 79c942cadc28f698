"""How the item sat in each stage of a run, beside how it was to be mounted: found from the sweeps, then taken as known.

All sensors sit on one item. The frame of the item is that of the first stage, whose mount counts as exact: what it is
off by, the sensors' own mountings hold, as they do of an item that is mounted once.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.analysis.gyroscope.vector_inputs import see
from rig.analysis.surroundings import surroundings_of
from rig.config.procedures.stage_section import rotation_by
from rig.data.recording.run_file import RunData
from rig.data.recording.settings import RunSettings
from rig.errors.attempts import attempt_each
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_fit import Explained, explain
from rig.observation.observed_run import ObservedRun


@dataclass(frozen=True, slots=True)
class FoundMount:
    """How the item sat in a `stage`, counted from 0, beside its nominal mount.

    `turn_rad` (3,) is the rotation vector, in the item's own axes, by which it is turned from where it was to sit;
    `std_rad` (3,) are the standard deviations of its components, as large as before where the sweeps do not tell them.
    """

    stage: int
    turn_rad: Array
    std_rad: Array

    @property
    def rotation(self) -> Array:
        """(3, 3) what takes components in the nominal frame to those in the item's."""
        return rotation_by(-self.turn_rad)


def observe_as_mounted(
    runs: Sequence[RunData], settings: RunSettings
) -> tuple[tuple[ObservedRun, ...], tuple[FoundMount, ...]]:
    """All recordings of one calibration with the item as it was found to sit, and the mounts that were found.

    What is left of a mount's error, which is as small as the second order of it, each sensor's solution still finds.
    Raises as `observe_recordings` does.
    """
    recordings = observe_recordings(runs)
    found = _found(recordings, settings)
    if not found:
        return recordings, ()
    turned: Mapping[int, Array] = {each.stage: each.rotation for each in found}
    return observe_recordings(runs, turned), found


def _found(recordings: Sequence[ObservedRun], settings: RunSettings) -> tuple[FoundMount, ...]:
    """The mounts of all stages but the first, by the sensor to calibrate that tells them best; none where none does."""
    stages = list(dict.fromkeys(recording.run.settings.stage for recording in recordings))
    if len(stages) < 2:
        return ()
    surroundings, run = surroundings_of(recordings, settings), recordings[0].run
    attempts = {
        name: partial(explain, see(recordings, name, surroundings), np.array(run.sensors[name].mounting))
        for name in settings.to_calibrate
    }
    explained = list(attempt_each(attempts).results.values())
    if not explained:
        return ()
    best = min(explained, key=lambda each: float(np.trace(each.mounts_covariance)))
    std_rad = float(np.radians(surroundings.uncertainty.mount_deg)) / np.sqrt(3)
    return tuple(
        FoundMount(stage, *(std_rad * part for part in _of_stage(best, place)))
        for place, stage in enumerate(stages[1:])
    )


def _of_stage(explained: Explained, place: int) -> tuple[Array, Array]:
    """The item's turn (3,) in a stage against the first, and its standard deviations, in those of before.

    Where the item is turned one way, all turns that it feels are turned the other way.
    """
    count = len(explained.mounts)
    pick = np.zeros((3, count))
    pick[:, 3 * place : 3 * place + 3] = np.eye(3)
    pick[:, count - 3 :] = -np.eye(3)
    covariance = pick @ explained.mounts_covariance @ pick.T
    return -pick @ explained.mounts, np.sqrt(np.diag(covariance))

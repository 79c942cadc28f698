"""Masks of the samples in each part of a recorded movement. Pure functions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.observation.arm_rests import REST_SETTLING_S
from rig.observation.windows import Window, iterate_rests, swept


@dataclass(frozen=True, slots=True)
class MovementMasks:
    """Masks (n,) of samples.

    - moving: from the start of the first sweep to the end of the last sweep or rest.
    - sweeping: in any sweep; resting: in any rest.
    - still: a mask for each rest, of the samples in its middle.
    """

    moving: NDArray[np.bool_]
    sweeping: NDArray[np.bool_]
    resting: NDArray[np.bool_]
    still: tuple[NDArray[np.bool_], ...]


def mask_movement(run: RunData, time_s: Array) -> MovementMasks:
    """Return the masks of samples at controller times (n,), for a recording with at least one finished sweep."""
    sweeps, rests = [finished.window for finished in swept(run)], list(iterate_rests(run))
    return MovementMasks(
        moving=_mask_windows(time_s, Window(sweeps[0].start_s, max(window.end_s for window in [*sweeps, *rests]))),
        sweeping=_mask_windows(time_s, *sweeps),
        resting=_mask_windows(time_s, *rests),
        still=tuple(
            _mask_windows(time_s, Window(rest.start_s + REST_SETTLING_S, rest.end_s - REST_SETTLING_S))
            for rest in rests
        ),
    )


def _mask_windows(time_s: Array, *windows: Window) -> NDArray[np.bool_]:
    """Return a mask of the times (n,) that lie in any of the windows."""
    inside = np.zeros(len(time_s), dtype=np.bool_)
    for window in windows:
        inside |= (time_s >= window.start_s) & (time_s <= window.end_s)
    return inside

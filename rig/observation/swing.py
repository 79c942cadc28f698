"""A standing arm that swings about where it stands, as the angles of its joints tell it."""

import numpy as np

from rig.estimation.arrays import Array

MAX_TRAVEL_AT_REST_RAD = 1e-3  # of any joint, while it stands
# Cycles in a window. A slower swing cannot be told from a joint that creeps, of which this one leaves half.
SLOWEST, FASTEST, STEP = 0.75, 12.0, 0.05
FEWEST_OF_SWING = 8  # angles, of which three are the swing's in each joint


def without_swing(q_rad: Array) -> Array:
    """Return angles (n, k) of joints, evenly spaced, without the one sine about a mean that explains most of them.

    All joints swing at one frequency, each by its own amplitude and phase: least squares over a grid of frequencies
    (Lomb's periodogram with a floating mean). A step stays, and so does what creeps.
    """
    share = np.arange(len(q_rad)) / len(q_rad)
    fastest = min(FASTEST, len(q_rad) / 4)
    left = [_beside(cycles, share, q_rad) for cycles in np.arange(SLOWEST, fastest, STEP)]
    return min(left, key=lambda each: float(np.sum(each**2)), default=q_rad)


def _beside(cycles: float, share: Array, q_rad: Array) -> Array:
    phase = 2 * np.pi * cycles * share
    columns = np.column_stack([np.ones(len(share)), np.cos(phase), np.sin(phase)])
    left: Array = q_rad - columns @ np.linalg.lstsq(columns, q_rad, rcond=None)[0]
    return left

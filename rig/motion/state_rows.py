"""The NumPy types of the rows in which a turner's states are recorded."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from rig.motion.turner_state import JOINT_NAMES

Scalar = Literal["f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8"]  # NumPy's names of types


@dataclass(frozen=True, slots=True)
class StateField:
    """A field of a turner's states other than times and joints: its name, which contains the unit, and its type."""

    name: str
    type: Scalar


def state_dtype(joints: int, more: Sequence[StateField] = ()) -> np.dtype[Any]:
    """Return the type of the rows of states, for a number of joints and `more` fields.

    Without joints there are no columns for them, because HDF5 has no arrays of length 0.
    """
    angles = [(name, "<f8", (joints,)) for name in ("q_rad", "qd_rad_s")] if joints else []
    others = [(field.name, f"<{field.type}" if field.type[1] != "1" else field.type) for field in more]
    return np.dtype([("time_s", "<f8"), ("host_time_s", "<f8"), *angles, *others])


ARM_FIELDS = (
    StateField("target_speed_fraction", "f8"),
    StateField("speed_scaling", "f8"),
    StateField("robot_mode", "i4"),
    StateField("safety_mode", "i4"),
    StateField("runtime_state", "i4"),
    StateField("robot_status_bits", "u4"),
    StateField("safety_status_bits", "u4"),
)
ARM_STATE_DTYPE = state_dtype(len(JOINT_NAMES), ARM_FIELDS)

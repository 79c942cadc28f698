"""The effect of the arm's errors, which all readings share, on readings in attitudes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.gyroscope.vector_inputs import WAVE_RATIO
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import (
    OWN_ERRORS,
    ROTATIONS,
    SHARED_ERRORS,
    SIZE_RATIO,
    Movement,
    arm_effects,
)
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import WRIST_1, angle_waves, flange_attitude, flange_errors

WRIST_ERRORS, CONSTANTS = 6, 2  # the first two are a wrist's twist and zero, the others waves of its angle


@dataclass(frozen=True, slots=True)
class Posture:
    """The arm's joint angles (6,) in a dwell or at a sweep's start; `wrist` (0 to 2): the one that the sweep turns."""

    q_rad: Array
    wrist: int | None = None


@dataclass(frozen=True, slots=True)
class StatedArm:
    """The arm as stated, and the size of its errors.

    - `arm`: the kinematics; `axis_deg`: the stated half-width of the errors of its angles.
    - `mounting` (3, 3): the nominal mounting of the sensor on the flange.
    - `estimated_rad`: the standard deviation of the wrist joints' angle errors, estimated from the readings. If it is
      larger than the standard deviation that `axis_deg` means, it is used instead.
    """

    arm: DenavitHartenberg
    axis_deg: float
    mounting: Array
    estimated_rad: float


def arm_patterns(theta: Array, movement: Movement, postures: Sequence[Posture], stated: StatedArm) -> Array:
    """Return the changes (18, 3 K) of K vector readings by one standard uncertainty of each of 18 errors of wrists."""
    by_turns = arm_effects(theta, replace(movement, sweeps=movement.sweeps.alone()))
    stated_rad = np.radians(stated.axis_deg) / np.sqrt(3) * _error_fractions()
    std_rad = np.maximum(stated_rad, stated.estimated_rad)
    patterns: Array = std_rad[:, None] * (_stack_rotations(postures, stated.arm, stated.mounting) @ by_turns.T)
    return patterns


def list_arm_rotations(postures: Sequence[Posture], arm: DenavitHartenberg, mounting: Array) -> Array:
    """Return `Movement.arm_turns` (18, 3 N + 10 M): the body's rotations in N dwells and M sweeps by 18 errors.

    The errors are twists and zero offsets of the wrist joints, each with a standard deviation of 1 rad.
    """
    rotations: Array = _error_fractions()[:, None] * _stack_rotations(postures, arm, mounting)
    return rotations


def _error_fractions() -> Array:
    """Return the sizes (18,) of the six errors of each of three wrists, as fractions of the arm's stated error."""
    return np.tile(np.where(np.arange(WRIST_ERRORS) < CONSTANTS, 1.0, WAVE_RATIO), 3)


def _stack_rotations(postures: Sequence[Posture], arm: DenavitHartenberg, mounting: Array) -> Array:
    return np.concatenate([_rotations(posture, arm, mounting) for posture in postures], axis=1)


def _rotations(posture: Posture, arm: DenavitHartenberg, mounting: Array) -> Array:
    """Return the part of `Movement.arm_turns` for a dwell (18, 3) or a sweep (18, 10), per radian of each error."""
    in_base = flange_errors(posture.q_rad, arm)
    in_flange = in_base @ (mounting @ flange_attitude(posture.q_rad, arm)).T
    if posture.wrist is None:
        return in_flange.reshape(-1, OWN_ERRORS)
    # An error between base and turning wrist rotates the whole sweep in the base; an error beyond that wrist rotates it
    # in the flange's frame. Waves of the turning wrist's own angle are errors of the angle swept.
    sizes = np.zeros((*in_base.shape[:2], SHARED_ERRORS))
    for wrist in range(len(in_base)):
        distal = wrist > posture.wrist
        sizes[wrist, :, slice(0, 3) if distal else slice(3, ROTATIONS)] = in_flange[wrist] if distal else in_base[wrist]
    sizes[posture.wrist, 0, :ROTATIONS] = [
        *in_flange[posture.wrist, 0],
        0.0,
        0.0,
        0.0,
    ]  # the twist is distal to its joint
    sizes[posture.wrist, CONSTANTS:] = 0.0
    sizes[posture.wrist, CONSTANTS:, ROTATIONS:] = _shift_harmonics(float(posture.q_rad[WRIST_1 + posture.wrist]))
    return np.asarray(sizes.reshape(-1, SHARED_ERRORS) / SIZE_RATIO)


def _shift_harmonics(angle_rad: float) -> Array:
    """Return the matrix (4, 4) that takes the coefficients of two harmonics of θ − `angle_rad` to those of θ."""
    cos, sin, cos_2, sin_2 = angle_waves(angle_rad)
    waves: Array = np.zeros((4, 4))
    waves[:2, :2] = [[cos, -sin], [sin, cos]]
    waves[2:, 2:] = [[cos_2, -sin_2], [sin_2, cos_2]]
    return waves

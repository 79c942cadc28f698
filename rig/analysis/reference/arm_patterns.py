"""What an arm that is not quite where it says does to readings in attitudes: a few errors, shared by all of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.gyroscope.vector_inputs import WAVE_FRACTION
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import OWN_ERRORS, SHARE, SHARED_ERRORS, TURNS, Movement, turned
from rig.motion.geometry import WRIST_1, DenavitHartenberg, angle_waves, flange_attitude, flange_errors

ERRORS, STEADY = 6, 2  # of each wrist; of these, its twist and its zero; the others are waves of its angle


@dataclass(frozen=True, slots=True)
class Stood:
    """The arm's angles (6,) in a dwell, or where a sweep's are counted from; which wrist it turns (0 to 2), if any."""

    q_rad: Array
    wrist: int | None = None


@dataclass(frozen=True, slots=True)
class Known:
    """The arm as it says it is, by how much its angles may be off either way, the sensor's nominal mounting (3, 3).

    `found_rad` is how far off the readings say it is, a standard deviation: it may be a poorer arm than was stated.
    """

    arm: DenavitHartenberg
    axis_deg: float
    mounting: Array
    found_rad: float


def arm_patterns(theta: Array, movement: Movement, stood: Sequence[Stood], known: Known) -> Array:
    """(18, 3 K) change of the readings by one standard uncertainty of each of the wrists' errors."""
    by_turns = turned(theta, replace(movement, sweeps=movement.sweeps.alone()))
    stated_rad = np.radians(known.axis_deg) / np.sqrt(3) * _shares()
    std_rad = np.maximum(stated_rad, known.found_rad)
    patterns: Array = std_rad[:, None] * (_all_turns(stood, known.arm, known.mounting) @ by_turns.T)
    return patterns


def arm_turns(stood: Sequence[Stood], arm: DenavitHartenberg, mounting: Array) -> Array:
    """(18, 3 N + 10 M) `arm_turns` of a `Movement`, for an arm that is off by δ = 1."""
    turns: Array = _shares()[:, None] * _all_turns(stood, arm, mounting)
    return turns


def _shares() -> Array:
    """(18,) what an error of the arm's takes of each of its wrists' errors."""
    return np.tile(np.where(np.arange(ERRORS) < STEADY, 1.0, WAVE_FRACTION), 3)


def _all_turns(stood: Sequence[Stood], arm: DenavitHartenberg, mounting: Array) -> Array:
    return np.concatenate([_turns(each, arm, mounting) for each in stood], axis=1)


def _turns(stood: Stood, arm: DenavitHartenberg, mounting: Array) -> Array:
    """(18, 3 or 10) sizes of the errors that `effects` knows of a dwell or a sweep, by radian of each wrist's."""
    in_base = flange_errors(stood.q_rad, arm)
    in_flange = in_base @ (mounting @ flange_attitude(stood.q_rad, arm)).T
    if stood.wrist is None:
        return in_flange.reshape(-1, OWN_ERRORS)
    found = np.zeros((*in_base.shape[:2], SHARED_ERRORS))
    for wrist in range(len(in_base)):
        beyond = wrist > stood.wrist
        found[wrist, :, slice(0, 3) if beyond else slice(3, TURNS)] = in_flange[wrist] if beyond else in_base[wrist]
    found[stood.wrist, 0, :TURNS] = [*in_flange[stood.wrist, 0], 0.0, 0.0, 0.0]  # the twist lies beyond its joint
    found[stood.wrist, STEADY:] = 0.0
    found[stood.wrist, STEADY:, TURNS:] = _counted_from(float(stood.q_rad[WRIST_1 + stood.wrist]))
    return found.reshape(-1, SHARED_ERRORS) / SHARE


def _counted_from(angle_rad: float) -> Array:
    """(4, 4) waves of an angle by those of what it has grown from here."""
    cos, sin, cos_2, sin_2 = angle_waves(angle_rad)
    found: Array = np.zeros((4, 4))
    found[:2, :2] = [[cos, -sin], [sin, cos]]
    found[2:, 2:] = [[cos_2, -sin_2], [sin_2, cos_2]]
    return found

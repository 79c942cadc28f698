"""Whether the item sits as a stage says: looked at by its own sensors, before a sweep turns it. Pure.

A hand that is still at it, a board the wrong way round, an instruction that was not followed: each is found while
nothing has moved, or by a turn that is too small to pull at a cable.
"""

from dataclasses import dataclass
from math import degrees
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.by_hand.session import nearest_face
from rig.motion.steps import Stage

REST_S = 1.0  # of readings that show whether it is at rest
PARTS = 5
STEADY_RAD_S = 0.02  # what a hand at the item exceeds, and nothing that stands; on top of the noise
NOISES = 6
ASKEW_RAD = np.radians(20)  # as far as a sensor may sit off its mounting and the item off the stage's
SHARES = 0.5, 2.0  # of the turn, that a sensor with a scale error reads


@dataclass(frozen=True, slots=True)
class Felt:
    """What one sensor, by its `name`, read in some time: samples (n,), raw."""

    name: str
    sensor: RecordedSensor
    samples: NDArray[Any]

    @property
    def rates_rad_s(self) -> Array:
        """The rates (n, 3) in the sensor's axes."""
        return self.sensor.channel(RATE).values(self.samples)

    @property
    def mounting(self) -> Array:
        """The rotation (3, 3) from the item's frame to the sensor's."""
        return np.array(self.sensor.mounting)


def refuse_unsteady(felt: Felt, turner: str) -> None:
    """Raise Refused `item_not_at_rest` where a gyroscope's readings change more than noise does.

    `turner` is what an operator calls what turns the item.
    """
    rates = felt.rates_rad_s
    means = np.array([part.mean(axis=0) for part in np.array_split(rates, PARTS)])
    noise = np.diff(rates, axis=0).std(axis=0) / np.sqrt(2 * len(rates) / PARTS)
    moved = np.ptp(means, axis=0)
    if np.any(moved > STEADY_RAD_S + NOISES * noise):
        raise Refused(
            "item_not_at_rest",
            f"{felt.name} reads rates that change by {degrees(moved.max()):.1f} °/s while the {turner} stands still",
            "Take your hands off the item and its cable, wait until nothing swings, then continue",
        )


def refuse_hanging_otherwise(felt: Felt, stage: Stage, up_flange: Array) -> None:
    """Raise Refused `mounted_otherwise` where an accelerometer does not feel what is up (3,), in the flange's frame.

    Of a sensor that measures no acceleration nothing is said.
    """
    if not felt.sensor.measures(ACCELERATION):
        return
    force = felt.sensor.channel(ACCELERATION).values(felt.samples).mean(axis=0)
    stated = np.array(stage.mount) @ up_flange
    found = felt.mounting.T @ force
    if _apart(found, stated) > ASKEW_RAD:
        raise Refused(
            "mounted_otherwise",
            f"by the accelerometer of {felt.name} the item's {nearest_face(found)} axis points up, "
            f"by the stage's mounting its {nearest_face(stated)} axis",
            remedy(stage),
        )


def refuse_turning_otherwise(felt: Felt, resting_rad_s: Array, stage: Stage, turn_flange_rad: Array, what: str) -> None:
    """Raise Fault `mounted_otherwise` where a small turn (3,), in the flange's frame, is felt otherwise.

    `resting_rad_s` (3,) is what the gyroscope reads at rest; its readings begin before the turn and end after it.
    """
    turned = (felt.rates_rad_s - resting_rad_s).sum(axis=0) / felt.sensor.rate_hz
    stated = np.array(stage.mount) @ turn_flange_rad
    found = felt.mounting.T @ turned
    share = float(np.linalg.norm(found) / np.linalg.norm(stated))
    said = f"in the {what} {felt.name} is turned about the item's {nearest_face(stated)} axis by the stage's mounting"
    if not SHARES[0] < share < SHARES[1]:
        how = f"but reads {degrees(np.linalg.norm(found)):.1f}° of {degrees(np.linalg.norm(stated)):.1f}°"
    elif _apart(found, stated) > ASKEW_RAD:
        how = f"but reads a turn about its {nearest_face(found)} axis"
    else:
        return
    raise Fault("mounted_otherwise", f"{said}, {how}", remedy(stage))


def remedy(stage: Stage) -> str:
    """What to do about an item that is mounted otherwise than its stage says."""
    return f'Mount the item as the stage says ("{stage.instruction}"), or correct its mount in procedure.stages'


def _apart(one: Array, other: Array) -> float:
    cosine = float(one @ other / (np.linalg.norm(one) * np.linalg.norm(other)))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))

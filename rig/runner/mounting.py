"""Tests of the item's mounting in a stage by its own sensors, before a sweep turns it. Pure.

A hand that still holds the item, a reversed board, or a disregarded instruction shows at rest, or in a turn too small
to pull at a cable.
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
from rig.estimation.by_hand.session_parts import nearest_face
from rig.motion.steps import Stage

REST_S = 1.0  # duration of the readings that show whether the item is at rest
REST_PARTS = 5
MAX_CHANGE_RAD_S = 0.02  # beyond the noise: a hand at the item causes more, a turner at rest less
NOISE_STDS = 6
MAX_TILT_RAD = np.radians(20)  # error of the mounting of sensor and item together
READING_RATIOS = 0.5, 2.0  # to the angle, that a sensor with a scale error may read


@dataclass(frozen=True, slots=True)
class GyroscopeReadings:
    """The raw samples (n,) of one sensor with its `name`."""

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


def refuse_unsteady(readings: GyroscopeReadings, turner: str) -> None:
    """Raise Refused `item_not_at_rest`, naming the `turner`, if a gyroscope's readings change by more than noise."""
    rates = readings.rates_rad_s
    means = np.array([part.mean(axis=0) for part in np.array_split(rates, REST_PARTS)])
    noise = np.diff(rates, axis=0).std(axis=0) / np.sqrt(2 * len(rates) / REST_PARTS)
    moved = np.ptp(means, axis=0)
    if np.any(moved > MAX_CHANGE_RAD_S + NOISE_STDS * noise):
        raise Refused(
            "item_not_at_rest",
            f"{readings.name} reads rates changing by {degrees(moved.max()):.1f} °/s while the {turner} stands still",
            "Take your hands off the item and its cable, wait until nothing swings, then continue",
        )


def refuse_hanging_otherwise(readings: GyroscopeReadings, stage: Stage, up_flange: Array) -> None:
    """Raise Refused `mounted_otherwise` if an accelerometer contradicts the vertical `up_flange` (3,).

    The vertical is in the flange's frame. A sensor without accelerations is not tested.
    """
    if not readings.sensor.measures(ACCELERATION):
        return
    force = readings.sensor.channel(ACCELERATION).values(readings.samples).mean(axis=0)
    stated = np.array(stage.mount) @ up_flange
    measured = readings.mounting.T @ force
    if _angle_between_rad(measured, stated) > MAX_TILT_RAD:
        raise Refused(
            "mounted_otherwise",
            f"by the accelerometer of {readings.name} the item's {nearest_face(measured)} axis points up, "
            f"by the stage's mounting its {nearest_face(stated)} axis",
            remedy(stage),
        )


def refuse_turning_otherwise(
    readings: GyroscopeReadings, resting_rad_s: Array, stage: Stage, turn_flange_rad: Array, what: str
) -> None:
    """Raise Fault `mounted_otherwise` if a gyroscope contradicts a small rotation (3,), rad, in the flange's frame.

    `resting_rad_s` (3,) is this gyroscope's mean reading at rest. The readings cover the whole rotation, called `what`
    in an error.
    """
    turned = (readings.rates_rad_s - resting_rad_s).sum(axis=0) / readings.sensor.rate_hz
    stated = np.array(stage.mount) @ turn_flange_rad
    measured = readings.mounting.T @ turned
    fraction = float(np.linalg.norm(measured) / np.linalg.norm(stated))
    subject = (
        f"in the {what} {readings.name} is turned about the item's {nearest_face(stated)} axis by the stage's mounting"
    )
    if not READING_RATIOS[0] < fraction < READING_RATIOS[1]:
        how = f"but reads {degrees(np.linalg.norm(measured)):.1f}° of {degrees(np.linalg.norm(stated)):.1f}°"
    elif _angle_between_rad(measured, stated) > MAX_TILT_RAD:
        how = f"but reads a turn about its {nearest_face(measured)} axis"
    else:
        return
    raise Fault("mounted_otherwise", f"{subject}, {how}", remedy(stage))


def remedy(stage: Stage) -> str:
    """Return the remedy for an item that is not mounted as its stage requires."""
    return f'Mount the item as the stage says ("{stage.instruction}"), or correct its mount in procedure.stages'


def _angle_between_rad(one: Array, other: Array) -> float:
    cosine = float(one @ other / (np.linalg.norm(one) * np.linalg.norm(other)))
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)))

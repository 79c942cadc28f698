"""Checks that a sensor follows the arm: its means must change with the motion, and not at rest."""

from collections.abc import Collection, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.data.recording.settings import Site
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.motion.steps import Sweep
from rig.observation.average import Average
from rig.observation.reference.dwell_acceleration import DwellReading

MAX_BIAS_CHANGE_RATIO = 0.5  # to the slowest sweep's speed, from rest to rest
MIN_TURN_FRACTION = 0.5  # of gravity: the difference between two consecutive attitudes that is judged
MIN_SENSED_FRACTION = 0.05  # of the expected difference; readings in g that are declared as m/s² show twice as much
MIN_NOISE_RATIO = 0.01  # to the noise of the other axes
MIN_NOISE_STEPS = 1.0  # of an axis, the median of its dwells: with so much, one value in a whole dwell is no chance
REMEDY = "Check the sensor's supply and its bus wiring, then repeat the run"


def check_rests(rests: Sequence[Average], slowest_rad_s: float) -> None:
    """Raise Fault `stuck_sensor` if an axis' means in two rests differ by half of `slowest_rad_s` or more.

    A bias changes less; `slowest_rad_s` is the speed of the slowest sweep. Raise `stuck_axis` instead if this axis has
    no noise.
    """
    if len(rests) < 2:
        return
    apart = np.ptp([rest.mean_rad_s for rest in rests], axis=0)
    axis = int(np.argmax(apart))
    if apart[axis] > MAX_BIAS_CHANGE_RATIO * slowest_rad_s:
        noise = np.min([rest.noise_rad_s for rest in rests], axis=0)
        alone = noise[axis] < MIN_NOISE_RATIO * np.delete(noise, axis).min()
        which = f"the {'xyz'[axis]} axis of the gyroscope" if alone else "the gyroscope"
        raise Fault(
            "stuck_axis" if alone else "stuck_sensor",
            f"at rest {which} reads {np.degrees(apart[axis]):.3g} °/s more in one rest than in another, as if "
            "it turned",
            REMEDY,
        )


def check_other_direction(sweep: Sweep, valid_joints: Collection[str | None], fault: Fault) -> None:
    """Raise Fault `stuck_sensor` if another sweep of the joint shows that the mounting is right.

    `fault` is the error of this sweep, whose readings contradict the mounting. Return if there is no such other sweep.
    """
    if sweep.joint_name in valid_joints:
        raise Fault("stuck_sensor", f"{fault.what}; in the other direction it read correctly", REMEDY) from fault


def check_dwells(dwells: Sequence[DwellReading], site: Site) -> None:
    """Raise Fault `stuck_sensor` if readings in two attitudes differ much less than gravity does."""
    for one, other in pairwise(dwells):
        differ = float(np.linalg.norm((one.attitude - other.attitude) @ site.up))
        sensed_m_s2 = float(np.linalg.norm(one.reading.mean - other.reading.mean))
        if differ > MIN_TURN_FRACTION and sensed_m_s2 < MIN_SENSED_FRACTION * differ * site.gravity_m_s2:
            raise Fault("stuck_sensor", f"the accelerometer reads the same in {one.name} and {other.name}", REMEDY)


def check_noise(name: str, dwells: Sequence[tuple[DwellReading, NDArray[Any]]], step_counts: Array) -> None:
    """Raise Fault `stuck_axis` if an axis has one value in a whole dwell, but noise in most dwells.

    Each dwell has the raw counts (n, 3) of the sensor `name`; `step_counts` (3,) are the steps of its readings.
    """
    noise_counts = np.median([counts.std(axis=0) for _, counts in dwells], axis=0) if dwells else np.zeros(3)
    for dwell, counts in dwells:
        for axis in np.flatnonzero((noise_counts >= MIN_NOISE_STEPS * step_counts) & (np.ptp(counts, axis=0) == 0)):
            raise Fault(
                "stuck_axis",
                f"in dwell {dwell.index} ({dwell.name}) the {'xyz'[axis]} axis of {name} repeats one reading "
                f"{len(counts)} times; in most dwells it has noise",
                "Check the sensor and its supply, then repeat the run; if it stays, replace the sensor",
            )


def check_reads(readings: Array, quantity: Quantity) -> None:
    """Raise Fault `stuck_sensor` if an axis has the same value in all readings (n, 3)."""
    still = np.ptp(readings, axis=0) == 0 if len(readings) else np.zeros(3, bool)
    stuck = [int(axis) for axis in np.flatnonzero(still)]
    if stuck:
        axes = " and ".join(quantity.axes[axis] for axis in stuck)
        raise Fault(
            "stuck_sensor",
            f"the {quantity.sensor} reads {readings[0, stuck[0]]:g} {quantity.unit} on {axes} in every sample",
            "Check which columns hold its axes, its supply and its bus wires, then record again",
        )

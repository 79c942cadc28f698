"""The information that a plan's attitudes give about the accelerometers of a configuration. Pure functions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import radians, sqrt

import numpy as np

from rig.config.models import RigConfig
from rig.config.sensors.sensor_catalogue import PARTS
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.estimation.design.attitude_design import (
    ExpectedStds,
    Identifiability,
    Order,
    assess_identifiability,
    g_efficiency,
    predict_stds,
)
from rig.estimation.earth import MICRO_G_M_S2
from rig.motion.geometry import flange_attitude
from rig.motion.steps import Dwell, Plan
from rig.motion.turner_state import Joints

MAX_CONDITION = 100.0  # the worst of a thousand random sets of ten has 19; beyond, noise dominates


@dataclass(frozen=True, slots=True)
class AttitudeAccount:
    """How well `count` attitudes determine an accelerometer's model of the chosen `order`.

    - `first`, `second`: the identifiability of the models of order 1 and 2.
    - `g_efficiency`: the G-efficiency of the attitudes for the chosen order.
    - `attitude_std_rad`: the standard deviation of the arm's attitude error; `sensors`: each sensor's expected stds.
    """

    count: int
    order: Order
    first: Identifiability
    second: Identifiability
    g_efficiency: float
    attitude_std_rad: float
    sensors: Mapping[str, ExpectedStds]

    @property
    def chosen(self) -> Identifiability:
        """The identifiability of the chosen model."""
        return self.first if self.order == 1 else self.second


def attitude_account(config: RigConfig, plan: Plan) -> AttitudeAccount | None:
    """Return how accurately a plan's attitudes determine accelerometers, given the nominal errors of arm and sensors.

    Repeats of an attitude reduce noise, but not the arm's error. Return None if the procedure calibrates no
    accelerometer. Raise Refused `rank_deficient` or `ill_conditioned` if the attitudes do not determine the model.
    """
    order = config.procedure.accelerometer_order
    if order == 0:
        return None
    seconds = _sum_durations(plan.dwells)
    attitudes, up = _attitudes(list(seconds)), np.array(config.site.up)
    first, second = assess_identifiability(attitudes, up, 1), assess_identifiability(attitudes, up, 2)
    _check_identifiability(first if order == 1 else second, len(attitudes))
    attitude_std_rad = radians(config.uncertainty.axis_deg) / sqrt(3)  # from a half-width
    reference, dwells_s = config.site.gravity_m_s2 * up, np.array(list(seconds.values()))
    sensors = {
        name: predict_stds(
            attitudes,
            reference,
            PARTS[sensor.part].velocity_random_walk_ug_sqrt_s * MICRO_G_M_S2 / np.sqrt(dwells_s),
            attitude_std_rad,
            order,
        )
        for name, sensor in config.to_calibrate.items()
        if sensor.acceleration is not None
    }
    efficiency = g_efficiency(attitudes, up, order)
    return AttitudeAccount(len(attitudes), order, first, second, efficiency, attitude_std_rad, sensors)


def refuse_undetermined(config: RigConfig, plan: Plan) -> None:
    """Raise Refused `rank_deficient` or `ill_conditioned` if the plan's attitudes do not determine the chosen model."""
    order = config.procedure.accelerometer_order
    if order != 0:
        attitudes = _attitudes(list(_sum_durations(plan.dwells)))
        _check_identifiability(assess_identifiability(attitudes, np.array(config.site.up), order), len(attitudes))


def _sum_durations(dwells: Sequence[Dwell]) -> dict[Joints, float]:
    seconds: dict[Joints, float] = {}
    for dwell in dwells:
        seconds[dwell.q_rad] = seconds.get(dwell.q_rad, 0.0) + dwell.duration_s
    return seconds


def _attitudes(poses_rad: Sequence[Joints]) -> Array:
    """Return the rotations (N, 3, 3) from the flange's frame into the base's, for each pose."""
    attitudes: Array = np.swapaxes(flange_attitude(np.array(poses_rad)), -1, -2)
    return attitudes


def _check_identifiability(identifiability: Identifiability, count: int) -> None:
    """Raise Refused `rank_deficient` or `ill_conditioned` if the attitudes do not determine an accelerometer."""
    remedy = "Add attitudes to procedure.attitudes in which wrist 1 and wrist 3 are turned, or take eighteen"
    if identifiability.undetermined:
        raise Refused(
            "rank_deficient",
            f"{count} attitudes determine {identifiability.rank} of the {identifiability.needed} numbers of an "
            f"accelerometer's calibration; undetermined: {', '.join(identifiability.undetermined)}",
            remedy,
        )
    if identifiability.condition > MAX_CONDITION:
        raise Refused(
            "ill_conditioned",
            f"{count} attitudes hardly determine an accelerometer's calibration "
            f"(condition {identifiability.condition:.3g}; the limit is {MAX_CONDITION:g})",
            remedy,
        )

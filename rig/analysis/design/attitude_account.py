"""What the attitudes of a plan will tell of the accelerometers in a configuration, before anything moves. Pure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import radians

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
    expected_stds,
    g_efficiency,
)
from rig.estimation.earth import MICRO_G_M_S2
from rig.motion.geometry import flange_attitude
from rig.motion.state import Joints
from rig.motion.steps import Dwell, Plan

MAX_CONDITION = 100.0  # the worst of a thousand random tens has 19; beyond, noise decides more than the attitudes do


@dataclass(frozen=True, slots=True)
class AttitudeAccount:
    """What `count` attitudes tell of a model of that `order`, and what is expected_stds of each sensor by its name.

    `first` and `second` say how well they tell the two models; the efficiency is that of the one asked for.
    """

    count: int
    order: Order
    first: Identifiability
    second: Identifiability
    g_efficiency: float
    attitude_std_rad: float
    sensors: Mapping[str, ExpectedStds]

    @property
    def told(self) -> Identifiability:
        """What the attitudes tell of the model asked for."""
        return self.first if self.order == 1 else self.second


def attitude_account(config: RigConfig, plan: Plan) -> AttitudeAccount | None:
    """What a plan's attitudes tell, for the nominal arm and its parts' noise; None where nothing is asked of attitudes.

    An attitude that is repeated has the same error of the arm every time, so only its noise is averaged.
    Raises Refused `rank_deficient`, `ill_conditioned`.
    """
    order = config.procedure.accelerometer_order
    if order == 0:
        return None
    seconds = _time_in_each(plan.dwells)
    attitudes, up = _attitudes(list(seconds)), np.array(config.site.up)
    first, second = assess_identifiability(attitudes, up, 1), assess_identifiability(attitudes, up, 2)
    _refuse_undetermined(first if order == 1 else second, len(attitudes))
    attitude_std_rad = radians(config.uncertainty.axis_deg)
    reference, dwells_s = config.site.gravity_m_s2 * up, np.array(list(seconds.values()))
    sensors = {
        name: expected_stds(
            attitudes,
            reference,
            PARTS[sensor.part].acceleration_noise_ug_sqrt_hz * MICRO_G_M_S2 / np.sqrt(dwells_s),
            attitude_std_rad,
            order,
        )
        for name, sensor in config.to_calibrate.items()
        if sensor.acceleration is not None
    }
    efficiency = g_efficiency(attitudes, up, order)
    return AttitudeAccount(len(attitudes), order, first, second, efficiency, attitude_std_rad, sensors)


def refuse_untelling(config: RigConfig, plan: Plan) -> None:
    """Raise Refused `rank_deficient`, `ill_conditioned` when the plan's attitudes do not tell what is asked of them."""
    order = config.procedure.accelerometer_order
    if order != 0:
        attitudes = _attitudes(list(_time_in_each(plan.dwells)))
        _refuse_undetermined(assess_identifiability(attitudes, np.array(config.site.up), order), len(attitudes))


def _time_in_each(dwells: Sequence[Dwell]) -> dict[Joints, float]:
    seconds: dict[Joints, float] = {}
    for dwell in dwells:
        seconds[dwell.q_rad] = seconds.get(dwell.q_rad, 0.0) + dwell.duration_s
    return seconds


def _attitudes(poses_rad: Sequence[Joints]) -> Array:
    """(N, 3, 3) from the flange into the base."""
    attitudes: Array = np.swapaxes(flange_attitude(np.array(poses_rad)), -1, -2)
    return attitudes


def _refuse_undetermined(told: Identifiability, count: int) -> None:
    remedy = "Add attitudes to procedure.attitudes in which wrist 1 and wrist 3 are turned, or take eighteen"
    if told.undetermined:
        raise Refused(
            "rank_deficient",
            f"{count} attitudes determine {told.rank} of the {told.needed} numbers of an accelerometer's calibration; "
            f"undetermined: {', '.join(told.undetermined)}",
            remedy,
        )
    if told.condition > MAX_CONDITION:
        raise Refused(
            "ill_conditioned",
            f"{count} attitudes hardly determine an accelerometer's calibration (condition {told.condition:.3g}, "
            f"{MAX_CONDITION:g} is the most)",
            remedy,
        )

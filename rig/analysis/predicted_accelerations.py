"""The uncertainty that a plan's attitudes, and its sweeps, will reach of accelerometers, before it is run. Pure.

The plan says what is felt, the data sheet how readings scatter; the arm is as far off as is stated of its axes. What
readings alone tell is left out: how a bias wandered beside its flicker, and what disturbed single readings.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rig.analysis.accelerometer_errors import FLICKER, sheet_of
from rig.analysis.planned_reference import planned_read
from rig.analysis.reference_budgets import accelerometer_lines
from rig.config.models import RigConfig
from rig.config.sensor_sections import SensorSection
from rig.data.settings import RunSettings, Site, Uncertainty, settings_of
from rig.estimation.arrays import scale_of
from rig.estimation.attitude_error import AttitudeError
from rig.estimation.budget import Budget
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.estimation.imu_fit import covariance_bound
from rig.estimation.reference_budget import Spread, scale_and_bias
from rig.estimation.reference_model import matrix
from rig.motion.geometry import DenavitHartenberg
from rig.motion.steps import Plan

ANEW = ("noise", FLICKER)  # repeats lessen these


def accelerometers_of(config: RigConfig) -> Mapping[str, SensorSection]:
    """The sensors whose accelerometers the configuration's procedure calibrates, if it has attitudes."""
    if config.procedure.accelerometer_order == 0:
        return {}
    return {
        name: each
        for name, each in config.to_calibrate.items()
        if each.acceleration is not None and each.acceleration.range_g is not None
    }


def predicted_accelerations(
    config: RigConfig, plan: Plan, arm: DenavitHartenberg, *, endless: bool = False
) -> dict[str, Budget]:
    """The budget that a run of the plan will have, for each accelerometer to calibrate, on an `arm` made so.

    Of an `endless` run, which stands in its attitudes without end, nothing is left that comes anew each time.
    Raises LinAlgError where the plan does not tell enough.
    """
    settings = settings_of(config, plan)
    site, known = settings.site, settings.uncertainty
    assert site is not None and known is not None, "as new settings have them"
    found = {}
    for name, sensor in accelerometers_of(config).items():
        whole = _budget(name, sensor, plan, settings, site=site, known=known, arm=arm)
        kept = tuple(each for each in whole.contributors if not (endless and each.name in ANEW))
        found[name] = replace(whole, contributors=kept)
    return found


def _budget(
    name: str,
    sensor: SensorSection,
    plan: Plan,
    settings: RunSettings,
    *,
    site: Site,
    known: Uncertainty,
    arm: DenavitHartenberg,
) -> Budget:
    assert sensor.acceleration is not None and sensor.acceleration.range_g is not None, "as `accelerometers_of` has it"
    range_g = sensor.acceleration.range_g
    read = planned_read(name, sensor, plan, settings, site=site, known=known, range_g=range_g, arm=arm)
    off_rad = float(np.radians(known.axis_deg) / np.sqrt(3))
    covariance, response = covariance_bound(read.theta, read.movement, off_rad, second_order=settings.second_order)
    scale = scale_of(matrix(read.theta))
    told = scale_and_bias(matrix(read.theta), scale, len(read.theta))
    off = AttitudeError(off_rad, 0.0)
    spread = Spread(scale, told @ covariance @ told.T, told @ response, read.movement.noise(), off, 0.0, 0)
    sheet = sheet_of(known, name, sensor.part, range_g * STANDARD_GRAVITY_M_S2)
    lag_s = 1e-3 * known.acceleration_lag_ms
    return accelerometer_lines(spread, read.theta, read.movement, site, lag_s, sheet=sheet)

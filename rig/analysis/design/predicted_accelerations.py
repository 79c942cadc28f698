"""The uncertainty that a plan's attitudes, and its sweeps, will reach of accelerometers, before it is run. Pure.

The plan says what is felt, the data sheet how readings scatter; the arm is as far off as is stated of its axes, and as
far anew in each dwell as is stated of its repeatability. What readings alone tell is left out: how a bias wandered
beside its flicker, and what disturbed single readings.
"""

from dataclasses import replace

import numpy as np

from rig.analysis.design.planned_motion import planned_run
from rig.analysis.design.planned_reference import PlannedAccelerometer, planned_accelerometers, planned_read
from rig.analysis.reference.reference_budgets import accelerometer_lines
from rig.config.models import RigConfig
from rig.data.recording.settings import Uncertainty
from rig.estimation.arrays import scale_of
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.reference.attitude_error import AttitudeError
from rig.estimation.reference.imu_fit import covariance_bound
from rig.estimation.reference.reference_budget import Spread, scale_and_bias
from rig.estimation.reference.reference_model import matrix
from rig.estimation.statistics.expected_sizes import OWN_SHARES
from rig.motion.geometry import DenavitHartenberg
from rig.motion.steps import Plan


def predicted_accelerations(config: RigConfig, plan: Plan, arm: DenavitHartenberg) -> dict[str, Budget]:
    """The budget that a run of the plan will have, for each accelerometer to calibrate, on an `arm` made so.

    Raises LinAlgError where the plan does not tell enough.
    """
    if config.procedure.accelerometer_order == 0:
        return {}
    return {each.name: _budget(each) for each in planned_accelerometers(config, planned_run(config, plan, arm))}


def _budget(of: PlannedAccelerometer) -> Budget:
    read, run = planned_read(of), of.run
    off_rad = float(np.radians(run.known.axis_deg) / np.sqrt(3))
    movement = replace(read.movement, own_share=_own_share(run.known))
    covariance, response = covariance_bound(read.theta, movement, off_rad, second_order=read.second_order)
    scale = scale_of(matrix(read.theta))
    told = scale_and_bias(matrix(read.theta), scale, len(read.theta))
    off = AttitudeError(off_rad, 0.0)
    known = np.full(response.shape[1], np.inf)
    spread = Spread(scale, told @ covariance @ told.T, told @ response, movement.noise(), off, 0.0, 0, known)
    lag_s = 1e-3 * run.known.acceleration_lag_ms
    return accelerometer_lines(spread, read.theta, movement, run.site, lag_s, sheet=of.sheet)


def _own_share(known: Uncertainty) -> float:
    """The share of δ² that is new in each dwell, as it is stated, among those that a solve looks for."""
    share = known.repeatability_deg**2 / max(known.repeatability_deg**2 + known.axis_deg**2, np.finfo(np.float64).tiny)
    return float(np.clip(share, OWN_SHARES[0], OWN_SHARES[-1]))

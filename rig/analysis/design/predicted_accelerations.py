"""The prediction of the uncertainty of accelerometers by a plan's attitudes and sweeps. Pure functions.

The plan determines the specific force, the data sheet the noise; the arm's errors are the stated axis errors and
repeatability. Bias drift beyond flicker, and disturbances of single readings, are left out.
"""

from dataclasses import replace

import numpy as np

from rig.analysis.design.planned_motion import plan_run
from rig.analysis.design.planned_reference import PlannedAccelerometer, list_accelerometers, predict_readings
from rig.analysis.reference.reference_budgets import combine_errors
from rig.config.models import RigConfig
from rig.data.recording.settings import Uncertainty
from rig.estimation.arrays import scale_of
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.reference.attitude_error import AttitudeError
from rig.estimation.reference.imu_fit import covariance_bound
from rig.estimation.reference.reference_budget import FitUncertainty, scale_and_bias
from rig.estimation.reference.reference_model import matrix
from rig.estimation.statistics.expected_variances import INDEPENDENT_FRACTIONS
from rig.motion.chain import DenavitHartenberg
from rig.motion.steps import Plan


def predict_accelerometer_budgets(config: RigConfig, plan: Plan, arm: DenavitHartenberg) -> dict[str, Budget]:
    """Return the predicted budget of each accelerometer on an `arm`. Raise LinAlgError if the plan is insufficient."""
    if config.procedure.accelerometer_order == 0:
        return {}
    return {
        accelerometer.name: _budget(accelerometer)
        for accelerometer in list_accelerometers(config, plan_run(config, plan, arm))
    }


def _budget(accelerometer: PlannedAccelerometer) -> Budget:
    """Return the budget of scale and bias from the Cramér–Rao bound of the planned dwells and sweeps."""
    model, run = predict_readings(accelerometer), accelerometer.run
    delta_rad = float(np.radians(run.uncertainty.axis_deg) / np.sqrt(3))
    movement = replace(model.movement, independent_fraction=_new_fraction(run.uncertainty))
    covariance, response = covariance_bound(model.theta, movement, delta_rad, second_order=model.second_order)
    scale = scale_of(matrix(model.theta))
    to_scale_and_bias = scale_and_bias(matrix(model.theta), scale, len(model.theta))
    spread = FitUncertainty(
        scale=scale,
        covariance=to_scale_and_bias @ covariance @ to_scale_and_bias.T,
        response=to_scale_and_bias @ response,
        noise=movement.noise(),
        attitude_error=AttitudeError(delta_rad, 0.0),
        chi_square=0.0,
        dof=0,
        noise_dof=np.full(response.shape[1], np.inf),
    )
    lag_s = 1e-3 * run.uncertainty.acceleration_lag_ms
    return combine_errors(spread, model.theta, movement, run.site, lag_s, datasheet=accelerometer.datasheet)


def _new_fraction(stated: Uncertainty) -> float:
    """Return the stated fraction of the attitude errors' variance that is independent in each dwell.

    It is clipped to the range that the solution allows.
    """
    fraction = stated.repeatability_deg**2 / max(
        stated.repeatability_deg**2 + stated.axis_deg**2, np.finfo(np.float64).tiny
    )
    return float(np.clip(fraction, INDEPENDENT_FRACTIONS[0], INDEPENDENT_FRACTIONS[-1]))

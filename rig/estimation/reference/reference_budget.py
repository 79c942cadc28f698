"""The uncertainty budget of a sensor calibrated in a constant reference of given norm, such as gravity or a field.

The readings determine their noise and the error of the arm's attitudes. They do not determine the error of the
reference's norm, the attenuation of the sensor's filter and the drift of the reference. The solution's response
propagates these to scale and bias (JCGM 100, 5.1).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import NOISE, Budget, Contributor, evaluate_a
from rig.estimation.reference.accelerometer_model import Dwells
from rig.estimation.reference.attitude_error import AttitudeError, effects, find_whiteners
from rig.estimation.reference.reference_model import BIAS, SECOND, F, covariance_bound, jacobian
from rig.estimation.reference.triaxial import TriaxialSolution
from rig.estimation.sensor_axes import parameter_jacobian
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, effective_dof

ATTITUDES = "arm's attitudes"


@dataclass(frozen=True, slots=True)
class FitUncertainty:
    """The uncertainty of scale and bias, kx ky kz bx by bz, from n readings.

    - `scale` (3,); `covariance` (6, 6): due to noise and attitudes; `response` (6, n): derivative with respect to the
      readings.
    - `noise` (n, n): covariance of the readings' own noise.
    - `attitude_error`: the error of the attitudes.
    - `chi_square`, `dof`: χ² of the residuals, and its degrees of freedom.
    - `noise_dof` (n,): degrees of freedom of the readings' variances.
    """

    scale: Array
    covariance: Array
    response: Array
    noise: Array
    attitude_error: AttitudeError
    chi_square: float
    dof: int
    noise_dof: Array

    @property
    def noise_dof_min(self) -> float:
        """The smallest of the six degrees of freedom of scale and bias for noise alone."""
        return fewest_dof(self.response, np.diag(self.noise), self.noise_dof)

    def covariance_of(self, patterns: Array) -> Array:
        """Return the covariance (6, 6) due to independent patterns (k, n) of one standard deviation in the readings."""
        effect = self.response @ patterns.T
        covariance: Array = effect @ effect.T
        return covariance


@dataclass(frozen=True, slots=True)
class NormUncertainty:
    """The uncertainty of the reference's norm: expanded (k = 2) if `stated`, else a half-width.

    `relative` is the uncertainty divided by the norm; `relative` × `per_unit` is the uncertainty in `unit`.
    """

    name: str
    relative: float
    stated: bool
    per_unit: float
    unit: str
    source: str


def scale_and_bias(matrix: Array, scale: Array, parameters: int) -> Array:
    """Return the derivative (6, p) of scale and bias with respect to parameters that begin with F, reference and b.

    The bias changes its sign, because b is a part of the reading, but in a result the bias is added to the reading.
    """
    derivative = np.zeros((6, parameters))
    derivative[:, np.r_[F, BIAS]] = parameter_jacobian(matrix, scale) * np.repeat([1.0, -1.0], 3)[:, None]
    return derivative


def scale_and_bias_covariance(matrix: Array, scale: Array, covariance: Array) -> Array:
    """Return the covariance (6, 6) of scale and bias, signed as in `scale_and_bias`, from that of the parameters."""
    to_parameters = scale_and_bias(matrix, scale, len(covariance))
    propagated: Array = to_parameters @ covariance @ to_parameters.T
    return propagated


def fewest_dof(response: Array, variances: Array, dof: Array) -> float:
    """Return the smallest of the six degrees of freedom of scale and bias for noise alone.

    `response` (6, n) contains the derivatives of scale and bias with respect to the readings, whose noise has the
    `variances` (n,), with `dof` (n,) degrees of freedom.
    """
    return float(effective_dof((response**2 * variances).T, dof[:, None]).min())


def response_in_attitudes(solution: TriaxialSolution, dwells: Dwells) -> Array:
    """Return the derivative (15, 3 N) of the parameters (matrix, reference, bias) with respect to the readings."""
    theta, v_bar = solution.theta[: SECOND.start], np.zeros_like(dwells.variances_m2_s4)
    std_rad = np.full(len(v_bar), solution.attitude_std_rad)
    whiteners = find_whiteners(dwells.variances_m2_s4, effects(theta, dwells.attitudes, v_bar), std_rad)
    bound = covariance_bound(theta, dwells.attitudes, v_bar, whiteners, norm_known=True)
    weighted = np.swapaxes(whiteners, -1, -2) @ whiteners @ jacobian(theta, dwells.attitudes, v_bar)
    response: Array = bound @ weighted.reshape(-1, len(theta)).T
    return response


def reference_budget(spread: FitUncertainty, size: NormUncertainty, others: Sequence[Contributor] = ()) -> Budget:
    """Return the budget with the contributors of a fit's uncertainty and of the norm's, and with `others`."""
    noise = spread.response @ spread.noise @ spread.response.T
    contributors = [
        evaluate_a(NOISE, "scatter of the readings", noise, spread.noise_dof_min),
        evaluate_a(
            ATTITUDES,
            "estimated from the residuals",
            spread.covariance - noise,
            find_uncertainty_dof(spread.attitude_error),
        ),
    ]
    excess = spread.chi_square / max(spread.dof, 1) - 1.0
    if spread.dof > 0 and excess > 0.0:
        model_covariance = excess * spread.covariance
        contributors.append(
            evaluate_a(
                "residuals of the model", "residuals beyond noise and attitudes", model_covariance, float(spread.dof)
            )
        )
    return Budget((*contributors, _evaluate_norm(spread.scale, size), *others))


def type_b(name: str, half_width: float, unit: str, source: str, covariance: Array) -> Contributor:
    """Return a contributor of type B; `covariance` (6, 6) is the effect of its half-width."""
    return Contributor(name, "B", "rectangular", half_width, unit, source, np.inf, covariance / 3)


def _evaluate_norm(scale: Array, size: NormUncertainty) -> Contributor:
    """Return the contributor of the reference's norm. Its error changes scale factors in proportion, and no bias."""
    derivative = np.concatenate([scale, np.zeros(3)])
    distribution: Literal["normal", "rectangular"] = "normal" if size.stated else "rectangular"
    std = size.relative / (COVERAGE_FACTOR if size.stated else np.sqrt(3))
    half_width = size.relative * size.per_unit
    covariance = np.outer(derivative, derivative) * std**2
    return Contributor(size.name, "B", distribution, half_width, size.unit, size.source, np.inf, covariance)


def find_uncertainty_dof(error: AttitudeError) -> float:
    """Return the degrees of freedom of an estimated attitude error, from its own uncertainty (JCGM 100, G.4.2)."""
    if error.uncertainty_rad == 0.0:
        return np.inf
    return max(1.0, 0.5 * (error.std_rad / error.uncertainty_rad) ** 2)

"""The uncertainty budget of a sensor calibrated in a constant reference, of which the size is given: gravity, a field.

The readings tell their noise and how far the arm's attitudes are off; how well the reference is known, what the
sensor's own filter takes and how the reference changed they do not tell, or not all of it. The solution's response
turns each into changes of scale and bias (JCGM 100, 5.1).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import NOISE, Budget, Contributor, evaluate_a
from rig.estimation.reference.accelerometer_model import Dwells
from rig.estimation.reference.attitude_error import AttitudeError, effects, whitening_with
from rig.estimation.reference.reference_model import BIAS, SECOND, F, covariance_bound, jacobian
from rig.estimation.reference.triaxial import TriaxialSolution
from rig.estimation.sensor_axes import parameter_jacobian
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, effective_freedom

ATTITUDES = "arm's attitudes"


@dataclass(frozen=True, slots=True)
class Spread:
    """What scale and bias owe to the readings: kx ky kz bx by bz, n readings.

    - `scale` (3,), `covariance` (6, 6) of noise and attitudes, `response` (6, n) to the readings.
    - `noise` (n, n): covariance of the readings' own.
    - `attitude_error`: how far the attitudes are off.
    - `chi_square` of what the model leaves, and its `freedom`.
    - `noise_freedom` (n,): with how many degrees of freedom the readings' variances are known.
    """

    scale: Array
    covariance: Array
    response: Array
    noise: Array
    attitude_error: AttitudeError
    chi_square: float
    freedom: int
    noise_freedom: Array

    @property
    def known_noise(self) -> float:
        """Degrees of freedom of the noise's part in scale and bias, the fewest of the six."""
        return fewest_freedom(self.response, np.diag(self.noise), self.noise_freedom)

    def of(self, patterns: Array) -> Array:
        """(6, 6) covariance of independent patterns (k, n) of errors in readings, one standard uncertainty each."""
        effect = self.response @ patterns.T
        covariance: Array = effect @ effect.T
        return covariance


@dataclass(frozen=True, slots=True)
class KnownSize:
    """How well the reference's size is known: the expanded uncertainty (k = 2) where it is `stated`, else a half-width.

    `relative` to the size; `per_unit` takes that into `unit`.
    """

    name: str
    relative: float
    stated: bool
    per_unit: float
    unit: str
    source: str


def scale_and_bias(matrix: Array, scale: Array, parameters: int) -> Array:
    """(6, p) derivative of scale and bias with respect to θ (p,), which begins with F, the reference and b.

    Of a bias that is part of the reading; a gyroscope's is added to it.
    """
    whole = np.zeros((6, parameters))
    whole[:, np.r_[F, BIAS]] = parameter_jacobian(matrix, scale) * np.repeat([1.0, -1.0], 3)[:, None]
    return whole


def scale_and_bias_covariance(matrix: Array, scale: Array, covariance: Array) -> Array:
    """(6, 6) covariance of scale and bias from a reference model's; b is in the reading, a gyroscope's is added."""
    to_parameters = scale_and_bias(matrix, scale, len(covariance))
    propagated: Array = to_parameters @ covariance @ to_parameters.T
    return propagated


def fewest_freedom(response: Array, variances: Array, freedom: Array) -> float:
    """Degrees of freedom of the noise's part in scale and bias, the fewest of the six, by their `response` (6, n).

    The readings' `variances` (n,) are known with `freedom` (n,).
    """
    return float(effective_freedom((response**2 * variances).T, freedom[:, None]).min())


def response_in_attitudes(solution: TriaxialSolution, seen: Dwells) -> Array:
    """(15, 3 N): how F, v_ref, its size given, and b change with the readings `seen`, in attitudes off as found."""
    theta, v_bar = solution.theta[: SECOND.start], np.zeros_like(seen.variances_m2_s4)
    std_rad = np.full(len(v_bar), solution.attitude_std_rad)
    white = whitening_with(seen.variances_m2_s4, effects(theta, seen.attitudes, v_bar), std_rad)
    bound = covariance_bound(theta, seen.attitudes, v_bar, white, norm_known=True)
    weighted = np.swapaxes(white, -1, -2) @ white @ jacobian(theta, seen.attitudes, v_bar)
    response: Array = bound @ weighted.reshape(-1, len(theta)).T
    return response


def reference_budget(spread: Spread, size: KnownSize, others: Sequence[Contributor] = ()) -> Budget:
    """What the readings tell, how well the reference's size is known, and what else there is."""
    noise = spread.response @ spread.noise @ spread.response.T
    told = [
        evaluate_a(NOISE, "scatter of the readings", noise, spread.known_noise),
        evaluate_a(
            ATTITUDES,
            "what the readings say of them",
            spread.covariance - noise,
            freedom_of(spread.attitude_error),
        ),
    ]
    beyond = spread.chi_square / max(spread.freedom, 1) - 1.0
    if spread.freedom > 0 and beyond > 0.0:
        left = beyond * spread.covariance
        told.append(
            evaluate_a("what the model leaves", "residuals beside noise and attitudes", left, float(spread.freedom))
        )
    return Budget((*told, _of_size(spread.scale, size), *others))


def assumed(name: str, half_width: float, unit: str, source: str, covariance: Array) -> Contributor:
    """Type B: `covariance` (6, 6) is that of one half-width."""
    return Contributor(name, "B", "rectangular", half_width, unit, source, np.inf, covariance / 3)


def _of_size(scale: Array, size: KnownSize) -> Contributor:
    """A reference that is larger by a part makes every scale factor larger by that part, and leaves the bias alone."""
    along = np.concatenate([scale, np.zeros(3)])
    distribution: Literal["normal", "rectangular"] = "normal" if size.stated else "rectangular"
    std = size.relative / (COVERAGE_FACTOR if size.stated else np.sqrt(3))
    shown = size.relative * size.per_unit
    spread = np.outer(along, along) * std**2
    return Contributor(size.name, "B", distribution, shown, size.unit, size.source, np.inf, spread)


def freedom_of(error: AttitudeError) -> float:
    """Degrees of freedom of an uncertainty that is itself uncertain (JCGM 100, G.4.2)."""
    if error.uncertainty_rad == 0.0:
        return np.inf
    return max(1.0, 0.5 * (error.std_rad / error.uncertainty_rad) ** 2)

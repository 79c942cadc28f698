"""The check that the sweeps of an external file agree, and the effect of their errors on the solution."""

from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.external.changes_of_sweeps import estimate_changes
from rig.errors import Refused
from rig.estimation.arrays import Array, bisect
from rig.estimation.gyroscope.stated_motion import MotionErrors, StatedMotion, motion_errors
from rig.estimation.gyroscope.vector_model import VectorSolution, design_matrix, index_coefficients, regress
from rig.estimation.reference.reference_budget import fewest_dof
from rig.estimation.sensor_axes import SensorAxes, parameter_jacobian
from rig.estimation.statistics.coverage import coverage_factors, effective_dof
from rig.observation.external.csv_import import ExternalData, stack_rows
from rig.observation.statistics.mean import dof_by_axis

MAX_RESIDUAL_RATIO = 0.1  # leave-one-out, to the sweep's rate: no rate table errs by this much, a wrong row does
MAX_RESIDUAL = 6.0  # in standard deviations of the sweep's mean
MIN_REDUNDANCY = 0.05  # redundancy number of a row: below it, nothing can contradict the row
SAME_AXIS_COSINE = 0.9  # between the axes of two rows, in either direction
CHANCE_LIMIT = 4.0  # standard deviations: one of some dozens of means may deviate as much by chance
MIN_DOF = 3  # with fewer, rounding down to the next integer would alone increase U by half


def check_agree(data: ExternalData) -> None:
    """Raise Refused `bad_sweep` if a sweep contradicts the solution of all others, as one with a wrong angle does.

    The message names the sweep that disagrees most; if its axis has only two sweeps, it names both. If there are too
    few rows for a solution, they are not checked.
    """
    means, variances, design = _equations(data)
    redundancy = _redundancy_numbers(design)
    coefficients = np.linalg.pinv(design) @ means
    sensitivity = float(np.linalg.norm(coefficients[:3], 2))
    if np.linalg.matrix_rank(design) < design.shape[1] or not sensitivity:
        return
    apart = (means - design @ coefficients) / redundancy  # leave-one-out residuals
    errors = np.linalg.norm(apart, axis=1) / sensitivity
    noise = np.linalg.norm(np.sqrt(variances) / redundancy, axis=1)
    sweeps = slice(len(data.sweeps))
    fraction = np.where(errors > MAX_RESIDUAL * noise, errors, 0.0)[sweeps] / np.linalg.norm(design[sweeps, :3], axis=1)
    worst = int(np.argmax(fraction))
    if fraction[worst] > MAX_RESIDUAL_RATIO:
        raise Refused(
            "bad_sweep",
            f"{_name_contradiction(worst, data)} by {100 * fraction[worst]:.0f} % of its rate",
            "Look at its row and those of other sweeps about its axis: angle or speed, start and end, direction of the "
            "axis; correct the wrong one, or leave it out",
        )


def _name_contradiction(worst: int, data: ExternalData) -> str:
    """Return a description of the sweeps that contradict each other, by their rows."""
    axis = data.sweeps[worst].axis_flange
    about = [sweep.sweep for sweep in data.sweeps if abs(sweep.axis_flange @ axis) > SAME_AXIS_COSINE]
    if len(about) == 2:
        return f"of sweeps {about[0]} and {about[1]}, the only ones about their axis, one contradicts the other"
    return f"sweep {data.sweeps[worst].sweep} contradicts the others"


@dataclass(frozen=True, slots=True)
class SweepErrors:
    """The covariances that errors of the stated motion and changes of the sensor add to those of a solution.

    - `covariance` (6, 6): of scale and bias, with `dof` degrees of freedom.
    - `matrix_covariance` (12, 12), `angles_covariance_rad2` (6, 6): as in `VectorSolution`, enlarged so that U is twice
      a standard uncertainty.
    """

    covariance: Array
    matrix_covariance: Array
    angles_covariance_rad2: Array
    dof: float


def sweep_errors(solution: VectorSolution, data: ExternalData) -> SweepErrors | None:
    """Return the effect of the stated motion's errors, and of the sensor's changes, on the vector model's `solution`.

    Return None for means corrected to one temperature, because the polynomials' uncertainty already includes the
    contradictions between repeats.
    """
    if data.at_reference:
        return None
    means, variances, design = _equations(data)
    stated = StatedMotion.from_residuals(solution.residuals_rad_s, design[:, :3], variances, solution.matrix)
    sizes = motion_errors(stated)
    gain = _derivatives(design, means, variances)  # (12, N, 3): matrix, offset by readings
    noise = np.einsum("qni,ni->qni", gain, np.sqrt(variances)).reshape(12, -1)
    by_rate = np.einsum("qni,ni->qn", gain, stated.rate_patterns)
    by_axis = np.einsum("qni,kni->qkn", gain, stated.axis_patterns).reshape(12, -1)
    wrong = np.einsum("qni,ni->qn", gain, _contradictions(stated, sizes, design))
    axes = SensorAxes.from_matrix(solution.matrix)
    to_angles = np.hstack([axes.to_angles, np.zeros((6, 3))])
    rate_variance, axis_variance = sizes.median_variances

    def inflate(to_values: Array, dof: float, noise_dof: float) -> Array:
        """Return the covariance (q, q) that motion errors add to values with the derivatives `to_values` (q, 12).

        It is that of errors of the median size, scaled for each value so that it gives, together with the noise, the
        expanded uncertainty that follows from the posterior distribution of the errors' sizes.
        """
        by_noise, of_rate, of_axis, by_wrong = (
            to_values @ effects @ effects.T @ to_values.T for effects in (noise, by_rate, by_axis, wrong)
        )
        expanded = sizes.expanded(np.diag(by_noise + by_wrong), np.diag(of_rate), np.diag(of_axis))
        covariance = rate_variance * of_rate + axis_variance * of_axis + by_wrong
        std = _additional_std(np.sqrt(np.diag(by_noise)), expanded, noise_dof, dof)
        inflation = std / np.sqrt(np.maximum(np.diag(covariance), np.finfo(np.float64).tiny))
        return np.asarray(inflation[:, None] * covariance * inflation, dtype=np.float64)

    dof = float(max(count_redundant_rows(data), MIN_DOF))
    changes, to_parameters = estimate_changes(data, solution.matrix), parameter_jacobian(solution.matrix, axes.scale)
    return SweepErrors(
        covariance=inflate(to_parameters, dof, noise_dof(solution, data)) + to_parameters @ changes @ to_parameters.T,
        matrix_covariance=inflate(np.eye(12), np.inf, np.inf) + changes,
        angles_covariance_rad2=inflate(to_angles, np.inf, np.inf),
        dof=dof,
    )


def count_redundant_rows(data: ExternalData) -> int:
    """Return the number of rows in addition to the four that a solution needs.

    A row has three equations but counts once, because a wrong rate or a wrong end time affects all three.
    """
    return len(data.sweeps) + len(data.rests) - 4


def noise_dof(solution: VectorSolution, data: ExternalData) -> float:
    """Return the smallest degrees of freedom, due to noise alone, of the scale factors and biases of a `solution`."""
    averages = [*(sweep.average for sweep in data.sweeps), *data.rests]
    variances = np.array([average.variance_rad2_s2 for average in averages])
    dof = dof_by_axis(average.dof for average in averages)
    return fewest_dof(solution.response.reshape(6, -1), variances.ravel(), dof.ravel())


def add_errors(solution: VectorSolution, data: ExternalData) -> VectorSolution:
    """Return the solution with covariances that include the errors of the stated motion."""
    more = sweep_errors(solution, data)
    if more is None:
        return solution
    return replace(
        solution,
        covariance=solution.covariance + more.covariance,
        matrix_covariance=solution.matrix_covariance + more.matrix_covariance,
        angles_covariance_rad2=solution.angles_covariance_rad2 + more.angles_covariance_rad2,
    )


def _derivatives(design: Array, means: Array, variances: Array) -> Array:
    """Return the derivatives (12, N, 3) of the matrix, row by row, and the offset with respect to `means` (N, 3)."""
    _, inverse = regress(design, means, variances)  # (3, 4, N)
    order, _ = index_coefficients(4)  # F row by row, then c
    gain = np.zeros((3, 4, len(means), 3))
    for axis in range(3):
        gain[axis, :, :, axis] = inverse[axis]
    return np.asarray(gain.reshape(12, len(means), 3)[order], dtype=np.float64)


def _contradictions(stated: StatedMotion, sizes: MotionErrors, design: Array) -> Array:
    """Return the difference (N, 3) of each row from the solution of all others; 0 if errors of these sizes explain it.

    One wrong row among many hardly increases the estimated sizes, so its difference counts in addition. With only two
    sweeps about an axis, neither differs enough, but a wrong one increases the sizes.
    """
    rate_variance, axis_variance = sizes.median_variances
    spread = rate_variance * stated.rate_patterns**2 + axis_variance * np.sum(stated.axis_patterns**2, axis=0)
    redundancy = _redundancy_numbers(design)
    errors = np.abs(stated.residuals_rad_s) / np.sqrt(redundancy * (stated.variances_rad2_s2 + spread))
    beyond: Array = np.where(errors.max(axis=1, keepdims=True) > CHANCE_LIMIT, stated.residuals_rad_s / redundancy, 0.0)
    return beyond


def _redundancy_numbers(design: Array) -> Array:
    """Return the redundancy number (N, 1) of each row: the fraction of its error that its residual shows."""
    redundancy: Array = np.maximum(1 - np.einsum("ij,ji->i", design, np.linalg.pinv(design)), MIN_REDUNDANCY)
    return redundancy[:, None]


def _additional_std(noise_std: Array, expanded: Array, known_dof: float, dof: float) -> Array:
    """Return the standard uncertainties (q,) that give, together with `noise_std` (q,), the U `expanded` (q,).

    They have `dof` degrees of freedom, the noise has `known_dof`.
    """

    def is_too_small(std: Array) -> Array:
        variances = np.array([noise_std**2, std**2])
        factors = coverage_factors(effective_dof(variances, np.array([[known_dof], [dof]])))
        small: Array = factors * np.sqrt(variances.sum(axis=0)) < expanded
        return small

    return bisect(is_too_small, expanded)


def _equations(data: ExternalData) -> tuple[Array, Array, Array]:
    """Return the means (N, 3), first of sweeps, then of rests, their variances (N, 3), and the design [ω 1] (N, 4)."""
    averages, rates_rad_s = stack_rows(data.sweeps, data.rests)
    return (
        np.array([average.mean_rad_s for average in averages]),
        np.array([average.variance_rad2_s2 for average in averages]),
        design_matrix(rates_rad_s, None),
    )

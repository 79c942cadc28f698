"""Whether the sweeps of another laboratory's file agree with each other, and what their errors do to the solution."""

from dataclasses import dataclass, replace

import numpy as np

from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.stated_motion import MotionErrors, StatedMotion, motion_errors
from rig.estimation.gyroscope.vector_model import VectorSolution, design_matrix, index_coefficients, regress
from rig.estimation.reference.reference_budget import fewest_freedom
from rig.estimation.sensor_axes import SensorAxes, parameter_jacobian
from rig.estimation.statistics.coverage import coverage_factors, effective_freedom
from rig.observation.external.csv_import import ExternalData
from rig.observation.statistics.mean import by_axis

WRONG = 0.1  # of a sweep's rate, by which the others put it elsewhere: no table is that far off, a wrong row is
BEYOND_NOISE = 6.0  # standard deviations of its mean
TOLD = 0.05  # of a row that the others tell at least: else nothing can contradict it
SAME_AXIS = 0.9  # cosine of two rows' axes, either way
CHANCE = 4.0  # standard deviations that one of some dozens of means may be off by chance
FEWEST_FREEDOM = 3  # with fewer, the next coarser whole number alone would make U half as large again
BISECTIONS = 30


def check_agree(solution: VectorSolution, data: ExternalData) -> None:
    """Every sweep is where all others, solved without it, put it.

    Raises Refused `bad_sweep` for the one that is farthest off: half a turn given as a whole one, a wrong axis. Of two
    about an axis, both: what is between them does not tell which of them is wrong.
    """
    means, variances, design = _equations(data)
    toward = np.linalg.pinv(design)
    told = np.maximum(1 - np.einsum("ij,ji->i", design, toward), TOLD)[:, None]
    apart = (means - design @ (toward @ means)) / told
    off = np.linalg.norm(apart @ np.linalg.inv(solution.matrix).T, axis=1)
    noise = np.linalg.norm(np.sqrt(variances) / told, axis=1)
    sweeps = slice(len(data.sweeps))
    share = np.where(off > BEYOND_NOISE * noise, off, 0.0)[sweeps] / np.linalg.norm(design[sweeps, :3], axis=1)
    worst = int(np.argmax(share))
    if share[worst] > WRONG:
        raise Refused(
            "bad_sweep",
            f"{_named(worst, data)} by {100 * share[worst]:.0f} % of its rate",
            "Look at its row and those of other sweeps about its axis: angle or speed, start and end, direction of the "
            "axis; correct the wrong one, or leave it out",
        )


def _named(worst: int, data: ExternalData) -> str:
    """Which sweep contradicts which, by their rows."""
    axis = data.sweeps[worst].axis_flange
    about = [sweep.sweep for sweep in data.sweeps if abs(sweep.axis_flange @ axis) > SAME_AXIS]
    if len(about) == 2:
        return f"of sweeps {about[0]} and {about[1]}, alone about their axis, one contradicts the other"
    return f"sweep {data.sweeps[worst].sweep} contradicts the others"


@dataclass(frozen=True, slots=True)
class SweepErrors:
    """What errors of the stated motion add to a solution's covariances, and with how many degrees of `freedom`.

    `covariance` (6, 6) of scale and bias; `matrix_covariance` (12, 12) and `angles_covariance_rad2` (6, 6) as in
    `VectorSolution`, so that twice a standard uncertainty is U.
    """

    covariance: Array
    matrix_covariance: Array
    angles_covariance_rad2: Array
    freedom: float


def sweep_errors(solution: VectorSolution, data: ExternalData) -> SweepErrors | None:
    """Return what the errors of the stated motion do to the vector model's `solution`.

    None for means that polynomials have taken to one temperature: these count how the repeats contradict each other.
    """
    if data.at_reference:
        return None
    means, variances, design = _equations(data)
    stated = StatedMotion.of(solution.residuals_rad_s, design[:, :3], variances, solution.matrix)
    sizes = motion_errors(stated)
    gain = _gain(design, means, variances)
    noise = np.einsum("qni,ni->qni", gain, np.sqrt(variances)).reshape(12, -1)
    by_rate = np.einsum("qni,ni->qn", gain, stated.rate_patterns)
    by_axis = np.einsum("qni,kni->qkn", gain, stated.axis_patterns).reshape(12, -1)
    own = np.einsum("qni,ni->qn", gain, _beyond_chance(stated, sizes, design))
    axes = SensorAxes.of(solution.matrix)
    to_angles = np.hstack([axes.to_angles, np.zeros((6, 3))])
    rate_variance, axis_variance = sizes.median_variances

    def added(to_values: Array, freedom: float, noise_freedom: float) -> Array:
        """The covariance (q, q) that makes U of values, by their derivatives (q, 12), what it is over all sizes."""
        of_noise, of_rate, of_axis, of_own = (
            to_values @ effects @ effects.T @ to_values.T for effects in (noise, by_rate, by_axis, own)
        )
        expanded = sizes.expanded(np.diag(of_noise + of_own), np.diag(of_rate), np.diag(of_axis))
        beyond = rate_variance * of_rate + axis_variance * of_axis + of_own
        std = _std_beside(np.sqrt(np.diag(of_noise)), expanded, noise_freedom, freedom)
        stretch = std / np.sqrt(np.maximum(np.diag(beyond), np.finfo(np.float64).tiny))
        return np.asarray(stretch[:, None] * beyond * stretch, dtype=np.float64)

    freedom = float(max(rows_left(data), FEWEST_FREEDOM))
    return SweepErrors(
        covariance=added(parameter_jacobian(solution.matrix, axes.scale), freedom, noise_freedom(solution, data)),
        matrix_covariance=added(np.eye(12), np.inf, np.inf),
        angles_covariance_rad2=added(to_angles, np.inf, np.inf),
        freedom=freedom,
    )


def rows_left(data: ExternalData) -> int:
    """How many rows are more than the solution takes: the degrees of freedom of what they contradict each other by.

    A row whose rate, or end, is wrong is wrong once, though it tells three equations.
    """
    return len(data.sweeps) + len(data.rests) - 4


def noise_freedom(solution: VectorSolution, data: ExternalData) -> float:
    """Return the noise's fewest degrees of freedom, by how the vector model weighs the means."""
    averages = [*(sweep.average for sweep in data.sweeps), *data.rests]
    variances = np.array([average.variance_rad2_s2 for average in averages])
    freedom = by_axis(average.freedom for average in averages)
    return fewest_freedom(solution.response.reshape(6, -1), variances.ravel(), freedom.ravel())


def counted(solution: VectorSolution, data: ExternalData) -> VectorSolution:
    """Return the solution with the errors of the stated motion in its covariances."""
    more = sweep_errors(solution, data)
    if more is None:
        return solution
    return replace(
        solution,
        covariance=solution.covariance + more.covariance,
        matrix_covariance=solution.matrix_covariance + more.matrix_covariance,
        angles_covariance_rad2=solution.angles_covariance_rad2 + more.angles_covariance_rad2,
    )


def _gain(design: Array, means: Array, variances: Array) -> Array:
    """(12, N, 3) derivative of F, row by row, then c, with respect to each mean reading."""
    _, inverse = regress(design, means, variances)  # (3, 4, N)
    of_matrix, _ = index_coefficients(4)
    gain = np.zeros((3, 4, len(means), 3))
    for axis in range(3):
        gain[axis, :, :, axis] = inverse[axis]
    return np.asarray(gain.reshape(12, len(means), 3)[of_matrix], dtype=np.float64)


def _beyond_chance(stated: StatedMotion, sizes: MotionErrors, design: Array) -> Array:
    """Return the contradiction (N, 3) of each sweep with the others, beyond errors of these sizes.

    One wrong row among many makes the sizes little larger, and is all that two sweeps about an axis tell.
    """
    rate_variance, axis_variance = sizes.median_variances
    spread = rate_variance * stated.rate_patterns**2 + axis_variance * np.sum(stated.axis_patterns**2, axis=0)
    told = np.maximum(1 - np.einsum("ij,ji->i", design, np.linalg.pinv(design)), TOLD)[:, None]
    off = np.abs(stated.residuals_rad_s) / np.sqrt(told * (stated.variances_rad2_s2 + spread))
    beyond: Array = np.where(off.max(axis=1, keepdims=True) > CHANCE, stated.residuals_rad_s / told, 0.0)
    return beyond


def _std_beside(known: Array, expanded: Array, known_freedom: float, freedom: float) -> Array:
    """(q,) standard uncertainties that, beside those `known` (q,), make U = k u as large as `expanded` (q,)."""
    low, high = np.zeros(len(known)), expanded.copy()
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        variances = np.array([known**2, middle**2])
        factors = coverage_factors(effective_freedom(variances, np.array([[known_freedom], [freedom]])))
        small = factors * np.sqrt(variances.sum(axis=0)) < expanded
        low, high = np.where(small, middle, low), np.where(small, high, middle)
    return high


def _equations(data: ExternalData) -> tuple[Array, Array, Array]:
    """Mean readings (N, 3) of sweeps, then of rests, their variances (N, 3), and the design (N, 4), [ω 1]."""
    averages = [*(sweep.average for sweep in data.sweeps), *data.rests]
    rates = [sweep.speed_rad_s * sweep.axis_flange for sweep in data.sweeps]
    return (
        np.array([average.mean_rad_s for average in averages]),
        np.array([average.variance_rad2_s2 for average in averages]),
        design_matrix(np.array([*rates, *np.zeros((len(data.rests), 3))]), None),
    )

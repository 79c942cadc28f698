"""A gyroscope's matrix and bias from its rotations between attitudes of a reference, such as cameras or a table.

The reference's rates are not used, because their noise would bias the scale (errors in variables). Instead the rotation
between two fixes (measured attitudes) is compared with the integrated readings (`attitude_drift`), whose noise grows
only with the square root of time.

Matrix and bias may change between intervals of the recording, by nonlinearity, g-sensitivity and temperature. The
variances of these changes, and of the errors of fixes and gyroscope, are estimated from the residuals
(`variance_components`). The result is the mean matrix and bias over the intervals; its uncertainty follows from these
variances. The parameters θ (16,) of the fit are F row by row, b, the clock's offset and the Earth's rate.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault, or_fault
from rig.estimation import refusals
from rig.estimation.arrays import Array, scale_of
from rig.estimation.external.abrupt_change import AbruptChange
from rig.estimation.external.attitude_drift import (
    ATTITUDE_ERROR,
    BIAS,
    BIAS_CHANGES,
    CLOCK,
    CLOCK_STD_S,
    EARTH,
    EARTH_PRECISION,
    JITTER,
    LOST_TIMES,
    MATRIX,
    MATRIX_CHANGES,
    MATRIX_PRECISION,
    MOTION_ERROR,
    RANDOM_WALK,
    REST_ERROR,
    VISIT_ERROR,
    AttitudeSamples,
    DriftModel,
    DriftState,
    FixedAttitudes,
    Fixes,
    average_fixes,
    drift_model,
    find_inliers,
)
from rig.estimation.external.axis_directions import find_inclinations
from rig.estimation.external.increment_changes import find_increment_change, find_reset
from rig.estimation.gyroscope.earth_rate import check_earth_rate
from rig.estimation.statistics.variance_components import Mixed, MixedFit, MixedModel

MAX_ITERATIONS, LAST_VARIANCE_ITERATION = 12, 3  # of the fit, and the last that estimates the variances
CONVERGED_STEP_RATIO = 1e-2  # largest step, relative to the standard uncertainty
OUTLIER_RATIO, MIN_OUTLIER_RAD = 4.0, 1e-3  # an outlier exceeds both: a ratio to the ninth decile, and an angle
MAX_OUTLIERS, MAX_OUTLIER_FRACTION, OUTLIER_PASSES = 4, 0.1, 3  # the number or, if more, the fraction
MAX_ATTITUDE_ERROR_RAD = 0.1  # with larger errors, the attitudes are those of another body
MAX_CLOCK_STDS = 3.0  # offset if one clock stamps readings and attitudes, in prior standard deviations
CLOCK_ROUNDING_S = 5e-3  # by which an offset of exactly so much may seem larger
MAX_IDENTIFIABLE_STD = 0.1  # of an element of F
MAX_MATRIX_STEP = 10.0  # of F: beyond it, the fit diverges
MAX_CONDITION = 1e4
NOISE, ATTITUDES, DELAY = "noise", "attitudes", "delay between the files"
EARTH_RATE, INTERVAL_DIFFERENCES = "Earth's rate", "differences between stretches"
ROUNDING = "rounding"
AXES = "directions of the reference's axes"
REMEDY = "Turn the body about all its axes, by a right angle and more"


@dataclass(frozen=True, slots=True)
class EarthRateEstimate:
    """The Earth's rate (3,) in table coordinates, determined to within 10 %, and its covariance (3, 3)."""

    rate_rad_s: Array
    covariance_rad2_s2: Array

    @property
    def std_rad_s(self) -> Array:
        """The standard deviations (3,)."""
        std: Array = np.sqrt(np.diag(self.covariance_rad2_s2))
        return std


@dataclass(frozen=True, slots=True)
class IncrementSolution:
    """A gyroscope's matrix and bias from its increments, with their covariance and variance components.

    - matrix (3, 3): the scale factors and axes; bias (3,): the reading at rest.
    - covariance (15, 15): of the matrix row by row, the Earth's rate, and the bias, in this order.
    - causes: parts (15, 15) of the covariance, by name.
    - earth: the Earth's rate from the increments, or the Fault that says why it is not determined.
    - clock_s: the reference's attitude with the time stamp t belongs to the readings' time t + `clock_s`; clock_std_s:
      its standard deviation.
    - fix_std_rad: standard deviation of a fix about each axis.
    - random_walk_rad_sqrt_s: random walk of the gyroscope's angle.
    - matrix_scatter, bias_scatter_rad_s: standard deviation of each element between intervals of the recording.
    - residuals_rad (n, 3): the residuals of the increments.
    - aside_s (k,): start of each increment that was omitted as an outlier.
    - reset: time and angle of a rotation of all later attitudes relative to the earlier ones, as after a new origin;
      None if there is none.
    - condition: condition number of the scaled design.
    - iterations: number of Gauss-Newton steps.
    - change: an abrupt change, on the attitudes' clock, None if there is none; U covers both states of the gyroscope.
    """

    matrix: Array
    bias: Array
    covariance: Array
    causes: dict[str, Array]
    earth: EarthRateEstimate | Fault
    clock_s: float
    clock_std_s: float
    fix_std_rad: float
    random_walk_rad_sqrt_s: float
    matrix_scatter: float
    bias_scatter_rad_s: float
    residuals_rad: Array
    aside_s: Array
    condition: float
    iterations: int
    change: AbruptChange | None
    reset: tuple[float, float] | None = None

    @property
    def set_aside(self) -> int:
        """The number of increments omitted as outliers."""
        return len(self.aside_s)


@refusals.convergence_required()
def solve_known_increments(time_s: Array, readings: Array, fixes: Fixes, start: DriftState) -> IncrementSolution:
    """Return a gyroscope's matrix and bias from readings (n, 3) in rad/s at times (n,), without outlying increments.

    `start` holds the initial values of matrix, bias and clock. Raise Fault `rank_deficient`, `ill_conditioned`,
    `attitude_untrustworthy`, `clocks_apart`, `wrong_unit`, `mirrored_axis`.
    """
    recorded = AttitudeSamples(time_s, readings, fixes, np.ones(len(fixes.at_s), dtype=np.bool_))
    settled = _settle(recorded, start)
    for _ in range(OUTLIER_PASSES):
        outliers = _find_outliers(settled)
        if not outliers.any() or outliers.sum() > _limit_outliers(fixes):
            break
        joined = recorded.fixes.joined.copy()
        joined[np.flatnonzero(joined)[outliers]] = False
        recorded = replace(recorded, fixes=replace(recorded.fixes, joined=joined))
        settled = _settle(recorded, settled.state)
    _check(fixes, recorded.fixes, settled)
    aside = fixes.joined & ~recorded.fixes.joined
    result = _build_result(settled, _times_s(fixes, aside))
    _check_identified(result.matrix, result.covariance - result.causes[AXES])
    return replace(result, reset=find_reset(settled.averaged, fixes, aside, result.change))


@dataclass(frozen=True, slots=True)
class _ConvergedFit:
    """The converged fit and its model; `maxima` (n, k): k errors' standard deviations at n maxima of the posterior."""

    state: DriftState
    fixes: Fixes
    averaged: FixedAttitudes
    causes: DriftModel
    model: MixedModel
    maxima: Array
    solved: MixedFit
    iterations: int

    @property
    def std(self) -> Array:
        """The most probable standard deviations (k,)."""
        std: Array = self.maxima[0]
        return std


def _settle(recorded: AttitudeSamples, state: DriftState) -> _ConvergedFit:
    """Return the fit after Gauss–Newton steps from `state`; only the first steps re-estimate the variances."""
    maxima: Array | None = None
    for iteration in range(1, MAX_ITERATIONS + 1):
        averaged = average_fixes(recorded, state)
        if iteration == 2:
            recorded = replace(recorded, kept=find_inliers(recorded, averaged))
            averaged = average_fixes(recorded, state)
        causes = drift_model(averaged, recorded.fixes)
        model = MixedModel(causes.mixed)
        if iteration == 1:
            conditioning = _conditioning(model.mixed)
            refusals.check_conditioning(conditioning, BIAS.stop, MAX_CONDITION, "some of F and bias", REMEDY)
        if maxima is None or iteration == LAST_VARIANCE_ITERATION:
            maxima = model.find_maxima()
        elif iteration < LAST_VARIANCE_ITERATION:
            maxima = model.find_maxima(maxima[0])
        solved = model.solve(maxima[0])
        if not np.linalg.norm(solved.theta[MATRIX]) < MAX_MATRIX_STEP:
            raise refusals.untrustworthy_attitudes(refusals.NO_FIT)
        state = state.after_step(solved.theta)
        settled = _ConvergedFit(state, recorded.fixes, averaged, causes, model, maxima, solved, iteration)
        u = np.sqrt(np.diag(solved.covariance))[: CLOCK + 1]
        if iteration > 2 and (np.abs(solved.theta[: CLOCK + 1]) < CONVERGED_STEP_RATIO * u).all():
            break
    return settled  # pyrefly: ignore[unbound-name]  # MAX_ITERATIONS > 0


def _find_outliers(settled: _ConvergedFit) -> NDArray[np.bool_]:
    """Return a mask (n,) of increments far beyond the ninth decile of errors, which a few outliers cannot inflate."""
    expected = np.sqrt(np.diag(settled.model.covariance(settled.std)).reshape(-1, 3).max(axis=1))
    errors = np.abs(settled.solved.residuals.reshape(-1, 3)).max(axis=1)
    decile = float(np.quantile(errors / expected, 0.9))
    outliers: NDArray[np.bool_] = errors > np.maximum(OUTLIER_RATIO * decile * expected, MIN_OUTLIER_RAD)
    return outliers


def _limit_outliers(fixes: Fixes) -> float:
    """Return the greatest allowed number of outliers."""
    return max(MAX_OUTLIERS, MAX_OUTLIER_FRACTION * float(fixes.joined.sum()))


def _conditioning(mixed: Mixed) -> refusals.Conditioning:
    """Return the conditioning of the design, with its columns for matrix and bias scaled to the same size."""
    columns = mixed.design[:, : BIAS.stop]
    sizes = [np.linalg.norm(columns[:, block]) for block in (MATRIX, BIAS)]
    return refusals.condition_of(columns / np.repeat(sizes, [9, 3]), BIAS.stop)


def _check(fixes: Fixes, remaining: Fixes, settled: _ConvergedFit) -> None:
    """Raise a Fault if residuals, clock, outliers, precision or axes of the solution are implausible.

    The Faults are `attitude_untrustworthy`, `clocks_apart`, `ill_conditioned`, `wrong_unit`, `mirrored_axis`.
    """
    rms_rad = float(np.sqrt(np.mean(settled.solved.residuals**2)))
    if rms_rad > MAX_ATTITUDE_ERROR_RAD:
        raise refusals.untrustworthy_attitudes(f"the increments of attitudes and gyroscope differ by {rms_rad:.2g} rad")
    std_s = float(np.sqrt(settled.solved.covariance[CLOCK, CLOCK]))
    if abs(settled.state.clock_s) > MAX_CLOCK_STDS * CLOCK_STD_S + max(2 * std_s, CLOCK_ROUNDING_S):
        raise Fault(
            "clocks_apart",
            f"the estimated offset of the attitudes' clock is {1e3 * settled.state.clock_s:+.0f} ± {2e3 * std_s:.0f} "
            f"ms, but the largest allowed offset is {1e3 * MAX_CLOCK_STDS * CLOCK_STD_S:.0f} ms",
            "Write both files by one clock, or let --estimate-clock-offset find the difference",
        )
    # An increment that the fit has left out is no longer joined in `remaining`.
    left_out = np.flatnonzero(fixes.joined & ~remaining.joined)
    outliers = np.concatenate([left_out, np.flatnonzero(remaining.joined)[_find_outliers(settled)]])
    if len(outliers) > _limit_outliers(fixes):
        where_s = float(fixes.at_s[fixes.fix == outliers.min()][0])  # the first sample of the increment's first fix
        raise refusals.untrustworthy_attitudes(
            f"{len(outliers)} of {fixes.joined.sum()} increments contradict all others, the first after {where_s:.2f} s"
        )
    _check_identified(settled.state.matrix, settled.solved.covariance)
    refusals.check_unit(scale_of(settled.state.matrix))
    refusals.check_handedness(settled.state.matrix)


def _check_identified(matrix: Array, covariance: Array) -> None:
    """Raise Fault `ill_conditioned` if the `covariance` shows that the body hardly turned about some axis."""
    std = np.sqrt(np.diag(covariance)[MATRIX]).reshape(3, 3).max(axis=0)
    unknown = std > MAX_IDENTIFIABLE_STD
    if not unknown.any():
        return
    names = " and ".join("xyz"[axis] for axis in np.flatnonzero(unknown))
    sizes = np.linalg.norm(matrix, axis=0)
    identified = "; ".join(
        f"a turn about {'xyz'[axis]} reads {sizes[axis]:.4g} ± {2 * std[axis]:.1g} times as large"
        for axis in np.flatnonzero(~unknown)
    )
    cause = f"the body hardly turned about {names}" + ", or the attitudes contradict the readings" * bool(unknown.all())
    what = f"{cause}: the sensor's response to that is known to {std.max():.2g}"
    raise Fault("ill_conditioned", f"{what}{f'; {identified}' if identified else ''}", REMEDY)


def _times_s(fixes: Fixes, increments: NDArray[np.bool_]) -> Array:
    """Return the start times (k,) of the selected increments (N − 1,)."""
    first = np.searchsorted(fixes.fix, np.flatnonzero(increments))
    return np.asarray(fixes.at_s[first], dtype=np.float64)


def _build_result(settled: _ConvergedFit, aside_s: Array) -> IncrementSolution:
    """Return the result of a converged fit; its bias is the mean over the intervals of this recording.

    `aside_s` (k,) are the start times of the increments that were left out as outliers.
    """
    solved, state = settled.solved, settled.state
    wanted = np.eye(len(solved.theta))[np.r_[MATRIX, EARTH, BIAS]]
    half_width = settled.model.expand(settled.maxima, wanted)
    ratio = half_width / (2 * np.sqrt(np.einsum("qi,ij,qj->q", wanted, solved.covariance, wanted)))
    causes = {name: wanted @ cause @ wanted.T * ratio[:, None] * ratio for name, cause in _causes(settled).items()}
    causes[AXES] = _widen_by_axes(settled, wanted, np.sum(list(causes.values()), axis=0))
    change = find_increment_change(settled.model, settled.std, settled.averaged, settled.fixes, state.matrix)
    if change is not None:
        of_sensor = np.ix_(*2 * [np.r_[0:9, 12:15]])  # F and b, without the Earth's rate
        causes[INTERVAL_DIFFERENCES][of_sensor] += change.find_covariance(state.matrix)
    sizes = partial(settled.causes.std_of, std=settled.std)
    return IncrementSolution(
        matrix=state.matrix,
        bias=state.bias,
        covariance=np.sum(list(causes.values()), axis=0),
        causes=causes,
        earth=_earth(solved.theta[EARTH], solved.covariance[EARTH, EARTH]),
        clock_s=state.clock_s,
        clock_std_s=float(np.sqrt(solved.covariance[CLOCK, CLOCK])),
        fix_std_rad=float(np.sqrt(sum(sizes(cause) ** 2 for cause in (ATTITUDE_ERROR, VISIT_ERROR, MOTION_ERROR)))),
        random_walk_rad_sqrt_s=sizes(RANDOM_WALK),
        matrix_scatter=sizes(MATRIX_CHANGES),
        bias_scatter_rad_s=sizes(BIAS_CHANGES),
        residuals_rad=solved.residuals.reshape(-1, 3),
        aside_s=aside_s,
        condition=_conditioning(settled.model.mixed).condition,
        iterations=settled.iterations,
        change=change,
    )


def _widen_by_axes(settled: _ConvergedFit, wanted: Array, covariance: Array) -> Array:
    """Return the covariance (q, q) that inclined axes of the reference add to combinations `wanted` of parameters."""
    inclinations = find_inclinations(settled.averaged, settled.fixes, settled.state.matrix)
    return inclinations.widen(settled.model, settled.std, settled.solved, wanted, np.diag(covariance))


CAUSES_OF_CONTRIBUTOR = {
    ATTITUDES: (ATTITUDE_ERROR, VISIT_ERROR, REST_ERROR, MOTION_ERROR),
    DELAY: (JITTER, LOST_TIMES),
    INTERVAL_DIFFERENCES: (MATRIX_CHANGES, BIAS_CHANGES),
    NOISE: (RANDOM_WALK,),
}


def _causes(settled: _ConvergedFit) -> dict[str, Array]:
    """Return the parts of the parameters' covariance by contributor; a parameter's prior is part of its contributor."""
    covariance = settled.solved.covariance
    # First the part of the fixed covariance C₀, which is noise, and last that of all priors, which are added below.
    fixed, *parts, _ = settled.model.causes(settled.std, settled.solved)
    by_cause = dict(zip(settled.causes.causes, parts, strict=True))
    nothing = np.zeros_like(covariance)
    causes = {
        name: np.sum([by_cause.get(cause, nothing) for cause in group], axis=0)
        for name, group in CAUSES_OF_CONTRIBUTOR.items()
    }
    causes[NOISE] = causes[NOISE] + fixed
    causes[DELAY] = causes[DELAY] + np.outer(covariance[CLOCK], covariance[CLOCK]) * CLOCK_STD_S**-2.0
    causes[ATTITUDES] = causes[ATTITUDES] + covariance[:, MATRIX] * MATRIX_PRECISION @ covariance[MATRIX]
    causes[EARTH_RATE] = covariance[:, EARTH] * EARTH_PRECISION @ covariance[EARTH]
    return causes


def _earth(rate_rad_s: Array, covariance: Array) -> EarthRateEstimate | Fault:
    """Return the Earth's rate from the increments, with the prior of its norm removed, or a Fault if undetected."""
    information = np.linalg.inv(covariance)
    data_information: Array = information - EARTH_PRECISION * np.eye(3)
    data_information = data_information + 1e-9 * EARTH_PRECISION * np.eye(3)
    if np.linalg.eigvalsh(data_information)[0] <= 0:
        data_information = 1e-9 * EARTH_PRECISION * np.eye(3)
    variance = np.asarray(np.linalg.inv(data_information), dtype=np.float64)
    rate = variance @ information @ rate_rad_s
    return or_fault(partial(check_earth_rate, rate, variance)) or EarthRateEstimate(rate, variance)

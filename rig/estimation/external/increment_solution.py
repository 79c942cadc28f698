"""A gyroscope's matrix and bias from its rotations between attitudes of a reference: cameras, a table.

The reference's rates are not used: their noise would be among the regressors and bias the scale (errors in variables).
The rotation between fixes is used (`attitude_drift`), in which a gyroscope's noise grows only with the root of time.

The variances of the errors of fixes and gyroscope are estimated from the residuals (`variance_components`), and with
them those of matrix and bias between intervals of the recording: nonlinearity, g-sensitivity, temperature. Matrix and
bias are their means over the intervals, with the uncertainty by these variances.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault, or_fault
from rig.estimation import refusals
from rig.estimation.arrays import Array, scale_of
from rig.estimation.external.attitude_drift import (
    BIAS,
    CLOCK,
    CLOCK_STD_S,
    COMMON,
    EARTH,
    EARTH_PRECISION,
    MATRIX,
    AttitudeSamples,
    DriftState,
    Fixes,
    average_fixes,
    drift_model,
    find_inliers,
)
from rig.estimation.gyroscope.earth_rate import check_earth_seen
from rig.estimation.statistics.variance_components import (
    SPREAD,
    Mixed,
    MixedFit,
    MixedModel,
    VarianceComponents,
    inflate_to_student,
)

PASSES, SIZED = 12, 3  # iterations of the fit; those that estimate the variances
SETTLED = 1e-2  # of the standard uncertainty
OUTLIER, OUTLIER_RAD = 4.0, 1e-3  # an increment with errors above both is an outlier: ratio to the ninth decile; rad
SOME_OUTLIERS, MOST_OUTLIERS, SETTINGS_ASIDE = 4, 0.1, 3  # outliers, at most, and their fraction; passes
UNTRUSTWORTHY_RAD = 0.1  # larger errors: the attitudes are those of another body
STATED_SPREAD = 1.0  # of the logarithm of a stated standard deviation
MOST_CLOCK = 3.0  # prior standard deviations of a common clock's offset
UNIDENTIFIED = 0.1  # standard deviation of an unidentified element of F
LARGEST_STEP = 10.0  # of F: beyond, the fit diverges
MAX_CONDITION = 1e4
NOISE, ATTITUDES, DELAY = "noise", "attitudes", "delay between the files"
EARTHS_RATE, STRETCHES = "Earth's rate", "differences between stretches"
REMEDY = "Turn the body about all its axes, by a right angle and more"


@dataclass(frozen=True, slots=True)
class EarthSeen:
    """The Earth's rate (3,) in table coordinates and its covariance (3, 3), detected to a tenth."""

    rate_rad_s: Array
    covariance_rad2_s2: Array

    @property
    def std_rad_s(self) -> Array:
        """The standard deviations (3,)."""
        std: Array = np.sqrt(np.diag(self.covariance_rad2_s2))
        return std


@dataclass(frozen=True, slots=True)
class KnownIncrements:
    """A gyroscope's matrix and bias by its increments, with their covariance and variance components.

    - matrix (3, 3), bias (3,): F and b.
    - covariance (15, 15): of F row by row, ω_E, b.
    - causes: parts (15, 15) of the covariance, by name.
    - earth: the Earth's rate by the increments, or the fault.
    - clock_s, clock_std_s: τ, where the reference's attitude of the time t was that of t + τ.
    - fix_std_rad: error of a fix about each axis.
    - random_walk_rad_sqrt_s: random walk of the gyroscope's angle.
    - matrix_scatter, bias_scatter_rad_s: standard deviation of each element between intervals of the recording.
    - residuals_rad (n, 3): of the increments.
    - aside_s (k,): start of each outlier.
    - condition: of the scaled design.
    - iterations: number of Gauss-Newton steps.
    """

    matrix: Array
    bias: Array
    covariance: Array
    causes: dict[str, Array]
    earth: EarthSeen | Fault
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

    @property
    def set_aside(self) -> int:
        """The number of increments omitted as outliers."""
        return len(self.aside_s)


def solve_known_increments(time_s: Array, readings: Array, fixes: Fixes, start: Array) -> KnownIncrements:
    """Solve readings (n, 3) in rad/s at times (n,), beginning at F = `start` (3, 3) and b = 0.

    Raise Fault `rank_deficient`, `ill_conditioned`, `attitude_untrustworthy`, `clocks_apart`, `wrong_unit`,
    `mirrored_axis`.
    """
    recorded = AttitudeSamples(time_s, readings, fixes, np.ones(len(fixes.at_s), dtype=np.bool_))
    settled = _settle(recorded, DriftState(start, np.zeros(3), 0.0))
    for _ in range(SETTINGS_ASIDE):
        outliers = _find_outliers(settled)
        if not outliers.any() or outliers.sum() > _limit_outliers(fixes):
            break
        joined = recorded.fixes.joined.copy()
        joined[np.flatnonzero(joined)[outliers]] = False
        recorded = replace(recorded, fixes=replace(recorded.fixes, joined=joined))
        settled = _settle(recorded, settled.state)
    _check(fixes, recorded.fixes, settled)
    return _summarise(settled, _times_s(fixes, fixes.joined & ~recorded.fixes.joined))


@dataclass(frozen=True, slots=True)
class _Settled:
    """The converged fit, its model and its variance components."""

    state: DriftState
    model: MixedModel
    sizes: VarianceComponents
    solved: MixedFit
    iterations: int


def _settle(recorded: AttitudeSamples, state: DriftState) -> _Settled:
    """Solve by Gauss–Newton; the variances are re-estimated in the first iterations only."""
    sizes: VarianceComponents | None = None
    for iteration in range(1, PASSES + 1):
        averaged = average_fixes(recorded, state)
        if iteration == 2:
            recorded = replace(recorded, kept=find_inliers(recorded, averaged))
            averaged = average_fixes(recorded, state)
        model = MixedModel(drift_model(averaged, recorded.fixes))
        if iteration == 1:
            conditioning = _conditioning(model.mixed)
            refusals.check_conditioning(conditioning, BIAS.stop, MAX_CONDITION, "some of F and bias", REMEDY)
        if sizes is None or iteration <= SIZED:
            sizes = model.estimate_components(*_find_priors(model, recorded.fixes), start=sizes)
        solved = model.solve(sizes)
        if not np.linalg.norm(solved.theta[MATRIX]) < LARGEST_STEP:
            raise refusals.untrustworthy_attitudes(refusals.NO_FIT)
        state = state.after_step(solved.theta)
        settled = _Settled(state, model, sizes, solved, iteration)
        std = np.sqrt(np.diag(solved.covariance))[: CLOCK + 1]
        if iteration > 2 and (np.abs(solved.theta[: CLOCK + 1]) < SETTLED * std).all():
            break
    return settled


def _find_priors(model: MixedModel, fixes: Fixes) -> tuple[VarianceComponents, Array]:
    """Return prior standard deviations that share the residuals evenly, and the stds of their logarithms.

    If the reference's error is stated, that of a fix is about as large, or smaller by the mean over samples.
    """
    mixed = model.mixed
    common = mixed.design[:, :, :COMMON].reshape(-1, COMMON)
    flat = mixed.observed.reshape(-1)
    residuals = flat - common @ np.linalg.lstsq(common, flat, rcond=None)[0]
    rms = max(float(np.sqrt(np.mean(residuals**2))), 1e-9)
    of_fix, of_walk = (float(np.sqrt(np.mean(np.diag(matrix)))) for matrix in (mixed.scattered, mixed.walked))
    groups = (3e-4, 3e-4) if mixed.groups else ()
    log_std = np.full(2 + len(groups), SPREAD)
    fix_std = rms / of_fix
    if fixes.std_rad is not None and fixes.std_rad.any():
        samples = float(np.median(np.bincount(fixes.fix)))
        fix_std = float(np.median(fixes.std_rad[fixes.std_rad > 0])) / samples**0.25
        log_std[0] = STATED_SPREAD + np.log(samples) / 4
    return VarianceComponents(fix_std, rms / of_walk, groups), log_std


def _find_outliers(settled: _Settled) -> NDArray[np.bool_]:
    """Return the increments (n,) far beyond the ninth decile of errors, a quantile that few outliers do not change."""
    mixed, sizes = settled.model.mixed, settled.sizes
    variances = sizes.scattered**2 * np.diag(mixed.scattered) + sizes.walked**2 * np.diag(mixed.walked)
    errors, expected = np.abs(settled.solved.residuals).max(axis=1), np.sqrt(variances)
    decile = float(np.quantile(errors / expected, 0.9))
    outliers: NDArray[np.bool_] = errors > np.maximum(OUTLIER * decile * expected, OUTLIER_RAD)
    return outliers


def _limit_outliers(fixes: Fixes) -> float:
    """Return the greatest allowed number of outliers."""
    return max(SOME_OUTLIERS, MOST_OUTLIERS * float(fixes.joined.sum()))


def _conditioning(mixed: Mixed) -> refusals.Conditioning:
    """Return the conditioning of the design with F and b scaled alike."""
    columns = mixed.design[:, :, : BIAS.stop].reshape(-1, BIAS.stop)
    sizes = [np.linalg.norm(columns[:, block]) for block in (MATRIX, BIAS)]
    return refusals.condition_of(columns / np.repeat(sizes, [9, 3]), BIAS.stop)


def _check(fixes: Fixes, remaining: Fixes, settled: _Settled) -> None:
    """Raise Fault `attitude_untrustworthy`, `clocks_apart`, `ill_conditioned`, `wrong_unit`, `mirrored_axis`."""
    rms_rad = float(np.sqrt(np.mean(settled.solved.residuals**2)))
    if rms_rad > UNTRUSTWORTHY_RAD:
        raise refusals.untrustworthy_attitudes(f"the increments of attitudes and gyroscope differ by {rms_rad:.2g} rad")
    outliers = np.concatenate(
        [np.flatnonzero(fixes.joined & ~remaining.joined), np.flatnonzero(remaining.joined)[_find_outliers(settled)]]
    )
    if abs(settled.state.clock_s) > MOST_CLOCK * CLOCK_STD_S:
        std_s = float(np.sqrt(settled.solved.covariance[CLOCK, CLOCK]))
        raise Fault(
            "clocks_apart",
            f"the attitudes' clock comes out {1e3 * settled.state.clock_s:+.0f} ± {2e3 * std_s:.0f} ms off the "
            f"readings', and {1e3 * MOST_CLOCK * CLOCK_STD_S:.0f} ms is the most that is allowed for",
            "Write both files by one clock, or let --estimate-clock-offset find the difference",
        )
    if len(outliers) > _limit_outliers(fixes):
        where_s = float(fixes.at_s[np.searchsorted(fixes.fix, outliers.min())])
        raise refusals.untrustworthy_attitudes(
            f"{len(outliers)} of {fixes.joined.sum()} increments contradict all others, the first after {where_s:.2f} s"
        )
    worst = float(np.sqrt(np.diag(settled.solved.covariance)[MATRIX].max()))
    if worst > UNIDENTIFIED:
        raise Fault("ill_conditioned", f"an element of F is only known to {worst:.2g}", REMEDY)
    refusals.check_unit(scale_of(settled.state.matrix))
    refusals.check_handedness(settled.state.matrix)


def _times_s(fixes: Fixes, increments: NDArray[np.bool_]) -> Array:
    """Return the start (k,) of some of the increments (N − 1,)."""
    first = np.searchsorted(fixes.fix, np.flatnonzero(increments))
    return np.asarray(fixes.at_s[first], dtype=np.float64)


def _summarise(settled: _Settled, aside_s: Array) -> KnownIncrements:
    """Return the result of a converged fit; the bias is the mean over this recording's intervals."""
    solved, sizes, state = settled.solved, settled.sizes, settled.state
    # The matrix is that of any recording, the bias the mean over this one.
    intervals = (len(solved.theta) - COMMON) // 12
    combinations = np.eye(len(solved.theta))[np.r_[MATRIX, EARTH, BIAS]]
    for interval in range(intervals):
        combinations[12:, COMMON + 12 * interval :][:, BIAS] = np.eye(3) / intervals
    residual_dof = solved.residuals.size - BIAS.stop - 1  # less F, b and the clock
    dof = np.minimum(settled.model.dof(sizes, combinations), residual_dof)
    causes = {
        name: inflate_to_student(combinations @ cause @ combinations.T, dof) for name, cause in _causes(settled).items()
    }
    return KnownIncrements(
        matrix=state.matrix,
        bias=state.bias + combinations[12:, COMMON:] @ solved.theta[COMMON:],
        covariance=np.sum(list(causes.values()), axis=0),
        causes=causes,
        earth=_earth(solved.theta[EARTH], solved.covariance[EARTH, EARTH]),
        clock_s=state.clock_s,
        clock_std_s=float(np.sqrt(solved.covariance[CLOCK, CLOCK])),
        fix_std_rad=sizes.scattered,
        random_walk_rad_sqrt_s=sizes.walked,
        matrix_scatter=sizes.groups[0] if sizes.groups else 0.0,
        bias_scatter_rad_s=sizes.groups[1] if sizes.groups else 0.0,
        residuals_rad=solved.residuals,
        aside_s=aside_s,
        condition=_conditioning(settled.model.mixed).condition,
        iterations=settled.iterations,
    )


def _causes(settled: _Settled) -> dict[str, Array]:
    """Return the parts of θ's covariance by the estimated errors and by the priors of θ itself."""
    covariance = settled.solved.covariance
    attitudes, noise = settled.model.causes(settled.sizes, covariance)
    precision = np.zeros(len(covariance))
    precision[CLOCK], precision[EARTH] = CLOCK_STD_S**-2.0, EARTH_PRECISION
    for group, size in zip(settled.model.mixed.groups, settled.sizes.groups, strict=True):
        precision[group] = size**-2.0
    return {
        NOISE: noise,
        ATTITUDES: attitudes,
        DELAY: np.outer(covariance[CLOCK], covariance[CLOCK]) * precision[CLOCK],
        EARTHS_RATE: covariance[:, EARTH] * precision[EARTH] @ covariance[EARTH],
        STRETCHES: covariance[:, COMMON:] * precision[COMMON:] @ covariance[COMMON:],
    }


def _earth(rate_rad_s: Array, covariance: Array) -> EarthSeen | Fault:
    """Return the Earth's rate by the increments without the prior of its norm, or the Fault if it is not detected."""
    information = np.linalg.inv(covariance)
    data_information: Array = information - EARTH_PRECISION * np.eye(3)
    data_information = data_information + 1e-9 * EARTH_PRECISION * np.eye(3)
    if np.linalg.eigvalsh(data_information)[0] <= 0:
        data_information = 1e-9 * EARTH_PRECISION * np.eye(3)
    variance = np.asarray(np.linalg.inv(data_information), dtype=np.float64)
    rate = variance @ information @ rate_rad_s
    return or_fault(partial(check_earth_seen, rate, variance)) or EarthSeen(rate, variance)

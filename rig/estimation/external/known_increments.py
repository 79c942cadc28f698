"""A gyroscope's matrix and bias from how it turned between attitudes that a reference tells: cameras, a table.

The reference's rates are not used: their noise would stand among what is exact, and make the scale too small. What
counts is how far the body turned (`attitude_drift`), and there a gyroscope's noise grows with the root of time only.

How large the errors of fixes and gyroscope are is found from what is left (`variance_components`), and with them by
how much matrix and bias differ from one stretch of the recording to the next: nonlinearity, sensitivity to gravity,
warming. Matrix and bias are their means over the stretches, and as uncertain as these say.
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
    Fixes,
    Recorded,
    State,
    drift_model,
    looks_kept,
    seen,
)
from rig.estimation.gyroscope.earth_rate import check_earth_seen
from rig.estimation.statistics.variance_components import SPREAD, Mixed, MixedModel, Sizes, Solved, widened

PASSES, SIZED = 12, 3  # of the fit; of these, how many find the sizes anew
SETTLED = 1e-2  # of the standard uncertainty
ODD, ODD_RAD = 4.0, 1e-3  # an increment off by so many times the ninth decile, and by so much, is none of the body's
SOME_ODD, MOST_ODD, SETTINGS_ASIDE = 4, 0.1, 3  # so many may be, or such a share; passes
UNTRUSTWORTHY_RAD = 0.1  # increments that are further off are those of another body
STATED_SPREAD = 1.0  # of the logarithm of a stated standard deviation
MOST_CLOCK = 3.0  # standard deviations of what the clocks may be apart: beyond, they are not one
UNTOLD = 0.1  # standard deviation of an element of F that nothing has told
LARGEST_STEP = 10.0  # of F: beyond, nothing converges
MAX_CONDITION = 1e4
NOISE, ATTITUDES, DELAY = "noise", "attitudes", "delay between the files"
EARTHS_RATE, STRETCHES = "Earth's rate", "differences between stretches"
REMEDY = "Turn the body about all its axes, by a right angle and more"


@dataclass(frozen=True, slots=True)
class EarthSeen:
    """The Earth's rate (3,) in table coordinates and its covariance (3, 3), seen to a tenth."""

    rate_rad_s: Array
    covariance_rad2_s2: Array

    @property
    def std_rad_s(self) -> Array:
        """Standard deviations (3,)."""
        std: Array = np.sqrt(np.diag(self.covariance_rad2_s2))
        return std


@dataclass(frozen=True, slots=True)
class KnownIncrements:
    """`matrix` F (3, 3) and `bias` b (3,) with their `covariance` (15, 15) [F row by row, ω_E, b], and what else is.

    - `causes`, by name, what the covariance is the sum of (15, 15).
    - `earth` what the increments say of the Earth's rate, or why they do not.
    - `clock_s`: the reference's attitude of the moment t was that of t + τ; `clock_std_s`.
    - `fix_std_rad`: error of a fix about each axis; `random_walk_rad_sqrt_s` of the gyroscope's angle.
    - `matrix_scatter`, `bias_scatter_rad_s`: how differently stretches of the recording read, each element.
    - `residuals_rad` (n, 3) of the increments; `aside_s` (k,) when each of those began that contradicted all others.
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
        """How many increments were left out, for they contradicted all others."""
        return len(self.aside_s)


def solve_known_increments(time_s: Array, readings: Array, fixes: Fixes, start: Array) -> KnownIncrements:
    """Solve readings (n, 3) in rad/s at times (n,), beginning at F = `start` (3, 3) and b = 0.

    Raises Fault `rank_deficient`, `ill_conditioned`, `attitude_untrustworthy`, `clocks_apart`, `wrong_unit`,
    `mirrored_axis`.
    """
    recorded = Recorded(time_s, readings, fixes, np.ones(len(fixes.at_s), dtype=np.bool_))
    settled = _settle(recorded, State(start, np.zeros(3), 0.0))
    for _ in range(SETTINGS_ASIDE):
        odd = _odd(settled)
        if not odd.any() or odd.sum() > _may_be_odd(fixes):
            break
        joined = recorded.fixes.joined.copy()
        joined[np.flatnonzero(joined)[odd]] = False
        recorded = replace(recorded, fixes=replace(recorded.fixes, joined=joined))
        settled = _settle(recorded, settled.state)
    _check(fixes, recorded.fixes, settled)
    return _found(settled, _times_s(fixes, fixes.joined & ~recorded.fixes.joined))


@dataclass(frozen=True, slots=True)
class _Settled:
    state: State
    model: MixedModel
    sizes: Sizes
    solved: Solved
    iterations: int


def _settle(recorded: Recorded, state: State) -> _Settled:
    """Solve by Gauss–Newton; the sizes are found anew while the parameters still move much."""
    sizes: Sizes | None = None
    for iteration in range(1, PASSES + 1):
        there = seen(recorded, state)
        if iteration == 2:
            recorded = replace(recorded, kept=looks_kept(recorded, there))
            there = seen(recorded, state)
        model = MixedModel(drift_model(there, recorded.fixes))
        if iteration == 1:
            told = _conditioning(model.mixed)
            refusals.check_conditioning(told, BIAS.stop, MAX_CONDITION, "some of F and bias", REMEDY)
        if sizes is None or iteration <= SIZED:
            sizes = model.likeliest(*_expected(model, recorded.fixes), start=sizes)
        solved = model.solve(sizes)
        if not np.linalg.norm(solved.theta[MATRIX]) < LARGEST_STEP:
            raise refusals.untrustworthy_attitudes(refusals.NO_FIT)
        state = state.moved(solved.theta)
        settled = _Settled(state, model, sizes, solved, iteration)
        std = np.sqrt(np.diag(solved.covariance))[: CLOCK + 1]
        if iteration > 2 and (np.abs(solved.theta[: CLOCK + 1]) < SETTLED * std).all():
            break
    return settled


def _expected(model: MixedModel, fixes: Fixes) -> tuple[Sizes, Array]:
    """Sizes as if half of what equal weights leave were the fixes' and half the gyroscope's; how far off that may be.

    Where the reference's error is stated, that of a fix is about it, or less by what many looks make of it.
    """
    mixed = model.mixed
    common = mixed.design[:, :, :COMMON].reshape(-1, COMMON)
    flat = mixed.observed.reshape(-1)
    left = flat - common @ np.linalg.lstsq(common, flat, rcond=None)[0]
    size = max(float(np.sqrt(np.mean(left**2))), 1e-9)
    apart, walked = (float(np.sqrt(np.mean(np.diag(each)))) for each in (mixed.scattered, mixed.walked))
    groups = (3e-4, 3e-4) if mixed.groups else ()
    spread = np.full(2 + len(groups), SPREAD)
    scattered = size / apart
    if fixes.std_rad is not None and fixes.std_rad.any():
        looks = float(np.median(np.bincount(fixes.fix)))
        scattered = float(np.median(fixes.std_rad[fixes.std_rad > 0])) / looks**0.25
        spread[0] = STATED_SPREAD + np.log(looks) / 4
    return Sizes(scattered, size / walked, groups), spread


def _odd(settled: _Settled) -> NDArray[np.bool_]:
    """(n,) increments that contradict all others: far beyond what nine of ten keep to, by whatever they inflate."""
    mixed, sizes = settled.model.mixed, settled.sizes
    variances = sizes.scattered**2 * np.diag(mixed.scattered) + sizes.walked**2 * np.diag(mixed.walked)
    off, expected = np.abs(settled.solved.residuals).max(axis=1), np.sqrt(variances)
    usual = float(np.quantile(off / expected, 0.9))
    found: NDArray[np.bool_] = off > np.maximum(ODD * usual * expected, ODD_RAD)
    return found


def _may_be_odd(fixes: Fixes) -> float:
    return max(SOME_ODD, MOST_ODD * float(fixes.joined.sum()))


def _conditioning(mixed: Mixed) -> refusals.Conditioning:
    """Conditioning of the design with F and b brought to one size."""
    told = mixed.design[:, :, : BIAS.stop].reshape(-1, BIAS.stop)
    sizes = [np.linalg.norm(told[:, each]) for each in (MATRIX, BIAS)]
    return refusals.condition_of(told / np.repeat(sizes, [9, 3]), BIAS.stop)


def _check(given: Fixes, left: Fixes, settled: _Settled) -> None:
    """Raises Fault `attitude_untrustworthy`, `clocks_apart`, `ill_conditioned`, `wrong_unit`, `mirrored_axis`."""
    off = float(np.sqrt(np.mean(settled.solved.residuals**2)))
    if off > UNTRUSTWORTHY_RAD:
        raise refusals.untrustworthy_attitudes(f"the increments of attitudes and gyroscope differ by {off:.2g} rad")
    odd = np.concatenate([np.flatnonzero(given.joined & ~left.joined), np.flatnonzero(left.joined)[_odd(settled)]])
    if abs(settled.state.clock_s) > MOST_CLOCK * CLOCK_STD_S:
        std_s = float(np.sqrt(settled.solved.covariance[CLOCK, CLOCK]))
        raise Fault(
            "clocks_apart",
            f"the attitudes' clock comes out {1e3 * settled.state.clock_s:+.0f} ± {2e3 * std_s:.0f} ms off the "
            f"readings', and {1e3 * MOST_CLOCK * CLOCK_STD_S:.0f} ms is the most that is allowed for",
            "Write both files by one clock, or let --estimate-clock-offset find the difference",
        )
    if len(odd) > _may_be_odd(given):
        where_s = float(given.at_s[np.searchsorted(given.fix, odd.min())])
        raise refusals.untrustworthy_attitudes(
            f"{len(odd)} of {given.joined.sum()} increments contradict all others, the first after {where_s:.2f} s"
        )
    worst = float(np.sqrt(np.diag(settled.solved.covariance)[MATRIX].max()))
    if worst > UNTOLD:
        raise Fault("ill_conditioned", f"an element of F is only known to {worst:.2g}", REMEDY)
    refusals.check_unit(scale_of(settled.state.matrix))
    refusals.check_handedness(settled.state.matrix)


def _times_s(fixes: Fixes, increments: NDArray[np.bool_]) -> Array:
    """(k,) when some of the increments (N − 1,) begin."""
    first = np.searchsorted(fixes.fix, np.flatnonzero(increments))
    return np.asarray(fixes.at_s[first], dtype=np.float64)


def _found(settled: _Settled, aside_s: Array) -> KnownIncrements:
    solved, sizes, state = settled.solved, settled.sizes, settled.state
    # The matrix is what any recording would show, the bias its mean over this one.
    stretches = (len(solved.theta) - COMMON) // 12
    wanted = np.eye(len(solved.theta))[np.r_[MATRIX, EARTH, BIAS]]
    for each in range(stretches):
        wanted[12:, COMMON + 12 * each :][:, BIAS] = np.eye(3) / stretches
    residual_freedom = solved.residuals.size - BIAS.stop - 1  # less F, b and the clock
    freedom = np.minimum(settled.model.freedom(sizes, wanted), residual_freedom)
    causes = {name: widened(wanted @ cause @ wanted.T, freedom) for name, cause in _causes(settled).items()}
    return KnownIncrements(
        matrix=state.matrix,
        bias=state.bias + wanted[12:, COMMON:] @ solved.theta[COMMON:],
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
    """What θ's covariance is made of: the errors that were found, and what is not known of θ itself."""
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
    """What the increments alone say, without what is known of its size."""
    information = np.linalg.inv(covariance)
    told: Array = information - EARTH_PRECISION * np.eye(3)
    told = told + 1e-9 * EARTH_PRECISION * np.eye(3)
    if np.linalg.eigvalsh(told)[0] <= 0:
        told = 1e-9 * EARTH_PRECISION * np.eye(3)
    spread = np.asarray(np.linalg.inv(told), dtype=np.float64)
    rate = spread @ information @ rate_rad_s
    return or_fault(partial(check_earth_seen, rate, spread)) or EarthSeen(rate, spread)

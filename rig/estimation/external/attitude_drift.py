"""How a gyroscope's attitude drifts off the one that a reference tells, as a linear model of what makes it drift.

    E(t) = R(t + τ) C(t)ᵀ          R: body → table by the reference, C: body → first reading by the gyroscope

would stand still if all were right: it takes the first reading's coordinates to the table's. It moves by

    E(t₁)ᵀ E(t₂) = exp(ΔS δθ + Δ(C ω) τ − Eᵀ ω_E Δt + e)

with S the course's sensitivity to F and b (`increments`), τ by how much the reference's clock is late, ω_E the Earth's
rate in table coordinates. A fix is the mean of E over a window, so that every look counts, and colour of the
reference's error within a window does no harm. Each e has the errors of two fixes, which neighbours share, and what the
gyroscope's white noise adds on the way.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.gyroscope.increments import course
from rig.estimation.statistics.bias_process import walk_covariance
from rig.estimation.statistics.variance_components import Mixed

MATRIX, BIAS, CLOCK, EARTH, COMMON = slice(0, 9), slice(9, 12), 12, slice(13, 16), 16
CLOCK_STD_S = 0.05  # what two clocks said to be one may be apart: cameras' exposure, a sensor's filter
EARTH_PRECISION = 3 / EARTH_RATE_RAD_S**2  # its size is known, where it points to is not
STRETCHES, FEWEST_OF_STRETCH = 6, 5  # of the recording; increments in one
OUTLYING, LOOKS_TO_TELL = 6.0, 10  # times the median of a fix' looks: no look at the body; of so many at least
BEST = 1e-3  # what is stated to be exact is at least so much of the usual


@dataclass(frozen=True, slots=True)
class Fixes:
    """What a reference says of the attitude: k looks, gathered into N fixes.

    - `at_s` (k,) rising, `attitudes` (k, 3, 3) body to table, `fix` (k,) to which fix each look belongs.
    - `placement` (N,): fixes with one number share one error: a body that lay still.
    - `joined` (N − 1,): whether the gyroscope can be followed from one fix to the next.
    - `std_rad` (k,) of each look as it is stated, None where nothing is.
    """

    at_s: Array
    attitudes: Array
    fix: NDArray[np.intp]
    placement: NDArray[np.intp]
    joined: NDArray[np.bool_]
    std_rad: Array | None = None


@dataclass(frozen=True, slots=True)
class Recorded:
    """What was recorded, and which looks (k,) count."""

    time_s: Array
    readings: Array
    fixes: Fixes
    kept: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class State:
    """F (3, 3), b (3,), τ."""

    matrix: Array
    bias: Array
    clock_s: float

    def moved(self, theta: Array) -> "State":
        matrix = self.matrix + theta[MATRIX].reshape(3, 3)
        return State(matrix, self.bias + theta[BIAS], self.clock_s + float(theta[CLOCK]))


@dataclass(frozen=True, slots=True)
class Seen:
    """N fixes: E (N, 3, 3), S (N, 3, 12), C ω (N, 3), their middle times (N,) and windows (N, 2); E of all looks."""

    attitudes: Array
    sensitivities: Array
    turning: Array
    middles_s: Array
    windows_s: Array
    looks: Array


def seen(recorded: Recorded, state: State) -> Seen:
    fixes, time_s = recorded.fixes, recorded.time_s
    at_s = np.clip(fixes.at_s + state.clock_s, time_s[0], time_s[-1])
    there = course(time_s, recorded.readings, state.matrix, state.bias, at_s)
    looks = fixes.attitudes @ np.swapaxes(there.attitudes, -1, -2)
    turning = (there.attitudes @ there.rates_rad_s[..., None])[..., 0]
    count = len(fixes.placement)
    worth = recorded.kept / _relative(fixes) ** 2
    weights = worth / np.bincount(fixes.fix, weights=worth, minlength=count)[fixes.fix]

    def mean(values: Array) -> Array:
        total = np.zeros((count, *values.shape[1:]))
        np.add.at(total, fixes.fix, values * weights.reshape(-1, *[1] * (values.ndim - 1)))
        return total

    left, _, right = np.linalg.svd(mean(looks))
    left[..., -1] *= np.linalg.det(left @ right)[:, None]
    first, last = (np.searchsorted(fixes.fix, np.arange(count), side=side) for side in ("left", "right"))
    return Seen(
        left @ right,
        mean(there.sensitivities),
        mean(turning),
        mean(fixes.at_s),
        np.column_stack([fixes.at_s[first], fixes.at_s[last - 1]]),
        looks,
    )


def _relative(fixes: Fixes) -> Array:
    """(k,) how much worse each look is than the usual one, as stated."""
    if fixes.std_rad is None or not fixes.std_rad.any():
        return np.ones(len(fixes.at_s))
    usual = float(np.median(fixes.std_rad[fixes.std_rad > 0]))
    return np.maximum(fixes.std_rad / usual, BEST)


def looks_kept(recorded: Recorded, seen: Seen) -> NDArray[np.bool_]:
    """(k,) looks that are not far from all others of their fix: a marker taken for another is none."""
    fix = recorded.fixes.fix
    away = np.linalg.norm(rotation_vectors(np.swapaxes(seen.attitudes[fix], -1, -2) @ seen.looks), axis=1)
    order = np.lexsort((away, fix))
    count = np.bincount(fix)
    first = np.cumsum(count) - count
    middle = away[order][first + count // 2]
    kept: NDArray[np.bool_] = (count[fix] < LOOKS_TO_TELL) | (away <= OUTLYING * middle[fix])
    return kept


def drift_model(seen: Seen, fixes: Fixes) -> Mixed:
    joined = np.flatnonzero(fixes.joined)
    count, made = len(fixes.placement), len(joined)
    step = np.zeros((made, count))
    step[np.arange(made), joined], step[np.arange(made), joined + 1] = -1.0, 1.0
    before = np.swapaxes(seen.attitudes[joined], -1, -2)
    observed = rotation_vectors(before @ seen.attitudes[joined + 1])
    sensitivities, turning = (np.tensordot(step, each, 1) for each in (seen.sensitivities, seen.turning))
    earth = -before * (step @ seen.middles_s)[:, None, None]
    stretches = made // FEWEST_OF_STRETCH if made < STRETCHES * FEWEST_OF_STRETCH else STRETCHES
    of = np.arange(made) * stretches // made if stretches > 1 else np.zeros(made)
    own = [sensitivities * (of == each)[:, None, None] for each in range(stretches if stretches > 1 else 0)]
    design = np.concatenate([sensitivities, turning[..., None], earth, *own], axis=2)
    precision = np.zeros(design.shape[2])
    precision[CLOCK] = CLOCK_STD_S**-2.0
    precision[EARTH] = EARTH_PRECISION
    columns = np.arange(COMMON, design.shape[2]).reshape(-1, 12)
    groups = (columns[:, MATRIX].ravel(), columns[:, BIAS].ravel()) if own else ()
    first = np.searchsorted(fixes.fix, np.arange(count))
    worse = _relative(fixes)[first]
    same = (fixes.placement[:, None] == fixes.placement) * worse[:, None] * worse
    walked = walk_covariance(seen.windows_s)
    return Mixed(observed, design, step @ same @ step.T, step @ walked @ step.T, precision, groups)

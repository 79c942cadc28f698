"""A bias that does not stand still: flicker, a random walk, and what scatters from one average to the next.

The readings are averaged over windows. A random walk of rate q (rad/s per √s) makes the bias of a later window differ
from that of an earlier one the more the farther they are apart; flicker noise is between that and a scatter s that has
no memory. How much of flicker a part of its kind has is known, for few averages tell it; walk and scatter beside that
are found from the averages themselves by restricted maximum likelihood (Patterson and Thompson, Biometrika 58 (1971)
545), the likelihood of what no value of the fitted parameters changes in them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array

STEPS = 25  # of either size on its grid
PRICE = 1.0  # of walk, and of scatter, in the logarithm of the likelihood
SPAN = 300.0  # largest size over the smallest that is looked at
CHANGED = float(np.sqrt(2))  # times its Allan deviation, by which flicker changes from one mean to the next

# (2,) walk and scatter, of sizes (K, 2) and the logarithms of their likelihoods (K,).
Chosen = Callable[[Array, Array], Array]


@dataclass(frozen=True, slots=True)
class BiasProcess:
    """How the bias wanders: `walk_rad_s_sqrt_s` (q) and `scatter_rad_s` (s), zero where nothing but noise was seen.

    `freedom` is how many differences these were found from, `instability_rad_s` the Allan deviation
    that its flicker is known to have.
    """

    walk_rad_s_sqrt_s: float
    scatter_rad_s: float
    freedom: int
    instability_rad_s: float = 0.0

    @property
    def found(self) -> bool:
        """Whether more than noise and the known was seen."""
        return self.walk_rad_s_sqrt_s > 0.0 or self.scatter_rad_s > 0.0

    @property
    def steady(self) -> bool:
        """Whether there is nothing but noise."""
        return not self.found and self.instability_rad_s == 0.0

    def covariance(self, windows_s: ArrayLike) -> Array:
        """(N, N) covariance that it adds to means over windows (N, 2), about the mean bias over all they span."""
        walked = self.walk_rad_s_sqrt_s**2 * walk_covariance(windows_s)
        found: Array = walked + self.scatter_rad_s**2 * np.eye(len(walked))
        return found if self.instability_rad_s == 0.0 else found + _flicker(self.instability_rad_s, windows_s)

    def wandered_rad_s(self, duration_s: float) -> float:
        """Standard deviation of the change of the bias in so much time."""
        flickered_rad_s = CHANGED * self.instability_rad_s
        return float(
            np.hypot(self.walk_rad_s_sqrt_s * np.sqrt(duration_s), np.hypot(self.scatter_rad_s, flickered_rad_s))
        )


def walk_covariance(windows_s: ArrayLike) -> Array:
    """(N, N) covariance of the means of a random walk of rate 1 over windows (N, 2) [start, end] that do not overlap.

    Counted from the walk's mean over the whole time from the first start to the last end.
    """
    windows = np.asarray(windows_s, dtype=np.float64)
    start, end = (windows - windows.min()).T
    span = float(end.max())
    middle, length = (start + end) / 2, end - start
    together = np.minimum.outer(middle, middle)  # the earlier window lies before all of the later one
    np.fill_diagonal(together, start + length / 3)
    with_mean = middle - (start**2 + start * end + end**2) / (6 * span)
    covariance: Array = together - with_mean[:, None] - with_mean[None, :] + span / 3
    return covariance


def flicker_covariance(windows_s: ArrayLike) -> Array:
    """(N, N) covariance of the means of flicker noise, whose Allan deviation is 1, over windows (N, 2) [start, end].

    Values a time τ apart vary together by −ln(τ)/(2 ln 2), but for a constant without end: that deviation is the one of
    noise of power B²/(2π f), B √(2 ln 2/π) (IEEE Std 952-1997, C.1.3). Counted from the mean over the whole time from
    the first start to the last end there is no such constant.
    """
    windows = np.asarray(windows_s, dtype=np.float64)
    whole = [windows.min(), windows.max()]
    start, end = np.vstack([windows, whole]).T
    between = (
        _twice_integrated_logarithm(end[:, None] - start)
        - _twice_integrated_logarithm(start[:, None] - start)
        - _twice_integrated_logarithm(end[:, None] - end)
        + _twice_integrated_logarithm(start[:, None] - end)
    )
    together = -between / np.outer(end - start, end - start) / (2 * np.log(2))
    covariance: Array = together[:-1, :-1] - together[:-1, -1:] - together[-1:, :-1] + together[-1, -1]
    return covariance


def _twice_integrated_logarithm(x: Array) -> Array:
    """The logarithm of |x| integrated twice: x² (2 ln |x| − 3) / 4."""
    squares = x**2
    logarithms = np.log(squares, out=np.zeros_like(squares), where=squares > 0)
    integrated: Array = squares * (logarithms - 3) / 4
    return integrated


def _flicker(instability_rad_s: float, windows_s: ArrayLike) -> Array:
    covariance: Array = instability_rad_s**2 * flicker_covariance(windows_s)
    return covariance


def expected(sizes: Array, likelihood: Array) -> Array:
    """(2,) mean of sizes (K, 2), each as likely as it makes the averages.

    Before, each was as likely to be there as not, and of any order of magnitude. The likeliest sizes would by chance be
    far too small in one run and too large in the next, and so would be every uncertainty.
    """
    belief = likelihood - np.log(STEPS) * np.count_nonzero(sizes, axis=1)
    weights = np.exp(belief - belief.max())
    return np.asarray(weights @ sizes / weights.sum(), dtype=np.float64)


def walking(sizes: Array, likelihood: Array) -> Array:
    """(2,) root of the mean of the squares of sizes (K, 2): a walk of any size alike, a scatter as in `expected`.

    For parameters that stand over a long time, as slopes over temperature do: most of their uncertainty may be of a
    walk that the averages hardly show. So there is one, of any size alike before (Gelman, Bayesian Analysis 1 (2006)
    515), and the covariance is the mean of those of all sizes. They stand on a grid of powers, so a size is as likely
    before as the step to the next one is long.
    """
    belief = likelihood - np.log(STEPS) * np.count_nonzero(sizes[:, 1:], axis=1)
    weights = sizes[:, 0] * np.exp(belief - belief.max())
    return np.asarray(np.sqrt(weights @ sizes**2 / weights.sum()), dtype=np.float64)


def likeliest(sizes: Array, likelihood: Array) -> Array:
    """(2,) likeliest of sizes (K, 2), zero where they do not make the averages likelier by Akaike's price.

    It holds no walk where noise alone would do: what is held against it is not excused by what is not there.
    """
    return np.asarray(sizes[np.argmax(likelihood - PRICE * np.count_nonzero(sizes, axis=1))], dtype=np.float64)


def bias_process(
    design: ArrayLike,
    means_rad_s: ArrayLike,
    variances_rad2_s2: ArrayLike,
    windows_s: ArrayLike,
    shared_rad2_s2: Array | None = None,
    *,
    instability_rad_s: float = 0.0,
    chosen: Chosen = expected,
) -> BiasProcess:
    """The process behind the mean readings (N, 3), which without it are `design` (N, p) × parameters + noise.

    `variances_rad2_s2` (N, 3) are those of the noise, `windows_s` (N, 2) when was averaged. One process for the three
    axes, so that few averages tell it. `shared_rad2_s2` (3, N, N) are covariances of what the averages have in common
    beside their noise, `instability_rad_s` is what is known of the part, zero where nothing is. Walk and scatter are
    those `chosen` of all sizes.
    """
    z, means, variances = (np.asarray(a, dtype=np.float64) for a in (design, means_rad_s, variances_rad2_s2))
    freedom = 3 * (len(z) - z.shape[1])
    if freedom < 3:
        return BiasProcess(0.0, 0.0, max(freedom, 0), instability_rad_s)
    free = np.linalg.qr(z, mode="complete")[0][:, z.shape[1] :].T  # to which the parameters are nothing
    unit = walk_covariance(windows_s)
    flicker = _flicker(instability_rad_s, windows_s) if instability_rad_s else np.zeros(unit.shape)
    typical = float(np.median(variances))
    grid = np.concatenate([[0.0], typical * np.geomspace(SPAN**-0.5, SPAN, STEPS) ** 2])
    walks = grid / float(np.median(np.diag(unit)))
    squares = np.array([(walk, scatter) for walk in walks for scatter in grid])
    likelihood = np.zeros(len(squares))
    for axis in range(3):
        own = np.diag(variances[:, axis]) + flicker
        own = own if shared_rad2_s2 is None else own + shared_rad2_s2[axis]
        covariances = free @ own @ free.T + walks[:, None, None] * (free @ unit @ free.T)
        likelihood += _likelihood(free @ means[:, axis], covariances, grid).ravel()
    walk, scatter = chosen(np.sqrt(squares), likelihood).tolist()
    return BiasProcess(walk, scatter, freedom, instability_rad_s)


def _likelihood(seen: Array, noise: Array, scatters: Array) -> Array:
    """(K, L) logarithms, up to a constant, for noise covariances (K, n, n), each with L squared scatters beside it.

    A scatter adds to every eigenvalue alike, so each covariance is taken apart but once.
    """
    values, vectors = np.linalg.eigh(noise)
    squares = np.square(seen @ vectors)[:, None]
    sizes = values[:, None] + scatters[:, None]
    likelihood: Array = -0.5 * np.sum(np.log(sizes) + squares / sizes, axis=-1)
    return likelihood

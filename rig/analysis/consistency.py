"""Whether what a recording tells of a sensor agrees with itself: pieces of sweeps and rests against one model.

All pieces must be explained by one calibration: m = F ω + c + G a + d t, the vector model with gravity and a bias that
drifts steadily, to within the noise, a bias that wanders, and what arm and sensor may legitimately be off by. Each
check adds columns for one thing that might be wrong and asks how much they explain: without it, χ² with as many degrees
of freedom as columns. The process of the bias comes from what is left within the sweeps and between the rests, so that
a wrong sweep does not excuse itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.analysis.pieces import REST, Pieces
from rig.analysis.suspicion import TOLD, Statistic, Suspicions, basis, explained, told_by, unlike_the_others
from rig.estimation.arrays import Array
from rig.estimation.bias_process import BiasProcess, likeliest_bias_process

# Of the speed: twists of a real arm's wrists (−8e-4, +4e-4 rad, UR's own calibration), and what 0.1 % of full scale,
# a common statement of nonlinearity, amounts to at a quarter of the range.
TOLERANCE = 5e-4
WITHIN_A_TURN = 3e-4  # of the speed: graduation and eccentricity of an encoder, which cancel over the turn


@dataclass(frozen=True, slots=True)
class Consistency:
    """The statistics of one sensor by the name of their check, each with its limit.

    `sweep` is that of the sweep least like the others; `disturbed` are those beyond the limit, by place.
    """

    statistics: dict[str, Statistic]
    sweep: Statistic
    disturbed: dict[int, Statistic]


@dataclass(frozen=True, slots=True)
class Allowance:
    """What pieces may be off by, a pattern for each thing of one standard deviation: `off_rad_s` (P, N, 3).

    `ways` are the same pieces and the ways between them, `off_on_ways_rad_s` (Q, M, 3) what these may be off by;
    `instability_rad_s` is the sensor's known bias instability.
    """

    off_rad_s: Array
    ways: Pieces
    off_on_ways_rad_s: Array
    instability_rad_s: float = 0.0


@dataclass(frozen=True, slots=True)
class _Scatter:
    """Of the pieces' means beside a bias that wanders: `variances_rad2_s2` (N, 3) each for itself, and what they have
    in common, `common_rad2_s2` (3 N, 3 N); `instability_rad_s` is that of the bias, as far as it is known."""

    variances_rad2_s2: Array
    common_rad2_s2: Array
    instability_rad_s: float = 0.0


@dataclass(frozen=True, slots=True)
class _Held:
    """Readings (3 N,) and the columns of the model (3 N, k) as `white` (3 N, 3 N) makes them."""

    white: Array
    seen: Array
    base: Array

    def explained(self, suspicions: Sequence[Array], beside: Sequence[Array]) -> list[float]:
        """Of columns (3, N, k): see `Held`."""
        return [self._told(columns, beside)[0] for columns in suspicions]

    def judged(self, columns: Array | None, beside: Sequence[Array], rate: float) -> Statistic | None:
        """See `Held`."""
        from scipy.special import chdtri

        value, freedom = self._told(columns, beside)
        return (value, float(chdtri(freedom, rate))) if freedom else None

    def most_by_one(self, columns: Array, rate: float) -> Statistic | None:
        """What the one of columns (3, N, k) explains that explains most; None where all of them are in the model."""
        from scipy.special import chdtri

        known, new = basis(self.base), _whiten(self.white, columns)
        sizes = np.linalg.norm(new, axis=0)
        new = new - known @ (known.T @ new)
        left = np.linalg.norm(new, axis=0)
        told = left > TOLD * sizes
        if not told.any():
            return None
        most = (new[:, told].T @ (self.seen - known @ (known.T @ self.seen))) / left[told]
        return float(np.max(most**2)), float(chdtri(1, rate / np.count_nonzero(told)))

    def _told(self, columns: Array | None, beside: Sequence[Array]) -> tuple[float, int]:
        base = np.concatenate([self.base, *(_whiten(self.white, each) for each in beside)], axis=1)
        return explained(self.seen, base, None if columns is None else _whiten(self.white, columns))


def consistency(pieces: Pieces, matrix: Array, rate: float, allowance: Allowance | None = None) -> Consistency:
    """Every statistic with its critical value; `rate` is that of false alarms for each, `matrix` (3, 3) F.

    Without an `allowance` every sensor is allowed what all were before, and the ways between the sweeps tell nothing.
    """
    felt = pieces.rates_rad_s @ matrix.T
    if allowance is None:
        scatter = _tolerated(pieces, felt)
        held = _held(pieces, scatter, _wandering(pieces, felt, _steady(pieces), scatter))
        found = told_by(held, _changes(pieces, felt), rate)
        whole, of_an_axis = None, None
    else:
        unstable = allowance.instability_rad_s
        scatter = _Scatter(pieces.variances_rad2_s2, _together(allowance.off_rad_s), unstable)
        bias, ways = _wandering(pieces, felt, _steady(pieces), scatter), allowance.ways
        held = _held(pieces, scatter, bias)
        felt_on_ways = ways.rates_rad_s @ matrix.T
        on_ways = _Scatter(ways.variances_rad2_s2, _together(allowance.off_on_ways_rad_s), unstable)
        held_on_ways = _held(ways, on_ways, bias)
        found = told_by(held_on_ways, _changes(ways, felt_on_ways), rate)
        whole = _each_axis(np.column_stack(_sweeps(pieces)))
        of_an_axis = _axis_changed(ways, felt_on_ways, held_on_ways, rate)
    found |= told_by(held, _differences(pieces, felt, whole), rate)
    if of_an_axis is not None:
        found["axis_changed"] = of_an_axis
    jumped = _jumped(pieces, felt, scatter, rate)
    if jumped is not None:
        found["bias_jumped"] = jumped
    sweeps = np.unique(pieces.sweep[pieces.sweep >= 0]).tolist()
    ranked = unlike_the_others(held, sweeps, lambda sweep: _of_sweep(pieces, sweep), rate)
    return Consistency(found, ranked[0][1], {sweep: each for sweep, each in ranked if each[0] > each[1]})


def _axis_changed(ways: Pieces, felt: Array, held: _Held, rate: float) -> Statistic | None:
    """How much another scale factor of one axis explains, from one sweep or way on; None where none would be told.

    It is that of the axis and the time for which it explains most.
    """
    starts = np.unique([ways.times_s[ways.sweep == sweep].min() for sweep in np.unique(ways.sweep[ways.sweep != REST])])
    later = ways.times_s.mean(axis=1)[:, None] > starts[1:]
    columns = np.concatenate([_per_axis(felt * since[:, None]) for since in later.T], axis=2)
    return held.most_by_one(columns, rate)


def _held(pieces: Pieces, scatter: _Scatter, bias: BiasProcess) -> _Held:
    white = _whitening(_covariance(pieces, scatter, bias), pieces.variances_rad2_s2.min())
    seen = _whiten(white, pieces.means_rad_s.T[:, :, None])[:, 0]
    return _Held(white, seen, _whiten(white, _each_axis(_known(pieces))))


def _jumped(pieces: Pieces, felt: Array, scatter: _Scatter, rate: float) -> Statistic | None:
    """How much a jump of the bias between two rests explains beside its wandering; None without three rests.

    The process is estimated anew beside the jump that explains most, for that jump would be taken for wandering. Few
    rests tell that process, and least of all beside the jump that suits them best: simulated random walks exceed
    the critical value about as often as F does with one degree of freedom for each place a jump might have.
    """
    from scipy.special import fdtri

    steady, middle = _steady(pieces), pieces.times_s.mean(axis=1)
    ends = [pieces.times_s[pieces.sweep == sweep].max() for sweep in np.unique(pieces.sweep[pieces.sweep >= 0])]
    steps = [np.where(middle < end, 0.0, 1.0)[:, None] for end in ends]
    steps = [step for step in steps if len(np.unique(step[pieces.sweep < 0])) > 1]
    if len(steps) < 2:
        return None

    def told(step: Array, beside: Array) -> float:
        bias = _wandering(pieces, felt, beside, scatter)
        white = _whitening(_covariance(pieces, scatter, bias), pieces.variances_rad2_s2.min())
        seen = _whiten(white, (pieces.means_rad_s - felt).T[:, :, None])[:, 0]
        return explained(seen, _whiten(white, _each_axis(steady)), _whiten(white, _each_axis(step)))[0]

    left = pieces.means_rad_s - felt
    left = left - steady @ (steady.T @ left)
    aside = [step - steady @ (steady.T @ step) for step in steps]
    best = max(range(len(steps)), key=lambda k: float(np.sum((aside[k].T @ left) ** 2 / np.sum(aside[k] ** 2))))
    beside = basis(np.column_stack([steady, steps[best]]))
    return told(steps[best], beside), 3 * float(fdtri(3, len(steps), 1 - rate / len(steps)))


def _wandering(pieces: Pieces, felt: Array, steady: Array, scatter: _Scatter) -> BiasProcess:
    """How the bias wanders, by what `steady` (N, k), orthonormal columns, leaves of the readings."""
    each, count = np.arange(3), len(pieces.sweep)
    common = scatter.common_rad2_s2.reshape(3, count, 3, count)[each, :, each]
    left = pieces.means_rad_s - felt
    known = scatter.instability_rad_s
    return likeliest_bias_process(
        steady, left, scatter.variances_rad2_s2, pieces.times_s, common, instability_rad_s=known
    )


def _covariance(pieces: Pieces, scatter: _Scatter, bias: BiasProcess) -> Array:
    """(3 N, 3 N) of the pieces' means, axis by axis: their scatter, and a bias that wanders."""
    each, count = np.arange(3), len(pieces.sweep)
    covariance = scatter.common_rad2_s2.reshape(3, count, 3, count).copy()
    noise = np.array([np.diag(each) for each in scatter.variances_rad2_s2.T])
    covariance[each, :, each] += noise + bias.covariance(pieces.times_s)
    return covariance.reshape(3 * count, 3 * count)


def _together(off: Array) -> Array:
    """(3 N, 3 N) covariance of independent patterns (P, N, 3)."""
    columns = np.moveaxis(off, 0, -1).swapaxes(0, 1).reshape(-1, len(off))
    return np.asarray(columns @ columns.T, dtype=np.float64)


def _tolerated(pieces: Pieces, felt: Array) -> _Scatter:
    """What was allowed to every sensor alike: in all of a sweep, and within it."""
    same = (pieces.sweep[:, None] == pieces.sweep) & (pieces.sweep >= 0)
    speed = np.linalg.norm(felt, axis=1)
    off = (TOLERANCE**2 + np.outer(pieces.speed_std, pieces.speed_std)) * same * np.outer(speed, speed)
    return _Scatter(pieces.variances_rad2_s2 + ((WITHIN_A_TURN * speed) ** 2)[:, None], np.kron(np.eye(3), off))


def _steady(pieces: Pieces) -> Array:
    """(N, k) orthonormal columns: whatever each sweep reads as a whole, the rests alike, gravity, a steady drift."""
    places = [pieces.sweep == sweep for sweep in np.unique(pieces.sweep)]
    return basis(np.column_stack([*places, pieces.pull_m_s2, _time(pieces)]))


def _known(pieces: Pieces) -> Array:
    """(N, 8) columns of the model, for each axis alike."""
    ones = np.ones(len(pieces.sweep))
    return np.column_stack([pieces.rates_rad_s, ones, pieces.pull_m_s2, _time(pieces)])


def _changes(pieces: Pieces, felt: Array) -> Suspicions:
    """By name of the check (3, N, k): what another scale factor of each axis, or another mounting, with time adds."""
    time = _time(pieces)
    for sweep in np.unique(pieces.sweep):  # what changes within a sweep is that sweep's own matter
        time[pieces.sweep == sweep] = time[pieces.sweep == sweep].mean()
    turned = np.cross(np.eye(3)[:, None], felt[None]) * time[None, :, None]  # (k, N, 3)
    return {"scale_changed": _per_axis(felt * time[:, None]), "loose_mounting": np.transpose(turned, (2, 1, 0))}


def _differences(pieces: Pieces, felt: Array, whole: Array | None) -> dict[str, Array | None]:
    """The same of what differs between directions, sweeps and rests.

    What else may differ is `whole` (3, N, k), each sweep from what the model says; None is anything at all, but of that
    the scatter within sweeps is made which the bias' wandering is found from.
    """
    found: dict[str, Array | None] = {"cw_against_ccw": _per_axis(np.abs(felt)), "residuals": whole}
    moving = pieces.sweep >= 0
    if not moving.all():
        found["sweeps_against_rests"] = _per_axis(np.outer(moving, np.ones(3)))
    return found


def _sweeps(pieces: Pieces) -> list[Array]:
    """(N,) one in each sweep, zero elsewhere."""
    return [(pieces.sweep == sweep).astype(np.float64) for sweep in np.unique(pieces.sweep[pieces.sweep >= 0])]


def _of_sweep(pieces: Pieces, sweep: int) -> Array:
    """(3, N, 6): another reading in this sweep, and another in its second half than in its first."""
    inside = (pieces.sweep == sweep).astype(np.float64)
    return _each_axis(np.column_stack([inside, inside * pieces.place]))


def _time(pieces: Pieces) -> Array:
    """(N,) of the pieces' middles, from −1 to 1."""
    middle = pieces.times_s.mean(axis=1)
    time: Array = (2 * middle - middle.max() - middle.min()) / np.ptp(middle)
    return time


def _each_axis(columns: Array) -> Array:
    """(3, N, 3 k): columns (N, k) for each axis with a coefficient of its own."""
    count, wide = columns.shape
    return np.asarray(np.einsum("ij,nk->injk", np.eye(3), columns).reshape(3, count, 3 * wide), dtype=np.float64)


def _per_axis(columns: Array) -> Array:
    """(3, N, 3) from (N, 3): each axis' own column, with a coefficient of its own."""
    stacked: Array = np.einsum("ij,ni->inj", np.eye(3), columns)
    return stacked


def _whitening(covariance: Array, least: float) -> Array:
    """(3 N, 3 N) what makes noise of that covariance one and independent; no variance is below `least`.

    Windows overlap when a computer's clock was put back between two recordings, and what is computed is no covariance.
    """
    variances, directions = np.linalg.eigh(covariance)
    return np.asarray(directions.T / np.sqrt(np.maximum(variances, least))[:, None], dtype=np.float64)


def _whiten(white: Array, columns: Array) -> Array:
    """(3 N, k) of columns (3, N, k)."""
    return np.asarray(white @ columns.reshape(len(white), -1), dtype=np.float64)

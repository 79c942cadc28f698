"""Whether what a recording tells of a sensor agrees with itself: pieces of sweeps and rests against one model.

All pieces must be explained by one calibration: m = F ω + c + G a + d t, the vector model with gravity and a bias that
drifts steadily, to within the noise, a bias that wanders, and what arm and sensor may legitimately be off by. Each
check adds columns for one thing that might be wrong and asks how much they explain: without it, χ² with as many degrees
of freedom as columns. The process of the bias comes from what is left within the sweeps and between the rests, so that
a wrong sweep does not excuse itself.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rig.analysis.pieces import Pieces
from rig.analysis.suspected import (
    DAMAGES,
    Means,
    changes,
    differences,
    each_axis,
    in_time,
    jumps,
    of_one_axis,
    of_sweep,
)
from rig.analysis.suspicion import (
    TOLD,
    Statistic,
    Suspected,
    basis,
    explained,
    told_by,
    told_from,
    unlike_the_others,
)
from rig.estimation.arrays import Array
from rig.estimation.bias_process import BiasProcess, likeliest_bias_process

# Of the speed: twists of a real arm's wrists (−8e-4, +4e-4 rad, UR's own calibration), and what 0.1 % of full scale,
# a common statement of nonlinearity, amounts to at a quarter of the range.
TOLERANCE = 5e-4
WITHIN_A_TURN = 3e-4  # of the speed: graduation and eccentricity of an encoder, which cancel over the turn


@dataclass(frozen=True, slots=True)
class Consistency:
    """The statistics of one sensor by the name of their check, each with its limit.

    `sweep` is that of the sweep least like the others; `disturbed` are those beyond the limit, by place. `told_from` is
    the size from which on each damage is told, by what happens; there where an allowance says what is legitimate.
    """

    statistics: dict[str, Statistic]
    sweep: Statistic
    disturbed: dict[int, Statistic]
    told_from: dict[str, float] = field(default_factory=dict)


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
        value, freedom = self._told(columns, beside)
        return (value, _beyond_chance(rate)(freedom)) if freedom else None

    def most_by_one(self, columns: Array, rate: float) -> Statistic | None:
        """What the one of columns (3, N, k) explains that explains most; None where all of them are in the model."""
        alone = self._alone(columns)
        if not alone.shape[1]:
            return None
        known = basis(self.base)
        most = alone.T @ (self.seen - known @ (known.T @ self.seen))
        return float(np.max(most**2)), _beyond_chance(rate / alone.shape[1])(1)

    def told_from(self, patterns: Array, suspected: Iterable[Suspected]) -> float:
        """As `rig.analysis.suspicion.told_from`, of patterns (k, N, 3) and columns (3, N, c)."""
        whitened = ((_whiten(self.white, columns), limit) for columns, limit in suspected)
        return told_from(basis(self.base), _whiten(self.white, np.moveaxis(patterns, 0, -1).swapaxes(0, 1)), whitened)

    def each_alone(self, columns: Array, rate: float) -> Iterator[Suspected]:
        """What `most_by_one` holds against each other, columns (3, N, 1) each."""
        limit = _beyond_chance(rate / max(self._alone(columns).shape[1], 1))
        yield from ((column[..., None], limit) for column in np.moveaxis(columns, -1, 0))

    def _alone(self, columns: Array) -> Array:
        """(3 N, k) unit columns, each for itself less what the model holds of it; those that it holds are left out."""
        known, new = basis(self.base), _whiten(self.white, columns)
        sizes = np.linalg.norm(new, axis=0)
        new = new - known @ (known.T @ new)
        left = np.linalg.norm(new, axis=0)
        told = left > TOLD * sizes
        return np.asarray(new[:, told] / left[told], dtype=np.float64)

    def _told(self, columns: Array | None, beside: Sequence[Array]) -> tuple[float, int]:
        base = np.concatenate([self.base, *(_whiten(self.white, each) for each in beside)], axis=1)
        return explained(self.seen, base, None if columns is None else _whiten(self.white, columns))


@dataclass(frozen=True, slots=True)
class _Look:
    """Pieces, what each axis of the sensor feels in them (N, 3), and both held against their model."""

    pieces: Pieces
    felt: Array
    held: _Held

    @property
    def means(self) -> Means:
        """They too are means."""
        return Means(self.felt, self.pieces.times_s, self.pieces.sweep)


def consistency(pieces: Pieces, matrix: Array, rate: float, allowance: Allowance | None = None) -> Consistency:
    """Every statistic with its critical value; `rate` is that of false alarms for each, `matrix` (3, 3) F.

    Without an `allowance` every sensor is allowed what all were before, and the ways between the sweeps tell nothing.
    """
    felt = pieces.rates_rad_s @ matrix.T
    scatter = _tolerated(pieces, felt) if allowance is None else _allowed(pieces, allowance.off_rad_s, allowance)
    bias = _wandering(pieces, felt, _steady(pieces), scatter)
    here = _Look(pieces, felt, _held(pieces, scatter, bias))
    later, whole = here, None
    if allowance is not None:
        ways, of_ways = allowance.ways, _allowed(allowance.ways, allowance.off_on_ways_rad_s, allowance)
        later = _Look(ways, ways.rates_rad_s @ matrix.T, _held(ways, of_ways, bias))
        whole = each_axis(here.means.sweeps)
    found = told_by(later.held, changes(later.pieces, later.felt), rate)
    found |= told_by(here.held, differences(pieces, felt, whole), rate)
    if allowance is not None and (told := later.held.most_by_one(of_one_axis(later.pieces, later.felt), rate)):
        found["axis_changed"] = told
    jumped = _jumped(pieces, felt, scatter, rate)
    if jumped is not None:
        found["bias_jumped"] = jumped
    sweeps = np.unique(pieces.sweep[pieces.sweep >= 0]).tolist()
    ranked = unlike_the_others(here.held, sweeps, lambda sweep: of_sweep(pieces, sweep), rate)
    disturbed = {sweep: each for sweep, each in ranked if each[0] > each[1]}
    return Consistency(found, ranked[0][1], disturbed, {} if allowance is None else dict(_told_from(here, later, rate)))


def _told_from(here: _Look, later: _Look, rate: float) -> Iterator[tuple[str, float]]:
    """What may happen, and the size from which on the check that is to tell it does."""
    pieces, chance = here.pieces, _beyond_chance(rate)
    steps, sweeps = jumps(pieces), np.unique(pieces.sweep[pieces.sweep >= 0]).tolist()
    among_ways, among_pieces = changes(later.pieces, later.felt), differences(pieces, here.felt, None)
    asked: dict[str, tuple[_Look, list[Suspected]]] = {
        name: (look, [(columns, chance)])
        for look, suspicions in ((later, among_ways), (here, among_pieces))
        for name, columns in suspicions.items()
        if columns is not None
    }
    asked["axis_changed"] = later, list(later.held.each_alone(of_one_axis(later.pieces, later.felt), rate))
    of_one = _beyond_chance(rate / len(sweeps))
    asked["disturbed_sweep"] = here, [(of_sweep(pieces, sweep), of_one) for sweep in sweeps]
    if len(steps) > 1:
        steady = replace(here.held, base=_whiten(here.held.white, each_axis(_steady(pieces))))
        limit = _beyond_jumps(len(steps), rate)
        asked["bias_jumped"] = replace(here, held=steady), [(each_axis(step), lambda _: limit) for step in steps]
    for damage in DAMAGES:
        if damage.check in asked:
            look, suspected = asked[damage.check]
            yield damage.what, look.held.told_from(damage.patterns(look.means), suspected)


def _beyond_chance(rate: float) -> Callable[[int], float]:
    """Of χ² with so many degrees of freedom, in a share `rate` of recordings."""
    from scipy.special import chdtri

    return lambda freedom: float(chdtri(freedom, rate))


def _held(pieces: Pieces, scatter: _Scatter, bias: BiasProcess) -> _Held:
    white = _whitening(_covariance(pieces, scatter, bias), pieces.variances_rad2_s2.min())
    seen = _whiten(white, pieces.means_rad_s.T[:, :, None])[:, 0]
    return _Held(white, seen, _whiten(white, each_axis(_known(pieces))))


def _jumped(pieces: Pieces, felt: Array, scatter: _Scatter, rate: float) -> Statistic | None:
    """How much a jump of the bias between two rests explains beside its wandering; None without three rests.

    The process is estimated anew beside the jump that explains most, for that jump would be taken for wandering. Few
    rests tell that process, and least of all beside the jump that suits them best: simulated random walks exceed
    the critical value about as often as F does with one degree of freedom for each place a jump might have.
    """
    steady, steps = _steady(pieces), jumps(pieces)
    if len(steps) < 2:
        return None

    def told(step: Array, beside: Array) -> float:
        bias = _wandering(pieces, felt, beside, scatter)
        white = _whitening(_covariance(pieces, scatter, bias), pieces.variances_rad2_s2.min())
        seen = _whiten(white, (pieces.means_rad_s - felt).T[:, :, None])[:, 0]
        return explained(seen, _whiten(white, each_axis(steady)), _whiten(white, each_axis(step)))[0]

    left = pieces.means_rad_s - felt
    left = left - steady @ (steady.T @ left)
    aside = [step - steady @ (steady.T @ step) for step in steps]
    best = max(range(len(steps)), key=lambda k: float(np.sum((aside[k].T @ left) ** 2 / np.sum(aside[k] ** 2))))
    beside = basis(np.column_stack([steady, steps[best]]))
    return told(steps[best], beside), _beyond_jumps(len(steps), rate)


def _beyond_jumps(places: int, rate: float) -> float:
    """The critical value of a jump that may be in so many places."""
    from scipy.special import fdtri

    return 3 * float(fdtri(3, places, 1 - rate / places))


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


def _allowed(pieces: Pieces, off_rad_s: Array, allowance: Allowance) -> _Scatter:
    """What is known of arm and sensor."""
    return _Scatter(pieces.variances_rad2_s2, _together(off_rad_s), allowance.instability_rad_s)


def _tolerated(pieces: Pieces, felt: Array) -> _Scatter:
    """What was allowed to every sensor alike: in all of a sweep, and within it."""
    same = (pieces.sweep[:, None] == pieces.sweep) & (pieces.sweep >= 0)
    speed = np.linalg.norm(felt, axis=1)
    off = (TOLERANCE**2 + np.outer(pieces.speed_std, pieces.speed_std)) * same * np.outer(speed, speed)
    return _Scatter(pieces.variances_rad2_s2 + ((WITHIN_A_TURN * speed) ** 2)[:, None], np.kron(np.eye(3), off))


def _steady(pieces: Pieces) -> Array:
    """(N, k) orthonormal columns: whatever each sweep reads as a whole, the rests alike, gravity, a steady drift."""
    places = [pieces.sweep == sweep for sweep in np.unique(pieces.sweep)]
    return basis(np.column_stack([*places, pieces.pull_m_s2, in_time(pieces)]))


def _known(pieces: Pieces) -> Array:
    """(N, 8) columns of the model, for each axis alike."""
    ones = np.ones(len(pieces.sweep))
    return np.column_stack([pieces.rates_rad_s, ones, pieces.pull_m_s2, in_time(pieces)])


def _whitening(covariance: Array, least: float) -> Array:
    """(3 N, 3 N) what makes noise of that covariance one and independent; no variance is below `least`.

    Windows overlap when a computer's clock was put back between two recordings, and what is computed is no covariance.
    """
    variances, directions = np.linalg.eigh(covariance)
    return np.asarray(directions.T / np.sqrt(np.maximum(variances, least))[:, None], dtype=np.float64)


def _whiten(white: Array, columns: Array) -> Array:
    """(3 N, k) of columns (3, N, k)."""
    return np.asarray(white @ columns.reshape(len(white), -1), dtype=np.float64)

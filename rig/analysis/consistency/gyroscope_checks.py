"""Whether what a recording tells of a sensor agrees with itself: segments of sweeps and rests against one model.

All segments must be explained by one calibration: m = F ω + c + G a + d t, the vector model with gravity and a bias
that drifts steadily, to within the noise, a bias that wanders, and what arm and sensor may legitimately be off by. Each
check adds columns for one thing that might be wrong and asks how much they explain: without it, χ² with as many degrees
of freedom as columns. The process of the bias comes from what is left within the sweeps and between the rests, so that
a wrong sweep does not excuse itself.

A ripple that is faster than readings and states come is in the ways' means, and in neither's rates. It looks like noise
unless it stands still in the samples: so what scatters on them counts as much more as they contradict each other beside
all that may have changed from quarter to quarter (Birge's ratio). Where nothing scatters, nothing is excused.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.consistency.alternatives import (
    DAMAGES,
    Means,
    changes,
    differences,
    each_axis,
    in_quarters,
    in_time,
    jumps,
    of_one_axis,
    of_sweep,
)
from rig.analysis.consistency.residual_tests import (
    Consistency,
    Statistic,
    Suspected,
    basis,
    explained,
    told_by,
    unlike_the_others,
)
from rig.analysis.consistency.whitened_segments import (
    Scatter,
    WhitenedSegments,
    beyond_chance,
    whiten,
    whiten_segments,
    whitening,
)
from rig.analysis.gyroscope.segments import Segments
from rig.estimation.arrays import Array
from rig.estimation.statistics.bias_process import BiasProcess, bias_process, likeliest

# Of one gyroscope, at most; the latter with an allowance alone. Which sweep is disturbed is a check beside them.
CHECKS = (
    "axis_changed",
    "bias_jumped",
    "cw_against_ccw",
    "loose_mounting",
    "residuals",
    "scale_changed",
    "sweeps_against_rests",
)

MOST, TRIED = 16.0, 7  # times its variance by low frequencies is what stands still in the samples; sizes that are tried


@dataclass(frozen=True, slots=True)
class Allowance:
    """What segments may be off by, a pattern for each thing of one standard deviation: `off_rad_s` (P, N, 3).

    `ways` are the same segments and the ways between them, `off_on_ways_rad_s` (Q, M, 3) what these may be off by;
    `instability_rad_s` is the sensor's known bias instability.
    """

    off_rad_s: Array
    ways: Segments
    off_on_ways_rad_s: Array
    instability_rad_s: float = 0.0


@dataclass(frozen=True, slots=True)
class _Look:
    """Segments, what each axis of the sensor feels in them (N, 3), and both held against their model."""

    segments: Segments
    felt: Array
    held: WhitenedSegments

    @property
    def means(self) -> Means:
        """What the axes feel in the segments, as means that a damage may change."""
        return Means(self.felt, self.segments.times_s, self.segments.sweep)


def consistency(segments: Segments, matrix: Array, rate: float, allowance: Allowance) -> Consistency:
    """Return every statistic with its critical value; `rate` is that of false alarms for each, `matrix` (3, 3) F."""
    felt = segments.rates_rad_s @ matrix.T
    scatter = _allowed(segments, allowance.off_rad_s, allowance)
    bias = _wandering(segments, felt, _steady(segments), scatter)
    here = _Look(segments, felt, whiten_segments(segments, scatter, bias))
    later = _on_contradicting_ways(here, matrix, allowance, bias)
    found = told_by(later.held, changes(later.segments, later.felt), rate)
    found |= told_by(here.held, differences(segments, felt, each_axis(here.means.sweeps)), rate)
    if told := later.held.most_by_one(of_one_axis(later.segments, later.felt), rate):
        found["axis_changed"] = told
    jumped = _jumped(segments, felt, scatter, rate)
    if jumped is not None:
        found["bias_jumped"] = jumped
    sweeps = np.unique(segments.sweep[segments.sweep >= 0]).tolist()
    ranked = unlike_the_others(here.held, sweeps, lambda sweep: of_sweep(segments, sweep), rate)
    disturbed = {sweep: each for sweep, each in ranked if each[0] > each[1]}
    return Consistency(found, ranked[0][1], disturbed, dict(_told_from(here, later, rate)))


def would_tell(segments: Segments, matrix: Array, rate: float, allowance: Allowance) -> dict[str, float]:
    """`told_from` of segments with which nothing is wrong, and whose bias wanders as is known of it alone."""
    bias = BiasProcess(0.0, 0.0, 0, allowance.instability_rad_s)
    scatter = _allowed(segments, allowance.off_rad_s, allowance)
    here = _Look(segments, segments.rates_rad_s @ matrix.T, whiten_segments(segments, scatter, bias))
    return dict(_told_from(here, _on_ways(matrix, allowance, bias), rate))


def _on_contradicting_ways(here: _Look, matrix: Array, allowance: Allowance, bias: BiasProcess) -> _Look:
    """Return `_on_ways` with what is unexplained of these as large as they contradict each other, up to `MOST` times.

    χ² of all segments less that of those without the ways is theirs: it is to be as they are many.
    """
    ways, (own, freedom) = allowance.ways, _unexplained(here)
    for ratio in np.geomspace(1.0, MOST, TRIED):
        variances = ways.variances_rad2_s2 + (ratio - 1) * ways.unexplained_rad2_s2
        later = _on_ways(matrix, replace(allowance, ways=replace(ways, variances_rad2_s2=variances)), bias)
        whole, whole_freedom = _unexplained(later)
        if whole - own <= whole_freedom - freedom:
            break
    return later


def _unexplained(look: _Look) -> tuple[float, int]:
    """χ² of segments beside all that may have changed, and with how many degrees of freedom."""
    changed = [*changes(look.segments, look.felt).values(), in_quarters(look.means)]
    beside = [whiten(look.held.white, each) for each in changed if each is not None]
    return explained(look.held.seen, np.concatenate([look.held.base, *beside], axis=1), None)


def _on_ways(matrix: Array, allowance: Allowance, bias: BiasProcess) -> _Look:
    ways = allowance.ways
    scatter = _allowed(ways, allowance.off_on_ways_rad_s, allowance)
    return _Look(ways, ways.rates_rad_s @ matrix.T, whiten_segments(ways, scatter, bias))


def _told_from(here: _Look, later: _Look, rate: float) -> Iterator[tuple[str, float]]:
    """What may happen, and the size from which on the check that is to tell it does."""
    segments, chance = here.segments, beyond_chance(rate)
    steps, sweeps = jumps(segments), np.unique(segments.sweep[segments.sweep >= 0]).tolist()
    among_ways, among_segments = changes(later.segments, later.felt), differences(segments, here.felt, None)
    asked: dict[str, tuple[_Look, list[Suspected]]] = {
        name: (look, [(columns, chance)])
        for look, suspicions in ((later, among_ways), (here, among_segments))
        for name, columns in suspicions.items()
        if columns is not None
    }
    asked["axis_changed"] = later, list(later.held.each_alone(of_one_axis(later.segments, later.felt), rate))
    of_one = beyond_chance(rate / len(sweeps))
    asked["disturbed_sweep"] = here, [(of_sweep(segments, sweep), of_one) for sweep in sweeps]
    if len(steps) > 1:
        steady = replace(here.held, base=whiten(here.held.white, each_axis(_steady(segments))))
        limit = _beyond_jumps(len(steps), rate)
        asked["bias_jumped"] = replace(here, held=steady), [(each_axis(step), lambda _: limit) for step in steps]
    for damage in DAMAGES:
        if damage.check in asked:
            look, suspected = asked[damage.check]
            yield damage.what, look.held.told_from(damage.patterns(look.means), suspected)


def _jumped(segments: Segments, felt: Array, scatter: Scatter, rate: float) -> Statistic | None:
    """How much a jump of the bias between two rests explains beside its wandering; None without three rests.

    The process is estimated anew beside the jump that explains most, for that jump would be taken for wandering. Few
    rests tell that process, and least of all beside the jump that suits them best: simulated random walks exceed
    the critical value about as often as F does with one degree of freedom for each place a jump might have.
    """
    steady, steps = _steady(segments), jumps(segments)
    if len(steps) < 2:
        return None

    def told(step: Array, beside: Array) -> float:
        bias = _wandering(segments, felt, beside, scatter)
        white = whitening(segments, scatter, bias)
        seen = whiten(white, (segments.means_rad_s - felt).T[:, :, None])[:, 0]
        return explained(seen, whiten(white, each_axis(steady)), whiten(white, each_axis(step)))[0]

    left = segments.means_rad_s - felt
    left = left - steady @ (steady.T @ left)
    aside = [step - steady @ (steady.T @ step) for step in steps]
    best = max(range(len(steps)), key=lambda k: float(np.sum((aside[k].T @ left) ** 2 / np.sum(aside[k] ** 2))))
    beside = basis(np.column_stack([steady, steps[best]]))
    return told(steps[best], beside), _beyond_jumps(len(steps), rate)


def _beyond_jumps(places: int, rate: float) -> float:
    """The critical value of a jump that may be in so many places."""
    from scipy.special import fdtri

    return 3 * float(fdtri(3, places, 1 - rate / places))


def _wandering(segments: Segments, felt: Array, steady: Array, scatter: Scatter) -> BiasProcess:
    """How the bias wanders, by what `steady` (N, k), orthonormal columns, leaves of the readings."""
    common = scatter.common_rad2_s2
    left = segments.means_rad_s - felt
    known = scatter.instability_rad_s
    return bias_process(
        steady, left, scatter.variances_rad2_s2, segments.times_s, common, instability_rad_s=known, chosen=likeliest
    )


def _allowed(segments: Segments, off_rad_s: Array, allowance: Allowance) -> Scatter:
    """What is known of arm and sensor."""
    return Scatter(segments.variances_rad2_s2, off_rad_s, allowance.instability_rad_s)


def _steady(segments: Segments) -> Array:
    """(N, k) orthonormal columns: whatever each sweep reads as a whole, the rests alike, gravity, a steady drift."""
    places = [segments.sweep == sweep for sweep in np.unique(segments.sweep)]
    return basis(np.column_stack([*places, segments.gravity_m_s2, in_time(segments)]))

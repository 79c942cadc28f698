"""Scale and bias as polynomials of temperature, from sweeps, rests or dwells repeated while the sensor warms and cools.

What every repeat shares (axes and attitudes that are a little off, the Earth's rate, gravity's share) stands in an
offset of its own for each place of the plan; only what changes from repeat to repeat tells of temperature:

    m = offset(place) + (1/(1 + q(T)) − 1) F x + c(T) + hysteresis + lag · dT/dt · ∂m/∂T + noise and a wandering bias

q and c are polynomials in T − reference without a constant. Their orders, one of all axes' q and one of all axes' c,
are those of the least AICc (Hurvich and Tsai, Biometrika 76 (1989) 297); what the other orders say, each with its
Akaike weight (Burnham and Anderson, Model Selection, 2002, 4.3), is a line of the uncertainty. Warming and cooling are
told apart by a loop that is closed at both ends of the range. A thermometer's lag is found together with the rest.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.refusals import check_finite
from rig.estimation.statistics.bias_process import BiasProcess, bias_process, walking
from rig.estimation.statistics.coverage import coverage_factors, effective_freedom

HIGHEST = 3  # order: that of the autopilots
FEWEST = 4  # repeats of each place
MIN_RANGE_C = 10.0
LAG_STD_S = 10.0  # of a thermometer behind what it is beside, before the readings say more; assumed
EACH_WAY = 0.2  # of the observations, warming and cooling, that tell a loop
STANDING_K_S = 0.1 / 60  # slower, it counts as going on the way it went before
AS_GOOD_AS_EQUAL = 0.03  # in two places, of the largest of all
STEPS = 6  # of Gauss and Newton: the model is linear but for products of small numbers
COEFFICIENTS = 6 * (HIGHEST + 1)  # scale of order 0 xyz, of order 1 xyz, …, then the bias

NOISE, ORDER, LAG = "noise and a wandering bias", "order of the polynomials", "thermometer's lag"
HYSTERESIS, GRADIENT = "warming against cooling", "thermometer beside the sensor"


@dataclass(frozen=True, slots=True)
class Repeated:
    """Mean readings (N, 3), their variances (N, 3), and what was felt: rates or forces (N, 3) by the body's own axes.

    `places` (N,) number the places of the plan, from 0; `windows_s` (N, 2) and `temperature_c` (N,) are when, and how
    warm the part's thermometer was. `instability` is the Allan deviation that the bias' flicker is known to have.
    """

    means: Array
    variances: Array
    felt: Array
    places: NDArray[np.intp]
    windows_s: Array
    temperature_c: Array
    instability: float = 0.0


@dataclass(frozen=True, slots=True)
class Line:
    """One contributor, as of `rig.estimation.gyroscope.budget`; `covariance` (24, 24) of the coefficients."""

    name: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    source: str
    freedom: float
    covariance: Array


@dataclass(frozen=True, slots=True)
class Held:
    """Scale and reading's bias (6,) at a temperature, u (6,) and U (6,)."""

    values: Array
    std: Array
    expanded: Array


@dataclass(frozen=True, slots=True)
class OverTemperature:
    """k(T) and c(T) = Σ coefficient (T − reference)ⁿ, n from 0: `scale` and `bias` (4, 3), SI units per Kⁿ.

    c is what a reading adds. `orders` are those of k and of c; `range_c` is where both hold, and nowhere else.
    `lag_s` and `lag_std_s` are the thermometer's, `hysteresis` (6,) how far a warming sensor is from the mean of both
    ways in the middle of the range, and its standard deviation; None where it did not go both ways.
    `zero` (3,) is what the axes read at the reference where nothing is felt.
    """

    reference_c: float
    range_c: tuple[float, float]
    orders: tuple[int, int]
    scale: Array
    bias: Array
    lines: tuple[Line, ...]
    zero: Array
    lag_s: float
    lag_std_s: float
    hysteresis: tuple[Array, Array] | None
    process: BiasProcess
    repeats: int

    @property
    def coefficients(self) -> Array:
        """Coefficients (24,) in the order of the covariance."""
        return np.concatenate([self.scale.ravel(), self.bias.ravel()])

    @property
    def covariance(self) -> Array:
        """(24, 24) all lines together."""
        combined: Array = np.sum([line.covariance for line in self.lines], axis=0)
        return combined

    def at(self, temperature_c: float) -> Held:
        """What holds at that temperature. Raises Fault `temperature_outside`."""
        check_inside(self.range_c, temperature_c)
        rows = powers_at(temperature_c - self.reference_c)
        variances = np.array([np.einsum("qi,ij,qj->q", rows, line.covariance, rows) for line in self.lines])
        std = np.sqrt(variances.sum(axis=0).clip(min=0.0))
        freedom = effective_freedom(variances, np.array([[line.freedom] for line in self.lines]))
        return Held(rows @ self.coefficients, std, coverage_factors(freedom) * std)

    def at_reference(self, readings: Array, temperature_c: Array) -> Array:
        """Readings (N, 3) taken from their temperatures (N,) to the reference."""
        relative, added = self.changes(temperature_c)
        moved: Array = relative * (readings - added - self.zero) + self.zero
        return moved

    def changes(self, temperature_c: Array) -> tuple[Array, Array]:
        """(N, 3) k over k at the reference, and (N, 3) what c is more than there."""
        rows = np.vander(temperature_c - self.reference_c, HIGHEST + 1, increasing=True)
        return rows @ (self.scale / self.scale[0]), rows[:, 1:] @ self.bias[1:]


def check_inside(range_c: tuple[float, float], temperature_c: float) -> None:
    """Raises Fault `temperature_outside`."""
    low, high = range_c
    if not low <= temperature_c <= high:
        raise Fault(
            "temperature_outside",
            f"the polynomials hold from {low:.1f} to {high:.1f} °C, and {temperature_c:.1f} °C is asked for",
            "Ask for a temperature of that range, or measure over a wider one",
        )


def powers_at(difference_k: float) -> Array:
    """(6, 24) what takes the coefficients to k and c, so far from the reference."""
    rows = np.kron(np.eye(2), np.kron(difference_k ** np.arange(HIGHEST + 1), np.eye(3)))
    return np.asarray(rows, dtype=np.float64)


def over_temperature(seen: Repeated, reference_c: float, gradient_k: float) -> OverTemperature:
    """The polynomials, with k at the reference by plain least squares: `settled` takes in what is known better.

    `gradient_k` is by how much thermometer and sensor may differ in use otherwise than here (half a width).
    Raises Fault `too_few_observations`, `temperature_range_too_small`, `temperature_outside`, `not_finite`.
    """
    check_finite(means=seen.means, temperature_c=seen.temperature_c)
    range_c = (float(seen.temperature_c.min()), float(seen.temperature_c.max()))
    if range_c[1] - range_c[0] < MIN_RANGE_C:
        raise Fault(
            "temperature_range_too_small",
            f"the sensor was between {range_c[0]:.1f} and {range_c[1]:.1f} °C; polynomials need {MIN_RANGE_C:g} °C",
            "Warm and cool the sensor over the range in which it will be used",
        )
    check_inside(range_c, reference_c)
    seen = _repeated_often(seen)
    fits = _Fits(seen, reference_c, range_c)
    fits.refer(seen, fits.solve((fits.highest, fits.highest)))
    each = range(fits.highest + 1)
    tried = {orders: fits.solve(orders) for orders in product(each, each)}
    best = min(tried, key=lambda orders: tried[orders].aicc)
    chosen = tried[best]
    centre = fits.centre(chosen)
    weights = {orders: float(np.exp((chosen.aicc - each.aicc) / 2)) for orders, each in tried.items()}
    total = sum(weights.values())
    apart = [
        (weights[o] / total, _from_centre(each, centre) - _from_centre(chosen, centre)) for o, each in tried.items()
    ]
    known, loop = chosen.known_lag, chosen.loop
    scale = np.concatenate([np.ones((1, 3)), chosen.relative]) * fits.scale
    bias = np.concatenate([_constant(chosen.bias, centre[1])[None], chosen.bias])
    lines = [
        Line(NOISE, "A", "normal", "scatter of the repeats", float(fits.process.freedom), fits.spread(known, centre)),
        Line(LAG, "A", "normal", "readings of warming against cooling", np.inf,
             fits.spread(chosen.covariance - known, centre)),
        Line(ORDER, "A", "normal", "weights of the other orders", np.inf,
             fits.in_units(sum((w * np.outer(d, d) for w, d in apart), np.zeros((COEFFICIENTS, COEFFICIENTS))))),
    ]  # fmt: skip
    if loop is not None:
        lines.append(Line(HYSTERESIS, "A", "rectangular", "half of what warming and cooling differ by", np.inf,
                          fits.in_units(_of_loop(*loop))))  # fmt: skip
    found = OverTemperature(
        reference_c, range_c, best, scale, bias, tuple(lines), fits.zero, chosen.lag_s, chosen.lag_std_s,
        None if loop is None else (loop[0] * fits.in_scale, loop[1] * fits.in_scale), fits.process, fits.repeats,
    )  # fmt: skip
    return replace(found, lines=(*lines, _gradient(found, gradient_k)))


def settled(polynomials: OverTemperature, values: Array, lines: tuple[Line, ...]) -> OverTemperature:
    """The polynomials with k and c (6,) at the reference as another solve tells them, of readings taken there by them.

    `lines` have the covariance (6, 6) of their means over all temperatures.
    """
    scale, bias = polynomials.scale * values[:3] / polynomials.scale[0], polynomials.bias.copy()
    bias[0] = values[3:]
    ratio = np.concatenate([np.tile(values[:3] / polynomials.scale[0], HIGHEST + 1), np.ones(COEFFICIENTS // 2)])
    kept = tuple(replace(line, covariance=np.outer(ratio, ratio) * line.covariance) for line in polynomials.lines)
    first = np.r_[0:3, COEFFICIENTS // 2 : COEFFICIENTS // 2 + 3]

    def whole(line: Line) -> Line:
        covariance = np.zeros((COEFFICIENTS, COEFFICIENTS))
        covariance[np.ix_(first, first)] = line.covariance
        return replace(line, covariance=covariance)

    return replace(polynomials, scale=scale, bias=bias, lines=(*kept, *map(whole, lines)))


def heating(windows_s: Array, temperature_c: Array) -> tuple[Array, Array]:
    """dT/dt (N,) in K/s, smooth over a few neighbours, and which way (N,) it went: 1 warming, −1 cooling."""
    times = windows_s.mean(axis=1)
    order = np.argsort(times)
    rate = np.empty(len(times))
    for place in range(len(order)):
        near = order[max(0, place - 4) : place + 5]
        since = times[near] - times[near].mean()
        rate[order[place]] = since @ (temperature_c[near] - temperature_c[near].mean()) / (since @ since)
    way, last = np.empty(len(times)), 0.0
    for place in order:
        last = float(np.sign(rate[place])) if abs(rate[place]) > STANDING_K_S else last
        way[place] = last
    return rate, way


@dataclass(frozen=True, slots=True)
class _Fit:
    """Changes in T − reference: of k as a share (3 orders, 3), of c; covariances (18, 18), with and without lag."""

    relative: Array
    bias: Array
    covariance: Array
    known_lag: Array
    aicc: float
    lag_s: float
    lag_std_s: float
    loop: tuple[Array, Array] | None


class _Fits:
    """What fits of all orders share: readings whitened, and the places' offsets taken out of them."""

    def __init__(self, seen: Repeated, reference_c: float, range_c: tuple[float, float]) -> None:
        self.span = max(abs(each - reference_c) for each in range_c)
        places = np.eye(int(seen.places.max()) + 1)[seen.places]
        self.repeats = int(places.sum(axis=0).min())
        self.highest = min(HIGHEST, self.repeats - 2)
        self.powers = np.vander((seen.temperature_c - reference_c) / self.span, HIGHEST + 1, increasing=True)
        slopes = np.column_stack([n * self.powers[:, n - 1] / self.span for n in range(1, HIGHEST + 1)])
        rate, way = heating(seen.windows_s, seen.temperature_c)
        self.slopes = slopes * rate[:, None]
        within = (seen.temperature_c - range_c[0]) / (range_c[1] - range_c[0])
        self.both_ways = min(np.mean(way > 0), np.mean(way < 0)) >= EACH_WAY
        self.loop = (way * 4 * within * (1 - within))[:, None]
        self._take(seen, seen.means)
        self.process = self._process(seen, places)
        weights = 1 / np.median(seen.variances, axis=1)
        self.weights = np.array([self.felt.T**2 * weights, np.tile(weights, (3, 1))])  # (2, 3, N)
        wander = self.process.covariance(seen.windows_s)
        self.whitening = [self._without(places, np.diag(seen.variances[:, axis]) + wander) for axis in range(3)]
        self.count = 3 * (len(seen.means) - places.shape[1])

    def refer(self, seen: Repeated, fit: "_Fit") -> None:
        """Let what is felt be as the sensor reads it at the reference, not in the mean of all temperatures."""
        powers = self.powers[:, 1:] * self.span ** np.arange(1.0, HIGHEST + 1)
        self._take(seen, seen.means - powers @ fit.bias + (1 - 1 / (1 + powers @ fit.relative)) * self.felt)

    def _take(self, seen: Repeated, means: Array) -> None:
        design = np.column_stack([seen.felt, np.ones(len(means))])
        solved, *_ = np.linalg.lstsq(design, means)
        self.scale: Array = 1 / np.linalg.norm(solved[:3], axis=0)
        self.zero: Array = solved[3]
        self.felt: Array = seen.felt @ solved[:3]  # of each axis, as it reads
        self.in_scale = np.concatenate([self.scale, np.ones(3)])
        self.left = seen.means - self.felt

    @staticmethod
    def _without(places: Array, covariance: Array) -> Array:
        """(N − P, N) what makes noise white and takes no notice of the places' offsets."""
        whitened = np.linalg.solve(np.linalg.cholesky(covariance), np.column_stack([places, np.eye(len(places))]))
        basis, _ = np.linalg.qr(whitened[:, : places.shape[1]], mode="complete")
        free: Array = basis[:, places.shape[1] :].T @ whitened[:, places.shape[1] :]
        return free

    def _process(self, seen: Repeated, places: Array) -> BiasProcess:
        some = self.powers[:, 1 : self.highest + 1]
        turned = [seen.felt * power[:, None] for power in some.T]
        design = np.column_stack([places, some, *turned, *([self.loop] if self.both_ways else [])])
        basis, sizes, _ = np.linalg.svd(design, full_matrices=False)
        design = basis[:, sizes > 1e-9 * sizes[0]]
        return bias_process(
            design, self.left, seen.variances, seen.windows_s, instability_rad_s=seen.instability, chosen=walking
        )

    def solve(self, orders: tuple[int, int]) -> _Fit:
        """The fit of these orders of k and c."""
        of_scale, of_bias = orders
        loops = 2 if self.both_ways else 0
        each = of_scale + of_bias + loops
        found = np.zeros(3 * each + 1)  # by axis, then the lag
        for _ in range(STEPS):
            rows, rests = zip(*(self._rows(axis, orders, found) for axis in range(3)), strict=True)
            design = np.vstack(
                [np.pad(row[:, :-1], ((0, 0), (axis * each, (2 - axis) * each))) for axis, row in enumerate(rows)]
            )
            design = np.column_stack([design, np.concatenate([row[:, -1] for row in rows])])
            prior = np.zeros((1, len(found)))
            prior[0, -1] = 1 / LAG_STD_S
            known = np.concatenate([*rests, -prior @ found])
            step, *_ = np.linalg.lstsq(np.vstack([design, prior]), known)
            found = found + step
        left = [self._rows(axis, orders, found)[1] for axis in range(3)]
        square = float(sum(rest @ rest for rest in left) + (found[-1] / LAG_STD_S) ** 2)
        spread = np.linalg.inv(design.T @ design + prior.T @ prior)
        fixed = np.zeros_like(spread)
        if len(found) > 1:
            fixed[:-1, :-1] = np.linalg.inv((design.T @ design)[:-1, :-1])
        free = 3 * (of_scale + of_bias)
        aicc = square + 2 * free + 2 * free * (free + 1) / (self.count - free - 3 * loops - 2)
        return self._fit(orders, found, spread, fixed, aicc)

    def _rows(self, axis: int, orders: tuple[int, int], values: Array) -> tuple[Array, Array]:
        """Derivatives of an axis' whitened readings, the lag's last, and what the model leaves of them."""
        of_scale, of_bias = orders
        each = (len(values) - 1) // 3
        own, lag_s = values[axis * each : (axis + 1) * each], values[-1]
        share, added, loop = np.split(own, [of_scale, of_scale + of_bias])
        scales, biases = self.powers[:, 1 : of_scale + 1], self.powers[:, 1 : of_bias + 1]
        felt, relative = self.felt[:, axis], 1 + scales @ share
        fall = -felt / relative**2
        ways = np.column_stack([felt[:, None] * self.loop, self.loop]) if self.both_ways else np.zeros((len(felt), 0))
        by_lag = self.slopes[:, :of_bias] @ added + fall * (self.slopes[:, :of_scale] @ share)
        model = felt * (1 / relative - 1) + biases @ added + ways @ loop + lag_s * by_lag
        moving = fall[:, None] * (scales + lag_s * self.slopes[:, :of_scale])
        design = np.column_stack([moving, biases + lag_s * self.slopes[:, :of_bias], ways, by_lag])
        free = self.whitening[axis]
        return free @ design, free @ (self.left[:, axis] - model)

    def _fit(self, orders: tuple[int, int], values: Array, spread: Array, fixed: Array, aicc: float) -> _Fit:
        of_scale, of_bias = orders
        each = (len(values) - 1) // 3
        own = values[:-1].reshape(3, each)
        relative, bias = np.zeros((2, HIGHEST, 3))
        size = self.span ** -np.arange(1.0, HIGHEST + 1)
        relative[:of_scale] = own[:, :of_scale].T * size[:of_scale, None]
        bias[:of_bias] = own[:, of_scale : of_scale + of_bias].T * size[:of_bias, None]
        take = np.zeros((6 * HIGHEST, len(values)))
        for axis in range(3):
            for n in range(of_scale):
                take[3 * n + axis, axis * each + n] = size[n]
            for n in range(of_bias):
                take[3 * HIGHEST + 3 * n + axis, axis * each + of_scale + n] = size[n]
        loop = None
        if self.both_ways:  # a share of the reading is one of k with the other sign
            stds = np.sqrt(np.diag(spread))[:-1].reshape(3, each)[:, -2:]
            loop = (own[:, -2:] * [-1.0, 1.0]).T.ravel(), stds.T.ravel()
        lag_std_s = float(np.sqrt(spread[-1, -1]))
        covariance, known_lag = take @ spread @ take.T, take @ fixed @ take.T
        return _Fit(relative, bias, covariance, known_lag, aicc, float(values[-1]), lag_std_s, loop)

    def centre(self, fit: _Fit) -> Array:
        """(2, 3, 3) mean powers of T − reference, weighted as they tell k and c."""
        powers = self.powers[:, 1:] * self.span ** np.arange(1.0, HIGHEST + 1)
        found: Array = np.einsum("qan,np->qpa", self.weights, powers) / self.weights.sum(axis=2)[:, None, :]
        return found

    def spread(self, covariance: Array, centre: Array) -> Array:
        """Covariance (24, 24) of the coefficients, from that (18, 18) of the changes."""
        take = np.vstack([_part(centre, 0), _part(centre, 1)])
        return self.in_units(take @ covariance @ take.T)

    def in_units(self, covariance: Array) -> Array:
        """Covariance (24, 24) with k in its own size, not as a share."""
        size = np.concatenate([np.tile(self.scale, HIGHEST + 1), np.ones(COEFFICIENTS // 2)])
        found: Array = np.outer(size, size) * covariance
        return found


def _part(centre: Array, which: int) -> Array:
    """(12, 18) what takes the changes of k (0) or c (1) to its coefficients, the mean over the readings held.

    At the reference a change that is known too large makes the value too small: the mean power stands there, negative.
    """
    found = np.zeros((3 * (HIGHEST + 1), 6 * HIGHEST))
    at = 3 * HIGHEST * which
    found[3:, at : at + 3 * HIGHEST] = np.eye(3 * HIGHEST)
    for n in range(HIGHEST):
        found[:3, at + 3 * n : at + 3 * n + 3] = -np.diag(centre[which, n])
    return found


def _constant(changes: Array, centre: Array) -> Array:
    found: Array = -np.sum(changes * centre, axis=0)
    return found


def _from_centre(fit: _Fit, centre: Array) -> Array:
    """(24,) coefficients, k as a share, that hold the mean over the readings."""
    parts = [(each, centre[i]) for i, each in enumerate((fit.relative, fit.bias))]
    return np.concatenate([np.concatenate([_constant(*part)[None], part[0]]).ravel() for part in parts])


def _of_loop(size: Array, std: Array) -> Array:
    """Covariance (24, 24) of values that may lie anywhere in the loop, as far as that is more than its noise."""
    found = np.zeros(COEFFICIENTS)
    half = np.maximum(size**2 - std**2, 0.0) / 3
    found[:3], found[COEFFICIENTS // 2 : COEFFICIENTS // 2 + 3] = half[:3], half[3:]
    return np.diag(found)


def _gradient(polynomials: OverTemperature, half_width_k: float) -> Line:
    """What a sensor does that is so much warmer than its thermometer: all of it moves along the polynomials.

    By as much everywhere, and, apart from that, by as much one way at one end of the range as the other way at the
    other: a heater's power, and what flows off into the air, grow with the temperature.
    """
    both = np.array([polynomials.scale, polynomials.bias])
    steep = np.arange(1, HIGHEST + 1)[:, None] * both[:, 1:]
    low, high = polynomials.range_c
    middle_k, half_k = (low + high) / 2 - polynomials.reference_c, (high - low) / 2
    even, tilted = np.zeros((2, *both.shape))
    even[:, :-1] = steep
    tilted[:, 1:] = steep / half_k
    tilted -= middle_k / half_k * even
    patterns = half_width_k / np.sqrt(3) * np.array([even.ravel(), tilted.ravel()])
    source = f"± {half_width_k:g} K otherwise than here, and ± as much from end to end"
    return Line(GRADIENT, "B", "rectangular", source, np.inf, patterns.T @ patterns)


def _repeated_often(seen: Repeated) -> Repeated:
    """Readings of places that were visited often enough. Raises Fault `too_few_observations`."""
    numbers, counts = np.unique(seen.places, return_counts=True)
    often = numbers[counts >= FEWEST]
    kept = np.isin(seen.places, often)
    turned = np.linalg.matrix_rank(seen.felt[kept]) if kept.any() else 0
    if turned < 3:
        raise Fault(
            "too_few_observations",
            f"what tells three axes was repeated less than {FEWEST} times while the temperature moved",
            "Repeat the same sweeps, rests and attitudes at several temperatures",
        )
    again = np.searchsorted(often, seen.places[kept])
    cut = partial(np.compress, kept, axis=0)
    return replace(
        seen, means=cut(seen.means), variances=cut(seen.variances), felt=cut(seen.felt), places=again,
        windows_s=cut(seen.windows_s), temperature_c=cut(seen.temperature_c),
    )  # fmt: skip


def places_of(felt: Array, beside: Array) -> NDArray[np.intp]:
    """(N,) numbers of places: what was felt (N, 3), and what else stood there (N, q), as good as equal in each."""

    def scaled(columns: Array) -> Iterator[Array]:
        size = float(np.abs(columns).max(initial=0.0))
        yield columns / size if size > 0 else columns

    rows = np.column_stack([*scaled(felt), *scaled(beside)])
    found, seen = np.empty(len(rows), dtype=np.intp), list[Array]()
    for i, row in enumerate(rows):
        near = [k for k, each in enumerate(seen) if np.abs(row - each).max() < AS_GOOD_AS_EQUAL]
        if not near:
            seen.append(row)
        found[i] = near[0] if near else len(seen) - 1
    return found

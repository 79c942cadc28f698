"""Scale and bias as polynomials of temperature, from sweeps, rests or dwells repeated while the sensor warms and cools.

Errors that all repeats share (of axes and attitudes, the Earth's rate, gravity) enter an offset for each pose of the
plan. Only the changes from repeat to repeat depend on temperature:

    m = offset(pose) + (1/(1 + q(T)) − 1) F x + c(T) + hysteresis + lag · dT/dt · ∂m/∂T + noise and bias drift

x is the input, F the matrix at the reference temperature, and T − reference is the variable of the polynomials q and c,
which have no constant. The order of q and the order of c, each common to all axes, minimise AICc (Hurvich and Tsai,
Biometrika 76 (1989) 297). The results of the other orders, with their Akaike weights (Burnham and Anderson, Model
Selection, 2002, 4.3), contribute to the uncertainty. The hysteresis, the difference of warming and cooling, closes at
both ends of the range. The thermometer's lag is fitted too.
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
from rig.estimation.statistics.bias_process import BiasProcess, average_walks, bias_process
from rig.estimation.statistics.coverage import coverage_factors, effective_dof
from rig.estimation.temperature.line_names import GRADIENT, HYSTERESIS, LAG, NOISE, ORDER

MAX_ORDER = 3  # as in autopilots
MIN_REPEATS = 4
MIN_RANGE_C = 10.0
LAG_STD_S = 10.0  # prior of a thermometer's lag; assumed
MIN_FRACTION = 0.2  # of the observations during warming, and during cooling, that determine a hysteresis
MIN_CHANGE_K_S = 0.1 / 60  # a slower change counts as one in the previous direction
INPUT_TOLERANCE = 0.03  # largest difference between inputs of one pose, relative to the largest input
GAUSS_NEWTON_STEPS = 6  # the model is linear except for products of small numbers
COEFFICIENT_COUNT = 6 * (MAX_ORDER + 1)  # scale of order 0 xyz, of order 1 xyz, …, then the bias in the same order


@dataclass(frozen=True, slots=True)
class RepeatedMeans:
    """Mean readings of repeated poses.

    - `means` (N, 3) and their `variances` (N, 3); `inputs` (N, 3): rates or specific forces in body axes.
    - `poses` (N,): the index of the plan's pose; `windows_s` (N, 2); `temperature_c` (N,), as measured.
    - `instability`: the Allan deviation of the bias' flicker.
    """

    means: Array
    variances: Array
    inputs: Array
    poses: NDArray[np.intp]
    windows_s: Array
    temperature_c: Array
    instability: float = 0.0


@dataclass(frozen=True, slots=True)
class TemperatureLine:
    """A contributor as in `rig.estimation.gyroscope.budget`, with the `covariance` (24, 24) of the coefficients."""

    name: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    source: str
    dof: float
    covariance: Array


@dataclass(frozen=True, slots=True)
class ValuesAtTemperature:
    """Scale and bias (6,) at a temperature, with their standard and expanded uncertainties (6,)."""

    values: Array
    std: Array
    expanded: Array


@dataclass(frozen=True, slots=True)
class OverTemperature:
    """The polynomials k(T) and c(T) = Σ coefficient (T − reference)ⁿ, n from 0; c is part of the reading.

    - `scale`, `bias` (4, 3): the coefficients of k and c, SI units per Kⁿ; `orders` of k and of c.
    - `range_c`: the only range in which both are valid. `zero` (3,): the readings at the reference for zero input.
    - `lag_s`, `lag_std_s`: the thermometer's lag and its standard deviation.
    - `hysteresis`: scale and bias (6,) while warming minus the means of warming and cooling, in mid-range, and the
      standard deviation of this difference; None with one direction only.
    """

    reference_c: float
    range_c: tuple[float, float]
    orders: tuple[int, int]
    scale: Array
    bias: Array
    lines: tuple[TemperatureLine, ...]
    zero: Array
    lag_s: float
    lag_std_s: float
    hysteresis: tuple[Array, Array] | None
    process: BiasProcess
    repeats: int

    @property
    def coefficients(self) -> Array:
        """The coefficients (24,) in the order of the covariance."""
        return np.concatenate([self.scale.ravel(), self.bias.ravel()])

    @property
    def covariance(self) -> Array:
        """The covariance (24, 24) of all contributors together."""
        combined: Array = np.sum([line.covariance for line in self.lines], axis=0)
        return combined

    def evaluate(self, temperature_c: float) -> ValuesAtTemperature:
        """Return the values at a temperature. Raise Fault `temperature_outside`."""
        check_inside(self.range_c, temperature_c)
        rows = powers_at(temperature_c - self.reference_c)
        variances = np.array([np.einsum("qi,ij,qj->q", rows, line.covariance, rows) for line in self.lines])
        std = np.sqrt(variances.sum(axis=0).clip(min=0.0))
        dof = effective_dof(variances, np.array([[line.dof] for line in self.lines]))
        return ValuesAtTemperature(rows @ self.coefficients, std, coverage_factors(dof) * std)

    def correct_to_reference(self, readings: Array, temperature_c: Array) -> Array:
        """Return readings (N, 3) corrected from their temperatures (N,) to the reference."""
        relative, added = self.changes(temperature_c)
        moved: Array = relative * (readings - added - self.zero) + self.zero
        return moved

    def changes(self, temperature_c: Array) -> tuple[Array, Array]:
        """Return k divided by its value at the reference temperature, and c minus the value there, (N, 3) each."""
        rows = np.vander(temperature_c - self.reference_c, MAX_ORDER + 1, increasing=True)
        return rows @ (self.scale / self.scale[0]), rows[:, 1:] @ self.bias[1:]


def check_inside(range_c: tuple[float, float], temperature_c: float) -> None:
    """Raise Fault `temperature_outside` for a temperature outside the range."""
    low, high = range_c
    if not low <= temperature_c <= high:
        raise Fault(
            "temperature_outside",
            f"the polynomials hold from {low:.1f} to {high:.1f} °C, but {temperature_c:.1f} °C is requested",
            "Request a temperature in that range, or measure over a wider one",
        )


def powers_at(difference_k: float) -> Array:
    """Return the matrix (6, 24) from the coefficients to k and c at a difference from the reference temperature."""
    rows = np.kron(np.eye(2), np.kron(difference_k ** np.arange(MAX_ORDER + 1), np.eye(3)))
    return np.asarray(rows, dtype=np.float64)


def fit_over_temperature(readings: RepeatedMeans, reference_c: float, gradient_k: float) -> OverTemperature:
    """Return scale and bias as polynomials of T − `reference_c`, fitted to the readings.

    Plain least squares determine the scale factors at the reference; `combine_with_reference` replaces them by better
    ones. When the sensor is in use, the temperature difference between thermometer and sensor may differ by up to
    `gradient_k`. Raise Fault `too_few_observations`, `temperature_range_too_small`, `temperature_outside`,
    `not_finite`.
    """
    check_finite(means=readings.means, temperature_c=readings.temperature_c)
    range_c = (float(readings.temperature_c.min()), float(readings.temperature_c.max()))
    if range_c[1] - range_c[0] < MIN_RANGE_C:
        raise Fault(
            "temperature_range_too_small",
            f"the sensor was between {range_c[0]:.1f} and {range_c[1]:.1f} °C; polynomials need {MIN_RANGE_C:g} °C",
            "Warm and cool the sensor over the range in which it will be used",
        )
    check_inside(range_c, reference_c)
    readings = _drop_rare_poses(readings)
    fits = _ParameterFits(readings, reference_c, range_c)
    fits.refer(readings, fits.solve((fits.highest, fits.highest)))
    every_order = range(fits.highest + 1)
    tried = {orders: fits.solve(orders) for orders in product(every_order, every_order)}
    best = min(tried, key=lambda orders: tried[orders].aicc)
    chosen = tried[best]
    centre = fits.centre(chosen)
    weights = {orders: float(np.exp((chosen.aicc - fit.aicc) / 2)) for orders, fit in tried.items()}
    total = sum(weights.values())
    chosen_coefficients = _centre_coefficients(chosen, centre)
    differences = [
        (weights[orders] / total, _centre_coefficients(fit, centre) - chosen_coefficients)
        for orders, fit in tried.items()
    ]
    without_lag, loop = chosen.without_lag, chosen.loop
    scale = np.concatenate([np.ones((1, 3)), chosen.relative]) * fits.scale
    bias = np.concatenate([_constant(chosen.bias, centre[1])[None], chosen.bias])
    among_orders = sum((w * np.outer(d, d) for w, d in differences), np.zeros((COEFFICIENT_COUNT, COEFFICIENT_COUNT)))
    by_lag = fits.covariance(chosen.covariance - without_lag, centre)
    scatter = fits.covariance(without_lag, centre)
    lines = [
        TemperatureLine(NOISE, "A", "normal", "scatter of the repeats", float(fits.process.dof), scatter),
        TemperatureLine(LAG, "A", "normal", "readings of warming against cooling", np.inf, by_lag),
        TemperatureLine(ORDER, "A", "normal", "weights of the other orders", np.inf, fits.rescale(among_orders)),
    ]
    if loop is not None:
        source = "half of the difference between warming and cooling"
        covariance = fits.rescale(_loop_covariance(*loop))
        lines.append(TemperatureLine(HYSTERESIS, "A", "rectangular", source, np.inf, covariance))
    fitted = OverTemperature(
        reference_c, range_c, best, scale, bias, tuple(lines), fits.zero, chosen.lag_s, chosen.lag_std_s,
        None if loop is None else (loop[0] * fits.in_scale, loop[1] * fits.in_scale), fits.process, fits.repeats,
    )  # fmt: skip
    return replace(fitted, lines=(*lines, _gradient(fitted, gradient_k)))


def combine_with_reference(
    polynomials: OverTemperature, values: Array, lines: tuple[TemperatureLine, ...]
) -> OverTemperature:
    """Return the polynomials with k and c (6,) at the reference temperature replaced by `values`.

    `values` come from another solution, of readings corrected to that temperature. `lines` are the contributors to its
    uncertainty, each with a covariance (6, 6), without the error of the correction.
    """
    scale, bias = polynomials.scale * values[:3] / polynomials.scale[0], polynomials.bias.copy()
    bias[0] = values[3:]
    ratio = np.concatenate([np.tile(values[:3] / polynomials.scale[0], MAX_ORDER + 1), np.ones(COEFFICIENT_COUNT // 2)])
    kept = tuple(replace(line, covariance=np.outer(ratio, ratio) * line.covariance) for line in polynomials.lines)
    first = np.r_[0:3, COEFFICIENT_COUNT // 2 : COEFFICIENT_COUNT // 2 + 3]

    def whole(line: TemperatureLine) -> TemperatureLine:
        covariance = np.zeros((COEFFICIENT_COUNT, COEFFICIENT_COUNT))
        covariance[np.ix_(first, first)] = line.covariance
        return replace(line, covariance=covariance)

    return replace(polynomials, scale=scale, bias=bias, lines=(*kept, *map(whole, lines)))


def heating_rate(windows_s: Array, temperature_c: Array) -> tuple[Array, Array]:
    """Return dT/dt (N,) in K/s, smoothed over a few neighbours, and its direction (N,): 1 warming, −1 cooling."""
    times = windows_s.mean(axis=1)
    order = np.argsort(times)
    rate = np.empty(len(times))
    for position in range(len(order)):
        near = order[max(0, position - 4) : position + 5]
        since = times[near] - times[near].mean()
        rate[order[position]] = since @ (temperature_c[near] - temperature_c[near].mean()) / (since @ since)
    direction, last = np.empty(len(times)), 0.0
    for position in order:
        last = float(np.sign(rate[position])) if abs(rate[position]) > MIN_CHANGE_K_S else last
        direction[position] = last
    return rate, direction


@dataclass(frozen=True, slots=True)
class _TemperatureFit:
    """One fit: the coefficients of (T − reference)ⁿ for n = 1 to 3 (rows) and each axis (columns).

    `relative` (3, 3): those of k, as fractions of k at the reference; `bias` (3, 3): those of c.
    `covariance` (18, 18) includes the effect of the fitted lag, `without_lag` (18, 18) does not. `loop`: hysteresis
    (6,) of scale and bias, and its standard deviation; None unless the sensor was both warmed and cooled.
    """

    relative: Array
    bias: Array
    covariance: Array
    without_lag: Array
    aicc: float
    lag_s: float
    lag_std_s: float
    loop: tuple[Array, Array] | None


class _ParameterFits:
    """The common part of fits of all orders: whitened readings without the poses' offsets."""

    def __init__(self, readings: RepeatedMeans, reference_c: float, range_c: tuple[float, float]) -> None:
        """Whiten the readings. Powers are of (T − `reference_c`) / `span`, at most 1 in size within `range_c`."""
        self.span = max(abs(limit_c - reference_c) for limit_c in range_c)
        poses = np.eye(int(readings.poses.max()) + 1)[readings.poses]
        self.repeats = int(poses.sum(axis=0).min())
        self.highest = min(MAX_ORDER, self.repeats - 2)
        self.powers = np.vander((readings.temperature_c - reference_c) / self.span, MAX_ORDER + 1, increasing=True)
        slopes = np.column_stack([n * self.powers[:, n - 1] / self.span for n in range(1, MAX_ORDER + 1)])
        rate, direction = heating_rate(readings.windows_s, readings.temperature_c)
        self.slopes = slopes * rate[:, None]
        within = (readings.temperature_c - range_c[0]) / (range_c[1] - range_c[0])
        self.has_both_directions = min(np.mean(direction > 0), np.mean(direction < 0)) >= MIN_FRACTION
        self.loop = (direction * 4 * within * (1 - within))[:, None]
        self._fit_inputs(readings, readings.means)
        self.process = self._process(readings, poses)
        weights = 1 / np.median(readings.variances, axis=1)
        self.weights = np.array([self.inputs.T**2 * weights, np.tile(weights, (3, 1))])  # (2, 3, N)
        bias_covariance = self.process.covariance(readings.windows_s)
        self.whitening = [
            self._whiten_without_offsets(poses, np.diag(variances) + bias_covariance)
            for variances in readings.variances.T
        ]
        self.count = 3 * (len(readings.means) - poses.shape[1])

    def refer(self, readings: RepeatedMeans, fit: "_TemperatureFit") -> None:
        """Recompute the inputs from the readings corrected to the reference by `fit`, instead of uncorrected ones."""
        powers = self.powers[:, 1:] * self.span ** np.arange(1.0, MAX_ORDER + 1)
        self._fit_inputs(
            readings, readings.means - powers @ fit.bias + (1 - 1 / (1 + powers @ fit.relative)) * self.inputs
        )

    def _fit_inputs(self, readings: RepeatedMeans, means: Array) -> None:
        design = np.column_stack([readings.inputs, np.ones(len(means))])
        solved, *_ = np.linalg.lstsq(design, means)
        self.scale: Array = 1 / np.linalg.norm(solved[:3], axis=0)
        self.zero: Array = solved[3]
        self.inputs: Array = readings.inputs @ solved[:3]  # inputs along each sensing axis
        self.in_scale = np.concatenate([self.scale, np.ones(3)])
        self.residuals = readings.means - self.inputs

    @staticmethod
    def _whiten_without_offsets(poses: Array, covariance: Array) -> Array:
        """Return the matrix (N − P, N) that whitens noise and removes the poses' offsets."""
        whitened = np.linalg.solve(np.linalg.cholesky(covariance), np.column_stack([poses, np.eye(len(poses))]))
        basis, _ = np.linalg.qr(whitened[:, : poses.shape[1]], mode="complete")
        return np.asarray(basis[:, poses.shape[1] :].T @ whitened[:, poses.shape[1] :], dtype=np.float64)

    def _process(self, readings: RepeatedMeans, poses: Array) -> BiasProcess:
        """Return the bias process in the residuals of the polynomials of the highest order."""
        some = self.powers[:, 1 : self.highest + 1]
        turned = [readings.inputs * power[:, None] for power in some.T]
        design = np.column_stack([poses, some, *turned, *([self.loop] if self.has_both_directions else [])])
        basis, sizes, _ = np.linalg.svd(design, full_matrices=False)
        design = basis[:, sizes > 1e-9 * sizes[0]]
        return bias_process(
            design,
            self.residuals,
            readings.variances,
            readings.windows_s,
            instability_rad_s=readings.instability,
            chosen=average_walks,
        )

    def solve(self, orders: tuple[int, int]) -> _TemperatureFit:
        """Return the fit of temperature polynomials of the given orders for k and c."""
        of_scale, of_bias = orders
        loops = 2 if self.has_both_directions else 0
        per_axis = of_scale + of_bias + loops
        values = np.zeros(3 * per_axis + 1)  # by axis, then the lag
        prior = np.zeros((1, len(values)))
        prior[0, -1] = 1 / LAG_STD_S
        for _ in range(GAUSS_NEWTON_STEPS):
            rows, residuals = zip(*(self._rows(axis, orders, values) for axis in range(3)), strict=True)
            design = np.vstack(
                [
                    np.pad(row[:, :-1], ((0, 0), (axis * per_axis, (2 - axis) * per_axis)))
                    for axis, row in enumerate(rows)
                ]
            )
            design = np.column_stack([design, np.concatenate([row[:, -1] for row in rows])])
            right_side = np.concatenate([*residuals, -prior @ values])
            step, *_ = np.linalg.lstsq(np.vstack([design, prior]), right_side)
            values = values + step
        residuals = [self._rows(axis, orders, values)[1] for axis in range(3)]
        chi_square = float(sum(residual @ residual for residual in residuals) + (values[-1] / LAG_STD_S) ** 2)
        information = design.T @ design  # pyrefly: ignore[unbound-name]  # GAUSS_NEWTON_STEPS > 0
        covariance = np.asarray(np.linalg.inv(information + prior.T @ prior), dtype=np.float64)
        fixed = np.zeros_like(covariance)
        if len(values) > 1:
            fixed[:-1, :-1] = np.linalg.inv(information[:-1, :-1])
        count = 3 * (of_scale + of_bias)  # of free coefficients
        aicc = chi_square + 2 * count + 2 * count * (count + 1) / (self.count - count - 3 * loops - 2)
        return self._fit(orders, values, covariance, fixed, aicc)

    def _rows(self, axis: int, orders: tuple[int, int], values: Array) -> tuple[Array, Array]:
        """Return an axis's whitened design, with columns for k, c, hysteresis and lag, and its whitened residuals.

            m = offset + x (1/r − 1) + c + hysteresis + lag · dT/dt · ∂m/∂T,   r = 1 + q(T)

        x are the inputs along the axis in the readings' unit; `values` contain the coefficients of the polynomials q
        and c, the size of the hysteresis, and the lag.
        """
        of_scale, of_bias = orders
        per_axis = (len(values) - 1) // 3
        by_axis, lag_s = values[axis * per_axis : (axis + 1) * per_axis], values[-1]
        scale, added, loop = np.split(by_axis, [of_scale, of_scale + of_bias])
        scales, biases = self.powers[:, 1 : of_scale + 1], self.powers[:, 1 : of_bias + 1]
        inputs, relative = self.inputs[:, axis], 1 + scales @ scale
        fall = -inputs / relative**2
        loops = (
            np.column_stack([inputs[:, None] * self.loop, self.loop])
            if self.has_both_directions
            else np.zeros((len(inputs), 0))
        )
        by_lag = self.slopes[:, :of_bias] @ added + fall * (self.slopes[:, :of_scale] @ scale)
        model = inputs * (1 / relative - 1) + biases @ added + loops @ loop + lag_s * by_lag
        moving = fall[:, None] * (scales + lag_s * self.slopes[:, :of_scale])
        design = np.column_stack([moving, biases + lag_s * self.slopes[:, :of_bias], loops, by_lag])
        free = self.whitening[axis]
        return free @ design, free @ (self.residuals[:, axis] - model)

    def _fit(
        self, orders: tuple[int, int], values: Array, covariance: Array, fixed: Array, aicc: float
    ) -> _TemperatureFit:
        """Return the fit of `orders` from its `values` (p,): scale, bias and hysteresis of each axis, then the lag."""
        of_scale, of_bias = orders
        per_axis = (len(values) - 1) // 3
        by_axis = values[:-1].reshape(3, per_axis)
        relative, bias = np.zeros((2, MAX_ORDER, 3))
        size = self.span ** -np.arange(1.0, MAX_ORDER + 1)
        relative[:of_scale] = by_axis[:, :of_scale].T * size[:of_scale, None]
        bias[:of_bias] = by_axis[:, of_scale : of_scale + of_bias].T * size[:of_bias, None]
        take = np.zeros((6 * MAX_ORDER, len(values)))
        for axis in range(3):
            for n in range(of_scale):
                take[3 * n + axis, axis * per_axis + n] = size[n]
            for n in range(of_bias):
                take[3 * MAX_ORDER + 3 * n + axis, axis * per_axis + of_scale + n] = size[n]
        loop = None
        if self.has_both_directions:  # a fraction of the reading equals one of k with the opposite sign
            stds = np.sqrt(np.diag(covariance))[:-1].reshape(3, per_axis)[:, -2:]
            loop = (by_axis[:, -2:] * [-1.0, 1.0]).T.ravel(), stds.T.ravel()
        lag_std_s = float(np.sqrt(covariance[-1, -1]))
        covariance, without_lag = take @ covariance @ take.T, take @ fixed @ take.T
        return _TemperatureFit(relative, bias, covariance, without_lag, aicc, float(values[-1]), lag_std_s, loop)

    def centre(self, fit: _TemperatureFit) -> Array:
        """Return the mean powers (2, 3, 3) of T − reference, weighted as in the means of k and of c."""
        powers = self.powers[:, 1:] * self.span ** np.arange(1.0, MAX_ORDER + 1)
        centre: Array = np.einsum("qan,np->qpa", self.weights, powers) / self.weights.sum(axis=2)[:, None, :]
        return centre

    def covariance(self, covariance: Array, centre: Array) -> Array:
        """Return the covariance (24, 24) of all coefficients, from the `covariance` (18, 18) of orders 1 to 3."""
        take = np.vstack([_coefficients_from_changes(centre, 0), _coefficients_from_changes(centre, 1)])
        return self.rescale(take @ covariance @ take.T)

    def rescale(self, covariance: Array) -> Array:
        """Return the covariance (24, 24) for absolute instead of relative k."""
        size = np.concatenate([np.tile(self.scale, MAX_ORDER + 1), np.ones(COEFFICIENT_COUNT // 2)])
        scaled: Array = np.outer(size, size) * covariance
        return scaled


def _coefficients_from_changes(centre: Array, which: int) -> Array:
    """Return the matrix (12, 18) from the orders 1 to 3 of k and c to the orders 0 to 3 of k (`which` 0) or c (1).

    Order 0 is the value at the reference. The mean value over the readings is fixed, so an error of a coefficient
    changes order 0 by minus that error times the mean power of T − reference, `centre` (2, 3, 3).
    """
    matrix = np.zeros((3 * (MAX_ORDER + 1), 6 * MAX_ORDER))
    first = 3 * MAX_ORDER * which
    matrix[3:, first : first + 3 * MAX_ORDER] = np.eye(3 * MAX_ORDER)
    for n in range(MAX_ORDER):
        matrix[:3, first + 3 * n : first + 3 * n + 3] = -np.diag(centre[which, n])
    return matrix


def _constant(changes: Array, centre: Array) -> Array:
    constant: Array = -np.sum(changes * centre, axis=0)
    return constant


def _centre_coefficients(fit: _TemperatureFit, centre: Array) -> Array:
    """Return coefficients (24,), relative for k, that do not change the mean over the readings."""
    parts = [(changes, centre[i]) for i, changes in enumerate((fit.relative, fit.bias))]
    return np.concatenate([np.concatenate([_constant(*part)[None], part[0]]).ravel() for part in parts])


def _loop_covariance(size: Array, std: Array) -> Array:
    """Return the coefficients' covariance (24, 24) due to the hysteresis, a half-width `size` (6,).

    The square of its `std` (6,) is subtracted, because noise enlarges the square of an estimated size.
    """
    variances = np.zeros(COEFFICIENT_COUNT)
    half = np.maximum(size**2 - std**2, 0.0) / 3
    variances[:3], variances[COEFFICIENT_COUNT // 2 : COEFFICIENT_COUNT // 2 + 3] = half[:3], half[3:]
    return np.diag(variances)


def _gradient(polynomials: OverTemperature, half_width_k: float) -> TemperatureLine:
    """Return the contributor of the temperature difference between sensor and thermometer.

    A difference changes each value in proportion to its polynomial's slope. One part of the difference is the same over
    the range; an independent part has opposite signs at the range's ends, because a heater's power and the loss to the
    air grow with temperature.
    """
    both = np.array([polynomials.scale, polynomials.bias])
    steep = np.arange(1, MAX_ORDER + 1)[:, None] * both[:, 1:]
    low, high = polynomials.range_c
    middle_k, half_k = (low + high) / 2 - polynomials.reference_c, (high - low) / 2
    even, tilted = np.zeros((2, *both.shape))
    even[:, :-1] = steep
    tilted[:, 1:] = steep / half_k
    tilted -= middle_k / half_k * even
    patterns = half_width_k / np.sqrt(3) * np.array([even.ravel(), tilted.ravel()])
    source = f"± {half_width_k:g} K different from here, and ± as much from end to end"
    return TemperatureLine(GRADIENT, "B", "rectangular", source, np.inf, patterns.T @ patterns)


def _drop_rare_poses(readings: RepeatedMeans) -> RepeatedMeans:
    """Return the readings of poses with enough repeats. Raise Fault `too_few_observations`."""
    numbers, counts = np.unique(readings.poses, return_counts=True)
    often = numbers[counts >= MIN_REPEATS]
    kept = np.isin(readings.poses, often)
    turned = np.linalg.matrix_rank(readings.inputs[kept]) if kept.any() else 0
    if turned < 3:
        raise Fault(
            "too_few_observations",
            f"poses that determine three axes were repeated less than {MIN_REPEATS} times while the temperature moved",
            "Repeat the same sweeps, rests and attitudes at several temperatures",
        )
    again = np.searchsorted(often, readings.poses[kept])
    cut = partial(np.compress, kept, axis=0)
    return replace(
        readings, means=cut(readings.means), variances=cut(readings.variances), inputs=cut(readings.inputs),
        poses=again, windows_s=cut(readings.windows_s), temperature_c=cut(readings.temperature_c),
    )  # fmt: skip


def group_by_input(inputs: Array, conditions: Array) -> NDArray[np.intp]:
    """Return the index (N,) of each reading's pose; in one pose `inputs` and `conditions` are nearly constant."""

    def scale_columns(columns: Array) -> Iterator[Array]:
        size = float(np.abs(columns).max(initial=0.0))
        yield columns / size if size > 0 else columns

    rows = np.column_stack([*scale_columns(inputs), *scale_columns(conditions)])
    poses, distinct = np.empty(len(rows), dtype=np.intp), list[Array]()
    for i, row in enumerate(rows):
        near = [k for k, other in enumerate(distinct) if np.abs(row - other).max() < INPUT_TOLERANCE]
        if not near:
            distinct.append(row)
        poses[i] = near[0] if near else len(distinct) - 1
    return poses

"""Fits of the polynomials of scale and bias over temperature to the readings of repeated poses, for given orders.

The model is that of `rig.estimation.temperature.over_temperature`. The weights follow from noise and bias drift.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.estimation.statistics.bias_process import BiasProcess, average_walks, bias_process
from rig.estimation.temperature.temperature_polynomials import COEFFICIENT_COUNT, MAX_ORDER

LAG_STD_S = 10.0  # prior of a thermometer's lag; assumed
MIN_FRACTION = 0.2  # of the observations during warming, and during cooling, that determine a hysteresis
MIN_CHANGE_K_S = 0.1 / 60  # a slower change counts as one in the previous direction
GAUSS_NEWTON_STEPS = 6  # the model is linear except for products of small numbers


@dataclass(frozen=True, slots=True)
class RepeatedMeans:
    """Mean readings of repeated poses.

    - `means` (N, 3) and their `variances` (N, 3); `inputs` (N, 3): rates or specific forces in body axes.
    - `poses` (N,): the index of the plan's pose; `windows_s` (N, 2): start and end; `temperature_c` (N,), as measured.
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
class TemperatureFit:
    """One fit: the coefficients of (T − reference)ⁿ for n = 1 to 3 (rows) and each axis (columns).

    `relative` (3, 3): those of the scale, as fractions of the scale at the reference; `bias` (3, 3): those of the bias.
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


class ParameterFits:
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
        self.loop = (direction * 4 * within * (1 - within))[:, None]  # zero at both ends, 1 in mid-range
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

    def refer(self, readings: RepeatedMeans, fit: "TemperatureFit") -> None:
        """Recompute the inputs from readings that `fit` has corrected to the reference temperature."""
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

    def solve(self, orders: tuple[int, int]) -> TemperatureFit:
        """Return the fit of temperature polynomials of these `orders`: for the scale k, and for the bias c."""
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
        and c, which have the given `orders`, the size of the hysteresis, and the lag.
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
    ) -> TemperatureFit:
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
        return TemperatureFit(relative, bias, covariance, without_lag, aicc, float(values[-1]), lag_std_s, loop)

    def centre(self, fit: TemperatureFit) -> Array:
        """Return the means (2, 3, 3) of the powers 1 to 3 of T − reference, for each axis.

        Of the two, the first has the weights of the mean scale, the second those of the mean bias.
        """
        powers = self.powers[:, 1:] * self.span ** np.arange(1.0, MAX_ORDER + 1)
        centre: Array = np.einsum("qan,np->qpa", self.weights, powers) / self.weights.sum(axis=2)[:, None, :]
        return centre

    def covariance(self, covariance: Array, centre: Array) -> Array:
        """Return the covariance (24, 24) of all coefficients, from the `covariance` (18, 18) of orders 1 to 3."""
        take = np.vstack([_coefficients_from_changes(centre, 0), _coefficients_from_changes(centre, 1)])
        return self.rescale(take @ covariance @ take.T)

    def rescale(self, covariance: Array) -> Array:
        """Return the covariance (24, 24) of the coefficients, with those of the scale absolute instead of relative."""
        size = np.concatenate([np.tile(self.scale, MAX_ORDER + 1), np.ones(COEFFICIENT_COUNT // 2)])
        scaled: Array = np.outer(size, size) * covariance
        return scaled


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


def _coefficients_from_changes(centre: Array, which: int) -> Array:
    """Return the matrix (12, 18) that adds order 0 to the coefficients' errors, of scale (`which` = 0) or bias (1).

    It maps the errors of the orders 1 to 3 of both to those of the orders 0 to 3 of one.

    Order 0 is the value at the reference. The mean value over the readings is fixed, so an error of a coefficient
    changes order 0 by minus that error times the mean power of T − reference, `centre` (2, 3, 3).
    """
    matrix = np.zeros((3 * (MAX_ORDER + 1), 6 * MAX_ORDER))
    first = 3 * MAX_ORDER * which
    matrix[3:, first : first + 3 * MAX_ORDER] = np.eye(3 * MAX_ORDER)
    for n in range(MAX_ORDER):
        matrix[:3, first + 3 * n : first + 3 * n + 3] = -np.diag(centre[which, n])
    return matrix

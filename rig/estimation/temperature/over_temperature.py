"""Scale and bias as polynomials of temperature, from sweeps, rests or dwells repeated while the sensor warms and cools.

Errors that all repeats share (of axes and attitudes, the Earth's rate, gravity) enter an offset for each pose of the
plan. Only the changes from repeat to repeat depend on temperature:

    m = offset(pose) + (1/(1 + q(T)) − 1) F x + c(T) + hysteresis + lag · dT/dt · ∂m/∂T + noise and bias drift

x is the input, F the matrix at the reference temperature, and T − reference is the variable of the polynomials q and c,
which have no constant. The order of q and the order of c, each common to all axes, minimise AICc (Hurvich and Tsai,
Biometrika 76 (1989) 297). The results of the other orders, with their Akaike weights (Burnham and Anderson, Model
Selection, 2002, 4.3), contribute to the uncertainty. The hysteresis, the difference of warming and cooling, is zero at
both ends of the range. The thermometer's lag is fitted too.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.refusals import check_finite
from rig.estimation.temperature.line_names import GRADIENT, HYSTERESIS, LAG, NOISE, ORDER
from rig.estimation.temperature.polynomial_fits import ParameterFits, RepeatedMeans, TemperatureFit
from rig.estimation.temperature.temperature_polynomials import (
    COEFFICIENT_COUNT,
    MAX_ORDER,
    OverTemperature,
    TemperatureLine,
    check_inside,
)

MIN_REPEATS = 4
MIN_RANGE_C = 10.0
INPUT_TOLERANCE = 0.03  # largest difference between inputs of one pose, relative to the largest input


def fit_over_temperature(readings: RepeatedMeans, reference_c: float, gradient_k: float) -> OverTemperature:
    """Return scale and bias as polynomials of T − `reference_c`, fitted to the readings.

    Plain least squares determine the scale factors at the reference; `combine_with_reference` replaces them by better
    ones. When the sensor is in use, the temperature difference between thermometer and sensor may deviate from that in
    these readings by up to `gradient_k`. Raise Fault `too_few_observations`, `temperature_range_too_small`,
    `temperature_outside`, `not_finite`.
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
    fits = ParameterFits(readings, reference_c, range_c)
    fits.refer(readings, fits.solve((fits.highest, fits.highest)))  # inputs x at the reference temperature
    every_order = range(fits.highest + 1)
    tried = {orders: fits.solve(orders) for orders in product(every_order, every_order)}
    best = min(tried, key=lambda orders: tried[orders].aicc)
    chosen = tried[best]
    centre = fits.centre(chosen)
    # Akaike weights, relative to that of the best orders.
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


def _constant(changes: Array, centre: Array) -> Array:
    constant: Array = -np.sum(changes * centre, axis=0)
    return constant


def _centre_coefficients(fit: TemperatureFit, centre: Array) -> Array:
    """Return the coefficients (24,) of orders 0 to 3: first those of the scale, relative, then those of the bias.

    Order 0 is such that the mean value over the readings does not change.
    """
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
    the range. Another part, independent of the first, changes its sign from one end of the range to the other, because
    a heater's power and the loss to the air grow with temperature.
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

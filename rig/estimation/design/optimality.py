"""Optimality of a set of sweep directions: G-optimality, as in section II-B of the paper SIX, and c-optimality.

The variance of the fitted model's prediction at a point x is N f(x)ᵀ (XᵀX)⁻¹ f(x), in units of one observation's
variance. Its mean over the design's own points is exactly p, the number of parameters, so its largest value is at least
p. A design whose largest value on the sphere is p is G-optimal, and then also D-optimal (Kiefer and Wolfowitz).

There are two models. "squared" is the paper's Eq. (4), with f = [x² y² z² x y z] and p = 6; its constant β0 follows
from the six. "vector" has f = [x y z 1] and p = 4 for each axis. Directions are unit vectors; a zero vector is a rest,
which only the vector model can use.
"""

from collections.abc import Mapping
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation import design

Model = Literal["squared", "vector"]

PARAMETER_COUNT: Mapping[Model, int] = {"squared": 6, "vector": 4}


def prediction_variance(directions: ArrayLike, points: ArrayLike, model: Model = "squared") -> Array:
    """Return the prediction variance (M,) at `points` (M, 3) for sweeps in `directions` (N, 3); inf if singular.

    At a point x it is N f(x)ᵀ (XᵀX)⁻¹ f(x), with the model's terms f, which for the directions are the rows of X.
    """
    x, f = _features(directions, model), _features(points, model)
    if np.linalg.matrix_rank(x) < x.shape[1]:
        return np.full(len(f), np.inf)
    information = x.T @ x / len(x)
    return np.asarray(np.einsum("mi,mi->m", f, np.linalg.solve(information, f.T).T), dtype=np.float64)


def maximum_prediction_variance(directions: ArrayLike, model: Model = "squared") -> float:
    """Return the largest `prediction_variance` on the unit sphere: the G-criterion, at least `PARAMETER_COUNT[model]`.

    The variance is a smooth quartic, so a local search from the best point of a fine grid finds its maximum.
    """
    from scipy.optimize import minimize

    grid = _sphere(20000)
    values = prediction_variance(directions, grid, model)
    best = int(np.argmax(values))
    if not np.isfinite(values[best]):
        return float("inf")

    def negative_variance(point: Array) -> float:
        return -float(prediction_variance(directions, (point / np.linalg.norm(point))[None], model)[0])

    climbed = minimize(negative_variance, grid[best], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
    return max(float(values[best]), -float(climbed.fun))


def g_efficiency(directions: ArrayLike, model: Model = "squared") -> float:
    """Return the number of parameters over the worst prediction variance: 1 if G-optimal, 0 if singular."""
    return PARAMETER_COUNT[model] / maximum_prediction_variance(directions, model)


def c_efficiency(directions: ArrayLike, what: Literal["scale", "bias"] = "scale") -> float:
    """Return the c-efficiency of sweeps for the scale factors, or the biases: 1 at best, 0 for a singular design.

    The criterion is Elfving's c-optimality: the variance N cᵀ(XᵀX)⁻¹c of one combination of the parameters, with the
    coefficients c and the design X; here it is the variance of the worst axis. The squares of a direction's components
    add up to 1, so the worst variance is at least 3 for a scale factor and 1 for a bias.
    """
    features = _features(directions, "vector")
    if np.linalg.matrix_rank(features) < PARAMETER_COUNT["vector"]:
        return 0.0
    variances = len(features) * np.diag(np.linalg.inv(features.T @ features))
    return float(3 / variances[:3].max() if what == "scale" else 1 / variances[3])


def list_designs() -> dict[str, Array]:
    """Return sets of sweep directions (N, 3), by name: the paper's "six", and others to compare with it."""
    axes = np.eye(3)
    six = np.concatenate([axes, -axes])
    corners = np.array(list(product((1.0, -1.0), repeat=3))) / np.sqrt(3)
    edges = np.array([[s, t, 0.0] for s, t in product((1.0, -1.0), repeat=2)]) / np.sqrt(2)
    edges = np.concatenate([edges, np.roll(edges, 1, axis=1), np.roll(edges, 2, axis=1)])
    golden = (1 + np.sqrt(5)) / 2
    icosahedron = np.array([[0.0, s, t * golden] for s, t in product((1.0, -1.0), repeat=2)]) / np.hypot(1, golden)
    icosahedron = np.concatenate([icosahedron, np.roll(icosahedron, 1, axis=1), np.roll(icosahedron, 2, axis=1)])
    return {
        "six": six,
        "six and six rests": np.concatenate([six, np.zeros((6, 3))]),
        "six, one direction twice": np.concatenate([six, axes[:1]]),
        "tetrahedron": corners[[0, 3, 5, 6]],
        "eight corners": corners,
        "twelve edges": edges,
        "icosahedron": icosahedron,
        "six and eight": np.concatenate([six, corners]),
        "one direction missing": six[:5],
    }


def _features(points: ArrayLike, model: Model) -> Array:
    x = np.atleast_2d(np.asarray(points, dtype=np.float64))
    if model == "squared":
        return design(x)
    return np.concatenate([x, np.ones((len(x), 1))], axis=1)


def _sphere(count: int) -> Array:
    """Return points (count, 3) spread evenly over the unit sphere, on a spiral."""
    step = np.arange(count) + 0.5
    z = 1 - 2 * step / count
    turn = np.pi * (1 + np.sqrt(5)) * step
    radius = np.sqrt(1 - z**2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)

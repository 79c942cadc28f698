"""The second-order effect of mounting errors on scale and bias: a tilt multiplies a rate by the tilt's cosine.

If sweeps do not determine an item's mounting, only the size of the rates' angular errors is known. Their first-order
effect is propagated like that of any other error. The mean and the covariance of the second-order effect, 150 ppm for
1°, follow from the covariance of the angles (JCGM 100, 5.1.2, note). Every stage of the run, that is, every mounting of
the item, has angles of its own, including the first stage. So a rotation that all stages have in common, which changes
no scale, has no effect here either.
"""

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_fit import VectorFit
from rig.estimation.gyroscope.vector_model import design_matrix, propagate_speed_std, regress


def propagate_mount_squares(explained: VectorFit) -> Array:
    """Return the mean square (6, 6) of the mounts' second-order effect on kx ky kz bx by bz; zero if mounts are exact.

    Let ε ~ N(0, C) be the remaining errors of the mounts, and H and H' the second derivatives of two of the parameters.
    The second-order effect εᵀHε/2 has the mean tr(HC)/2, and the covariance tr(HCH'C)/2 with the other parameter's.
    """
    covariance = explained.mounts_covariance
    if explained.inputs.mount_turns_rad is None:
        return np.zeros((6, 6))
    products = _find_curvatures(explained, explained.inputs.mount_turns_rad) @ covariance
    means = np.trace(products, axis1=1, axis2=2) / 2
    mean_square: Array = np.einsum("pij,qji->pq", products, products) / 2 + np.outer(means, means)
    return mean_square


def _find_curvatures(explained: VectorFit, turns_rad: Array) -> Array:
    """Return the second derivatives (6, E, E) of scale and bias with respect to E mount errors in prior stds.

    The mount errors change the estimated matrix F to F + D + S, with D of first and S of second order. The second
    derivative of the scale factor 1/‖row of F‖ has a part linear in S and a part quadratic in D.
    """
    inputs, matrix = explained.inputs, explained.solution.matrix
    inverse = _find_regression(explained)  # (3, 4, N)
    first = np.cross(turns_rad, inputs.turns_rad_s)  # (E, N, 3)
    second = np.cross(turns_rad[:, None], first)  # (E, E, N, 3): one rotation after the other
    second = (second + np.swapaxes(second, 0, 1)) / 2
    read_first, read_second = first @ matrix.T, second @ matrix.T
    rows = np.einsum("icn,eni->iec", inverse[:, :3], read_first)  # (3, E, 3) errors of the rows of F
    second_order = np.einsum("icn,efni->iefc", inverse, read_second)  # (3, E, E, 4)
    size = np.linalg.norm(matrix, axis=1)[:, None, None]
    parallel = np.einsum("iec,ic->ie", rows, matrix / size[:, 0])
    squares = 3 * parallel[:, :, None] * parallel[:, None] - np.einsum("iec,ifc->ief", rows, rows)
    of_scale = -np.einsum("iefc,ic->ief", second_order[..., :3], matrix / size[:, 0]) / size**2 + squares / size**3
    return np.concatenate([of_scale, -second_order[..., 3]])


def _find_regression(explained: VectorFit) -> Array:
    """Return the linear map (3, 4, N) from mean readings to each axis' row of matrix and offset if mounts are exact."""
    inputs, solution, bias = explained.inputs, explained.solution, explained.bias
    design = design_matrix(inputs.rates_rad_s, None if solution.g_sensitivity is None else inputs.apparent_gravity_m_s2)
    of_speed = propagate_speed_std(inputs.rates_rad_s, inputs.speed_std_rad_s, solution.matrix)
    shared = None if bias.steady else bias.covariance(inputs.windows_s)
    _, inverse = regress(design, inputs.means_rad_s, inputs.variances_rad2_s2 + of_speed**2, shared)
    map_to_matrix: Array = inverse[:, :4]
    return map_to_matrix

"""What the square of a mount's error does to scale and bias: what a turn loses of its axis is the cosine of the error.

Where sweeps do not tell how an item sits, the directions of its turns are off by angles of which the solution knows the
size alone. Their first order is a pattern of error like any other. Of their second order, 150 ppm for 1°, what is
expected and what scatters about it follow from the covariance of the angles (JCGM 100, 5.1.2, note). Every stage has
angles of its own here, the first too, so that what turns all of them alike, and changes no scale, adds nothing.
"""

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_fit import Explained
from rig.estimation.gyroscope.vector_model import design_matrix, of_the_speed, regress


def of_mount_squares(explained: Explained) -> Array:
    """(6, 6) mean square of what the mounts' errors squared do to kx ky kz bx by bz; zero where they are told exactly.

    For errors ε ~ N(0, C) that are left of the mounts, εᵀHε/2 has the mean tr(HC)/2 and the covariance tr(HCH'C)/2.
    """
    known = explained.mounts_covariance
    if explained.seen.mount_turns_rad is None:
        return np.zeros((6, 6))
    spread = _curvatures(explained, explained.seen.mount_turns_rad) @ known
    means = np.trace(spread, axis1=1, axis2=2) / 2
    found: Array = np.einsum("pij,qji->pq", spread, spread) / 2 + np.outer(means, means)
    return found


def _curvatures(explained: Explained, turns_rad: Array) -> Array:
    """(6, E, E) second derivatives of scale and bias by the mounts' E errors, in standard deviations of before.

    F that is found is F + D + S where the turns are off in first and second order; k is 1 / ‖row of F‖.
    """
    seen, matrix = explained.seen, explained.solution.matrix
    inverse = _regression(explained)  # (3, 4, N)
    first = np.cross(turns_rad, seen.turns_rad_s)  # (E, N, 3)
    second = np.cross(turns_rad[:, None], first)  # (E, E, N, 3): one turn after the other
    second = (second + np.swapaxes(second, 0, 1)) / 2
    read_first, read_second = first @ matrix.T, second @ matrix.T
    rows = np.einsum("icn,eni->iec", inverse[:, :3], read_first)  # (3, E, 3) what a row of F is off by
    bent = np.einsum("icn,efni->iefc", inverse, read_second)  # (3, E, E, 4)
    size = np.linalg.norm(matrix, axis=1)[:, None, None]
    along = np.einsum("iec,ic->ie", rows, matrix / size[:, 0])
    squares = 3 * along[:, :, None] * along[:, None] - np.einsum("iec,ifc->ief", rows, rows)
    of_scale = -np.einsum("iefc,ic->ief", bent[..., :3], matrix / size[:, 0]) / size**2 + squares / size**3
    return np.concatenate([of_scale, -bent[..., 3]])


def _regression(explained: Explained) -> Array:
    """(3, 4, N) what takes mean readings to F, row by row, and the offsets, for what is known of the mounts."""
    seen, solution, bias = explained.seen, explained.solution, explained.bias
    design = design_matrix(seen.rates_rad_s, None if solution.g_sensitivity is None else seen.pull_m_s2)
    of_speed = of_the_speed(seen.rates_rad_s, seen.speed_std_rad_s, solution.matrix)
    shared = None if bias.steady else bias.covariance(seen.windows_s)
    _, inverse = regress(design, seen.means_rad_s, seen.variances_rad2_s2 + of_speed**2, shared)
    found: Array = inverse[:, :4]
    return found

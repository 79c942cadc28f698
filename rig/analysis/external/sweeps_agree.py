"""Whether the sweeps of somebody else's file agree with each other, and what it costs where they do not."""

from dataclasses import replace

import numpy as np

from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import VectorSolution, design_matrix
from rig.observation.external.csv_import import ExternalData

WRONG = 0.1  # of a sweep's rate, by which the others put it elsewhere: no table is that far off, a wrong row is
BEYOND_NOISE = 6.0  # standard deviations of its mean
TOLD = 0.05  # of a row that the others tell at least: else nothing can contradict it
SAME_AXIS = 0.9  # cosine of two rows' axes, either way
CHANCE = 4.5  # standard deviations that one of some dozens of means may be off by chance
BY_CHANCE = 0.01  # of sound files leave as much in all, of all their means


def check_agree(solution: VectorSolution, data: ExternalData) -> None:
    """Every sweep is where all others, solved without it, put it.

    Raises Refused `bad_sweep` for the one that is farthest off: half a turn given as a whole one, a wrong axis. Of two
    about an axis, both: what is between them does not tell which of them is wrong.
    """
    means, variances, design = _equations(data)
    toward = np.linalg.pinv(design)
    told = np.maximum(1 - np.einsum("ij,ji->i", design, toward), TOLD)[:, None]
    apart = (means - design @ (toward @ means)) / told
    off = np.linalg.norm(apart @ np.linalg.inv(solution.matrix).T, axis=1)
    noise = np.linalg.norm(np.sqrt(variances) / told, axis=1)
    sweeps = slice(len(data.sweeps))
    share = np.where(off > BEYOND_NOISE * noise, off, 0.0)[sweeps] / np.linalg.norm(design[sweeps, :3], axis=1)
    worst = int(np.argmax(share))
    if share[worst] > WRONG:
        raise Refused(
            "bad_sweep",
            f"{_named(worst, data)} by {100 * share[worst]:.0f} % of its rate",
            "Look at its row and those of other sweeps about its axis: angle or speed, start and end, direction of the "
            "axis; correct the wrong one, or leave it out",
        )


def _named(worst: int, data: ExternalData) -> str:
    """Which sweep contradicts which, by their rows."""
    axis = data.sweeps[worst].axis_flange
    about = [each.sweep for each in data.sweeps if abs(each.axis_flange @ axis) > SAME_AXIS]
    if len(about) == 2:
        return f"of sweeps {about[0]} and {about[1]}, alone about their axis, one contradicts the other"
    return f"sweep {data.sweeps[worst].sweep} contradicts the others"


def contradiction(solution: VectorSolution, data: ExternalData) -> float:
    """How many times its noise the worst of the means contradicts the others by; 1 where chance may explain it.

    Not their mean square, which only tells whether it is chance: one wrong row among twelve is hidden in that, and is
    all that two sweeps of an axis tell.
    """
    if data.at_reference:
        return 1.0
    from scipy.special import chdtri

    _, variances, design = _equations(data)
    worst, chi_square, freedom = 1.0, 0.0, 3 * rows_left(data)
    for left, variance in zip(solution.residuals_rad_s.T, variances.T, strict=True):
        weighted = design / np.sqrt(variance)[:, None]
        told = 1 - np.einsum("ij,ji->i", weighted, np.linalg.pinv(weighted))
        worst = max(worst, float((np.abs(left) / np.sqrt(variance * np.maximum(told, TOLD))).max()))
        chi_square += float(np.sum(left**2 / variance))
    chance = freedom <= 0 or chi_square <= float(chdtri(freedom, BY_CHANCE))
    return 1.0 if chance and worst <= CHANCE else worst


def rows_left(data: ExternalData) -> int:
    """How many rows are more than the solution takes: the degrees of freedom of what they contradict each other by.

    A row whose rate, or end, is wrong is wrong once, though it tells three equations.
    """
    return len(data.sweeps) + len(data.rests) - 4


def counted(solution: VectorSolution, data: ExternalData) -> VectorSolution:
    """The solution with what the sweeps contradict each other by in its covariances."""
    more = contradiction(solution, data) ** 2
    return replace(
        solution,
        covariance=more * solution.covariance,
        matrix_covariance=more * solution.matrix_covariance,
        angles_covariance_rad2=more * solution.angles_covariance_rad2,
    )


def _equations(data: ExternalData) -> tuple[Array, Array, Array]:
    """Mean readings (N, 3) of sweeps, then of rests, their variances (N, 3), and the design (N, 4), [ω 1]."""
    averages = [*(sweep.average for sweep in data.sweeps), *data.rests]
    rates = [sweep.speed_rad_s * sweep.axis_flange for sweep in data.sweeps]
    return (
        np.array([each.mean_rad_s for each in averages]),
        np.array([each.variance_rad2_s2 for each in averages]),
        design_matrix(np.array([*rates, *np.zeros((len(data.rests), 3))]), None),
    )

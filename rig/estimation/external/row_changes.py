"""An abrupt change of a sensor between two of the rows that state its motion.

    m_j = F ω_j + c + (h  or  diag(h) F ω_j,  from one row on) + errors of the stated motion + noise

m_j is the mean reading at the stated rate ω_j of a sensor with the matrix F and the offset c; h (3,) is the change of
the bias, or the relative change of each axis' scale factor. The rows themselves determine how large the errors of the
stated rates and axes are.
"""

from collections.abc import Sequence

import numpy as np

from rig.estimation.arrays import Array, perpendicular_unit_vectors
from rig.estimation.external.abrupt_change import SCALE_STD, AbruptChange, PossibleChanges, find_change
from rig.estimation.external.attitude_drift import correlate_effects
from rig.estimation.statistics.variance_components import Mixed, MixedModel

ERROR_MEDIAN = 1e-4  # of the prior of the rates' relative errors, and of the axes' inclinations in rad
MIN_LARGE_EVIDENCE, MIN_EVIDENCE = -2.0, 2.0  # ln of the Bayes factor; the second is for a change that U is to contain
MIN_ROWS, MAX_ROWS = 6, 600  # fewer show no change; more would take too long
MIN_EITHER_SIDE = 2  # rows: a single row that differs is a wrong row
MIN_ROWS_FOR_ONE = 8  # rows that decide between a wrong first or last row and a bias that changes there
SMALL_ERROR_RATIO = 0.01  # scale of the errors tried in addition to the estimate, which the change may have inflated
MIN_LARGE_RATIO = 0.5  # least fraction of an axis' largest reading at which a row determines its scale factor


def find_row_change(
    means: Array, variances: Array, rates_rad_s: Array, starts_s: Array, bias_sizes: Sequence[float]
) -> AbruptChange | None:
    """Return the abrupt change that rows in the order of time show, None if they show none.

    The rows have mean readings `means` (N, 3) with `variances` (N, 3), stated rates (N, 3), zero at rest, and begin at
    `starts_s` (N,). `bias_sizes` are prior standard deviations of a change of the bias.

    At least two rows precede and follow a change of the bias, because a single wrong row at either end looks the same.
    A single row is enough if no row is a rest and there are `MIN_ROWS_FOR_ONE` rows.
    """
    count = len(means)
    design = np.column_stack([rates_rad_s, np.ones(count)])
    if not MIN_ROWS <= count <= MAX_ROWS or np.linalg.matrix_rank(design) < 4:
        return None
    speeds = np.linalg.norm(rates_rad_s, axis=1)
    usual = np.sqrt(variances.mean(axis=1) + (ERROR_MEDIAN * speeds) ** 2)[:, None]  # std of each row
    fitted = np.linalg.lstsq(design / usual, means / usual, rcond=None)[0]
    read = rates_rad_s @ fitted[:3]  # readings without bias, which change in proportion to a rate or scale error
    across, alone = np.zeros((2, count, 3)), np.eye(count)
    for row in np.flatnonzero(speeds):
        across[:, row] = speeds[row] * perpendicular_unit_vectors(rates_rad_s[row] / speeds[row])
    across = across @ fitted[:3]  # changes of the readings by an axis tilted by 1 rad in two directions
    mixed = Mixed(
        observed=(means - design @ fitted).ravel(),
        design=np.asarray(np.kron(design, np.eye(3)), dtype=np.float64),
        fixed=np.diag(variances.ravel()),
        components=np.array(
            [correlate_effects(read[..., None], alone), correlate_effects(np.moveaxis(across, 0, -1), alone)]
        ),
        precision=np.zeros(12),
        scales=np.array([ERROR_MEDIAN, ERROR_MEDIAN]),
        alone=np.zeros((2, 2)),
    )
    model = MixedModel(mixed)
    axes = np.tile(np.eye(3), (count, 1, 1))
    either_side = MIN_EITHER_SIDE if (speeds == 0).any() or count < MIN_ROWS_FOR_ONE else 1
    rows_before = np.arange(count)
    inner = np.minimum(rows_before, count - rows_before) >= either_side
    large = np.abs(read) > MIN_LARGE_RATIO * np.abs(read).max(axis=0)  # rows that show an axis's scale factor
    before = np.cumsum(large, axis=0) - large
    both_sides = np.minimum(before, large.sum(axis=0) - before) >= MIN_EITHER_SIDE
    std = model.find_maxima()[0]
    return find_change(
        model,
        np.array([std, SMALL_ERROR_RATIO * std]),
        (
            *(PossibleChanges("bias", size * axes, np.repeat(inner[:, None], 3, axis=1), size) for size in bias_sizes),
            PossibleChanges("scale", SCALE_STD * axes * read[:, None, :], both_sides, SCALE_STD),
        ),
        starts_s,
        MIN_LARGE_EVIDENCE,
    )

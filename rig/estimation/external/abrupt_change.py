"""An abrupt change of a sensor within a recording, by the ratio of marginal likelihoods.

A change happens before one of the rows, or increments, of a mixed model: the sensor's bias or the scale factors of its
axes change by δ ~ N(0, size² I), or the coordinates of a reference's attitudes turn by δ. The ratio of the likelihoods
with and without such a term is the Bayes factor (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773). The factor is
first computed for every row, with the other errors' standard deviations fixed. For the most probable row these standard
deviations are then estimated again, together with the change; otherwise they would include the change.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.estimation.statistics.variance_components import Mixed, MixedModel

Changing = Literal["bias", "scale", "attitude"]
SCALE_STD = 0.02  # prior of a change of the scale factors
LIKELY_EVIDENCE, CERTAIN_EVIDENCE = 5.0, 10.0  # of a change that U must contain; of one that nothing else explains
MIN_FITTED_EVIDENCE = 1.0  # ln of the Bayes factor with the sizes of the model without a change


@dataclass(frozen=True, slots=True)
class AbruptChange:
    """A change of `what` at the time `from_s`; "attitude" is a rotation of the reference's own coordinates.

    - `sizes` (3,): the change on each axis; of a bias in the readings' unit, of a scale factor as a fraction, of the
      attitude in rad; zero if unknown.
    - `evidence`: ln of the Bayes factor minus ln of the number of possible changes (Bonferroni's correction).
    """

    what: Changing
    from_s: float
    sizes: Array
    evidence: float

    def find_covariance(self, matrix: Array) -> Array:
        """Return the covariance (12, 12) that the change adds to the sensor's `matrix`, row by row, and to its bias.

        A solution lies between the sensor's states before and after. Half of the change is the standard uncertainty, so
        that U, the whole change, covers both states.
        """
        half = np.zeros((12, 3))
        if self.what == "bias":
            half[9:] = np.diag(self.sizes / 2)
        elif self.what == "scale":
            half[:9] = (np.eye(3)[:, None, :] * (matrix * self.sizes[:, None] / 2)[:, :, None]).reshape(9, 3)
        return half @ half.T


@dataclass(frozen=True, slots=True)
class PossibleChanges:
    """Possible changes of `what` ("bias", "scale") of each axis, with the prior standard deviation `size`.

    `of_axes` (n, 3, 3): the effect of a change of each axis (second index) by `size` on the three readings of n rows.
    `possible` (n, 3): whether an axis may have changed just before a row. `lasts`: whether the change affects all later
    rows too.
    """

    what: Changing
    of_axes: Array
    possible: NDArray[np.bool_]
    size: float
    lasts: bool = True


def find_change(
    model: MixedModel, starts: Array, effects: Sequence[PossibleChanges], begins_s: Array, least_evidence: float
) -> AbruptChange | None:
    """Return the most probable change just before one of n readings, None if its evidence is at most `least_evidence`.

    The readings are in the order of time and begin at `begins_s` (n,). A change inflates the estimated errors, so the
    search is repeated from each of `starts` (s, k), standard deviations of the model's k errors; the first ones are the
    most probable if nothing changed.
    """
    count = sum(int(effect.possible.any(axis=1).sum()) for effect in effects)
    log_without, change = model.evaluate_posterior(starts[0]) + float(np.log(max(count, 1))), None
    for std in starts:
        # For fixed errors all times are quickly compared; only the best of them is fitted anew, errors included.
        inverse, innovation = model.restrict(std)
        evidence = [_weigh_rows(effect, inverse, innovation) for effect in effects]
        best = max(range(len(effects)), key=lambda index: float(evidence[index].max()))
        first, effect = int(np.argmax(evidence[best])), effects[best]
        if evidence[best][first] < MIN_FITTED_EVIDENCE:
            continue
        row = np.arange(len(begins_s))
        is_affected = (row >= first if effect.lasts else row == first)[:, None, None]
        columns = effect.of_axes * effect.possible[first] * is_affected
        with_change = MixedModel(_add_columns(model.mixed, columns.reshape(-1, 3)))
        std_with_change = with_change.find_maxima(std)[0]
        log_odds = with_change.evaluate_posterior(std_with_change) - log_without
        if log_odds > (least_evidence if change is None else change.evidence):
            sizes = effect.size * with_change.solve(std_with_change).theta[-3:]
            change = AbruptChange(effect.what, float(begins_s[first]), sizes, log_odds)
    return change


def _weigh_rows(effects: PossibleChanges, inverse: Array, innovation: Array) -> Array:
    """Return ln of the Bayes factor (n,) of a change before each row: (sᵀ (I + H)⁻¹ s − ln det(I + H))/2.

    s = Aᵀ P y and H = Aᵀ P A, where A (3n, 3) contains the effects of the change. `inverse` P (3n, 3n) and `innovation`
    P y (3n,) are those of the restricted likelihood of the readings y. For a change that lasts, s and H are sums over
    the row and all later rows.
    """
    of_axes, possible = effects.of_axes, effects.possible
    count = len(of_axes)
    scores = np.einsum("nij,ni->nj", of_axes, innovation.reshape(count, 3))
    blocks = np.einsum("nij,nimk,mkl->nmjl", of_axes, inverse.reshape(count, 3, count, 3), of_axes, optimize=True)
    if effects.lasts:
        scores = np.cumsum(scores[::-1], axis=0)[::-1]
        blocks = np.cumsum(np.cumsum(blocks[::-1, ::-1], axis=0), axis=1)[::-1, ::-1]
    scores = possible * scores
    pairs = possible[:, :, None] * possible[:, None, :]
    information = np.eye(3) + pairs * blocks[np.arange(count), np.arange(count)]
    explained = np.sum(scores * np.linalg.solve(information, scores[..., None])[..., 0], axis=1)
    return np.asarray(0.5 * (explained - np.linalg.slogdet(information)[1]), dtype=np.float64)


def _add_columns(mixed: Mixed, columns: Array) -> Mixed:
    """Return the model with `columns` (m, 3), whose coefficients have a prior standard deviation of 1."""
    return replace(
        mixed,
        design=np.column_stack([mixed.design, columns]),
        precision=np.concatenate([mixed.precision, np.ones(columns.shape[1])]),
    )

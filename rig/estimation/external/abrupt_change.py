"""An abrupt change of a sensor within a recording, by the ratio of marginal likelihoods.

Before one of the rows, or increments, of a mixed model the sensor's bias or the scale factors of its axes change by
δ ~ N(0, size² 1), or the coordinates of a reference's attitudes turn by δ. The ratio of the likelihoods with and
without such a term (Bayes factor; Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773) is computed for every place with
given sizes of the errors, as those of the model without a change, in which a change is a part of these errors. The most
probable place is then fitted with sizes of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.estimation.statistics.variance_components import Mixed, MixedModel

Changing = Literal["bias", "scale", "attitude"]
OF_SCALE = 0.02  # prior standard deviation of a change of the scale factors
LIKELY, CERTAIN = 5.0, 10.0  # evidence of a change that U is to contain, and of one that nothing else explains
WORTH_FITTING = 1.0  # least ln of the Bayes factor with the sizes of the model without a change


@dataclass(frozen=True, slots=True)
class AbruptChange:
    """A change of `what` at the time `from_s`; of attitudes, that of their own coordinates.

    - `sizes` (3,): of each axis, in the unit of the readings, relative to the scale factor, or rad; zero if unknown.
    - `evidence`: ln of the Bayes factor, beyond that of the number of places where the change might have been.
    """

    what: Changing
    from_s: float
    sizes: Array
    evidence: float

    def find_covariance(self, matrix: Array) -> Array:
        """Return the covariance (12, 12) of F (3, 3), row by row, and the bias that contains both states of the sensor.

        A solution is between both states. Half of the change is the standard uncertainty, so U is the whole.
        """
        half = np.zeros((12, 3))
        if self.what == "bias":
            half[9:] = np.diag(self.sizes / 2)
        elif self.what == "scale":
            half[:9] = (np.eye(3)[:, None, :] * (matrix * self.sizes[:, None] / 2)[:, :, None]).reshape(9, 3)
        return half @ half.T


@dataclass(frozen=True, slots=True)
class PossibleChanges:
    """The effects `of_axes` (n, 3, 3) on the equations of n rows of a change of `what` of each axis by one `size`.

    `possible` (n, 3): whether the axis may have changed just before the row. `lasts`: whether later rows show it too.
    """

    what: Changing
    of_axes: Array
    possible: NDArray[np.bool_]
    size: float
    lasts: bool = True


def find_change(
    model: MixedModel, starts: Array, effects: Sequence[PossibleChanges], begins_s: Array, least_evidence: float
) -> AbruptChange | None:
    """Return the change that rows in the order of time, which begin at `begins_s` (n,), show, None if they show none.

    `starts` (s, k) are standard deviations of the model's errors: first the most probable ones without a change, then
    others with which to look for a place. A change is found from `least_evidence` on.
    """
    places = sum(int(effect.possible.any(axis=1).sum()) for effect in effects)
    without, change = model.evaluate_posterior(starts[0]) + float(np.log(max(places, 1))), None
    for std in starts:
        inverse, innovation = model.restrict(std)
        evidence = [_weigh_places(effect, inverse, innovation) for effect in effects]
        most = max(range(len(effects)), key=lambda index: float(evidence[index].max()))
        first, changed = int(np.argmax(evidence[most])), effects[most]
        if evidence[most][first] < WORTH_FITTING:
            continue
        row = np.arange(len(begins_s))
        shows = (row >= first if changed.lasts else row == first)[:, None, None]
        columns = changed.of_axes * changed.possible[first] * shows
        widened = MixedModel(_add_columns(model.mixed, columns.reshape(-1, 3)))
        own_std = widened.find_maxima(std)[0]
        odds = widened.evaluate_posterior(own_std) - without
        if odds > (least_evidence if change is None else change.evidence):
            sizes = changed.size * widened.solve(own_std).theta[-3:]
            change = AbruptChange(changed.what, float(begins_s[first]), sizes, odds)
    return change


def _weigh_places(effects: PossibleChanges, inverse: Array, innovation: Array) -> Array:
    """Return ln of the Bayes factor (n,) of a change before each row.

    `inverse` (3n, 3n) and `innovation` (3n,) are P and P y of the restricted likelihood.
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

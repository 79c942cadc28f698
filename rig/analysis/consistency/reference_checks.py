"""Whether what a recording tells of a sensor in a constant reference agrees with itself: dwells and sweeps, one model.

An accelerometer's readings, or a magnetometer's, which are dwells alone, must be explained by the calibration that was
found from them (`rig.estimation.reference.accelerometer_model`), to within their noise, an arm that is not quite where
it says, and what is stated of the rest. How far the arm is off is found anew beside every suspicion, so that what is
wrong does not excuse itself: a suspicion is told by how much likelier it makes the readings.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.analysis.consistency.reference_alternatives import DAMAGES, Read, bias_over_time, of_piece, suspicions
from rig.analysis.consistency.residual_tests import (
    Consistency,
    Statistic,
    basis,
    told_beside,
    told_by,
    told_from,
    unlike_the_others,
)
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import effects, predicted
from rig.estimation.reference.attitude_error import likeliest
from rig.estimation.reference.imu_fit import slopes
from rig.estimation.reference.reading_errors import noise
from rig.estimation.reference.shared_errors import apart, information


@dataclass(frozen=True, slots=True)
class HeldReadings:
    """What the model leaves of the readings (n,), and its columns (n, q), where noise is one and errors are apart.

    `growth` (n,) of their variance with the square of the arm's error δ: see `rig.estimation.reference.shared_errors`.
    """

    left: Array
    base: Array
    turn: Array
    growth: Array

    def explained(self, suspicions: Sequence[Array], beside: Sequence[Array]) -> list[float]:
        """What suspicions explain with the arm as far off as it is beside the worst of them: see `Held`."""
        base = self._beside(beside)
        turned = [self.turn @ columns for columns in suspicions]
        std_rad = self._off(base)
        worst = turned[int(np.argmax([self._explained(base, each, std_rad) for each in turned]))]
        std_rad = self._off(np.column_stack([base, told_beside(basis(base), worst)]))
        return [self._explained(base, each, std_rad) for each in turned]

    def judged(self, columns: Array | None, beside: Sequence[Array], rate: float) -> Statistic | None:
        """Twice the logarithm of how much likelier the readings are with the columns, which is χ² where δ is known.

        Each with the δ that makes them likeliest, of what the model leaves (Welham and Thompson, J. R. Stat. Soc. B 59
        (1997) 701). Where δ is not known, the limit is that of F, as far as δ is what the columns stand out against. Of
        anything at all it is χ² of what the model leaves.
        """
        from scipy.special import chdtri

        base = self._beside(beside)
        std_rad, without = likeliest(self.growth, self.left, base)
        if columns is None:
            freedom = len(self.left) - base.shape[1]
            left = self._unexplained(base, std_rad)[1]
            return (float(left @ left), float(chdtri(freedom, rate))) if freedom else None
        new = told_beside(basis(base), self.turn @ columns)
        if not new.shape[1]:
            return None
        _, beside_new = likeliest(self.growth, self.left, base, new)
        return 2 * (without - beside_new), self._limit(base, new, std_rad, rate)

    def told_from(self, damages: Array, suspected: Sequence[Array], rate: float) -> float:
        """The size from which on damages (n, k) are told by what is suspected: as `suspicion` has it."""
        base = self._beside(())
        std_rad = self._off(base)
        size = np.sqrt(1 + std_rad**2 * self.growth)[:, None]
        turned = [self.turn @ columns for columns in suspected]
        beside = [(columns, told_beside(basis(base), columns)) for columns in turned]
        limits = [(columns, self._limit(base, new, std_rad, rate)) for columns, new in beside if new.shape[1]]
        found = [(columns / size, lambda _, limit=limit: limit) for columns, limit in limits]
        return told_from(basis(base / size), self.turn @ damages / size, found)

    def _limit(self, base: Array, new: Array, std_rad: float, rate: float) -> float:
        """The limit of what orthonormal columns explain beside `base`, in a share `rate` of recordings."""
        from scipy.special import chdtri, fdtri

        count = new.shape[1]
        of_known, freedom = float(chdtri(count, rate)), max(self._freedom(base, std_rad), count + 1.0)
        told = count / (freedom - count) * fdtri(count, freedom - count, 1 - rate)
        of_unknown, share = freedom * float(np.log1p(told)), self._share(base, new, std_rad)
        return float(of_known + share * max(of_unknown - of_known, 0.0))

    def _beside(self, beside: Sequence[Array]) -> Array:
        return basis(np.column_stack([self.base, *(self.turn @ each for each in beside)]))

    def _off(self, base: Array) -> float:
        """δ, by what `base` leaves."""
        return likeliest(self.growth, self.left, base)[0]

    def _unexplained(self, base: Array, std_rad: float) -> tuple[Array, Array]:
        """`base` and what it leaves, white."""
        size = np.sqrt(1 + std_rad**2 * self.growth)
        known, left = basis(base / size[:, None]), self.left / size
        return known, left - known @ (known.T @ left)

    def _explained(self, base: Array, columns: Array, std_rad: float) -> float:
        known, left = self._unexplained(base, std_rad)
        told = told_beside(known, columns / np.sqrt(1 + std_rad**2 * self.growth)[:, None]).T @ left
        return float(told @ told)

    def _freedom(self, base: Array, std_rad: float) -> float:
        """Degrees of freedom of δ²: how many readings tell it."""
        return 2 * information(self.growth, std_rad, base) * std_rad**4

    def _share(self, base: Array, columns: Array, std_rad: float) -> float:
        """Share of δ in the variance along columns, from 0 to 1."""
        variance = 1 + std_rad**2 * self.growth
        known, _ = self._unexplained(base, std_rad)
        told = told_beside(known, columns / np.sqrt(variance)[:, None])
        return float(np.mean(np.sum((1 - 1 / variance)[:, None] * told**2, axis=0)))


def reference_consistency(read: Read, rate: float, *, drifting: bool = False) -> Consistency:
    """Every statistic with its critical value; `rate` is that of false alarms for each.

    The bias may change steadily where it is `drifting`.
    """
    held, suspected = _held(read, drifting=drifting), suspicions(read)
    pieces = range(read.dwells + read.sweeps)
    ranked = unlike_the_others(held, pieces, lambda piece: of_piece(read, piece), rate)
    return Consistency(
        told_by(held, suspected, rate),
        ranked[0][1],
        {piece: statistic for piece, statistic in ranked if statistic[0] > statistic[1]},
        _told_from(held, read, rate),
    )


def would_tell(read: Read, rate: float) -> dict[str, float]:
    """`told_from` alone."""
    return _told_from(_held(read, drifting=False), read, rate)


def _told_from(held: HeldReadings, read: Read, rate: float) -> dict[str, float]:
    """The size from which each damage is told, by what happens; nothing of what the model takes up."""
    pieces = read.dwells + read.sweeps
    asked = {name: ([columns], rate) for name, columns in suspicions(read).items() if columns is not None}
    asked["disturbed_dwell"] = [of_piece(read, dwell) for dwell in range(read.dwells)], rate / pieces
    found = {
        damage.what: held.told_from(damage.patterns(read), *asked[damage.check])
        for damage in DAMAGES
        if damage.check in asked
    }
    return {what: size for what, size in found.items() if np.isfinite(size)}


def _held(read: Read, *, drifting: bool) -> HeldReadings:
    theta, movement = read.theta, read.movement
    found = apart(noise(theta, movement) + read.known.T @ read.known, effects(theta, movement))
    base = slopes(theta, movement, second_order=read.second_order)
    if drifting:
        base = np.column_stack([base, bias_over_time(read)])
    left = (movement.readings() - predicted(theta, movement)).ravel()
    return HeldReadings(found.turn @ left, found.turn @ base, found.turn, found.growth)

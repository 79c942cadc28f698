"""Whether what a recording tells of a sensor in a constant reference agrees with itself: dwells and sweeps, one model.

An accelerometer's readings, or a magnetometer's, which are dwells alone, must be explained by the calibration that was
found from them (`rig.estimation.felt`), to within their noise, an arm that is not quite where it says, and what is
stated of the rest. How far the arm is off is found anew beside every suspicion, so that what is wrong does not excuse
itself: a suspicion is told by how much likelier it makes the readings.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.analysis.suspicion import Statistic, Suspicions, basis, told_beside, told_by, unlike_the_others
from rig.estimation.arrays import Array
from rig.estimation.felt import SECOND, Movement, cross, effects, felt, jacobian, predicted
from rig.estimation.imu_fit import slopes
from rig.estimation.reading_errors import in_sweeps, noise, of_pieces, of_sensor, per_axis
from rig.estimation.reference_model import matrix
from rig.estimation.shared_errors import Apart, apart, information, likeliest_error, more_likely


@dataclass(frozen=True, slots=True)
class Read:
    """What is held against its model: θ (22,) found from the `movement`, and what else is known of both.

    `known` (P, 3 K) are independent patterns of errors in the readings, each of one standard uncertainty; `times_s`
    (N + M,) the middles of dwells and sweeps.
    """

    theta: Array
    movement: Movement
    known: Array
    times_s: Array
    second_order: bool

    @property
    def dwells(self) -> int:
        """N."""
        return len(self.movement.dwells.readings_m_s2)

    @property
    def sweeps(self) -> int:
        """M."""
        return len(self.movement.sweeps.speeds_rad_s)


@dataclass(frozen=True, slots=True)
class ReferenceConsistency:
    """The statistics by the name of their check; `piece` is that of the dwell or sweep least like the others.

    `disturbed` are those beyond the limit, by place: the dwells, then the sweeps.
    """

    statistics: dict[str, Statistic]
    piece: Statistic
    disturbed: dict[int, Statistic]


@dataclass(frozen=True, slots=True)
class HeldReadings:
    """What the model leaves of the readings (n,), and its columns (n, q), where noise is one and errors are apart.

    `growth` (n,) of their variance with the square of the arm's error δ: see `rig.estimation.shared_errors`.
    """

    left: Array
    base: Array
    turn: Array
    growth: Array

    def explained(self, suspicions: Sequence[Array], beside: Sequence[Array]) -> list[float]:
        """With the arm as far off as it is beside the worst of them: see `Held`."""
        base = self._beside(beside)
        turned = [self.turn @ columns for columns in suspicions]
        std_rad = self._off(base)
        worst = turned[int(np.argmax([self._explained(base, each, std_rad) for each in turned]))]
        std_rad = self._off(np.column_stack([base, told_beside(basis(base), worst)]))
        return [self._explained(base, each, std_rad) for each in turned]

    def judged(self, columns: Array | None, beside: Sequence[Array], rate: float) -> Statistic | None:
        """Twice the logarithm of how much likelier the readings are with the columns, which is χ² where δ is known.

        Where it is not, the limit is that of F, as far as δ is what the columns stand out against. Of anything at all
        it is χ² of what the model leaves.
        """
        from scipy.special import chdtri, fdtri

        base = self._beside(beside)
        std_rad = self._off(base)
        if columns is None:
            freedom = len(self.left) - base.shape[1]
            left = self._unexplained(base, std_rad)[1]
            return (float(left @ left), float(chdtri(freedom, rate))) if freedom else None
        new = told_beside(basis(base), self.turn @ columns)
        if not (count := new.shape[1]):
            return None
        of_known, freedom = float(chdtri(count, rate)), max(self._freedom(base, std_rad), count + 1.0)
        told = count / (freedom - count) * float(fdtri(count, freedom - count, 1 - rate))
        of_unknown, share = freedom * float(np.log1p(told)), self._share(base, new, std_rad)
        limit = of_known + share * max(of_unknown - of_known, 0.0)
        return more_likely(self._apart(), self.left, base, new), limit

    def _beside(self, beside: Sequence[Array]) -> Array:
        return basis(np.column_stack([self.base, *(self.turn @ each for each in beside)]))

    def _off(self, base: Array) -> float:
        """δ, by what `base` leaves."""
        return likeliest_error(self._apart(), self.left, base)

    def _apart(self) -> Apart:
        return Apart(np.eye(len(self.left)), self.growth)

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
        """Of δ²: how many readings tell it."""
        return 2 * information(self._apart(), std_rad, base) * std_rad**4

    def _share(self, base: Array, columns: Array, std_rad: float) -> float:
        """Of δ in the variance along columns, from 0 to 1."""
        variance = 1 + std_rad**2 * self.growth
        known, _ = self._unexplained(base, std_rad)
        told = told_beside(known, columns / np.sqrt(variance)[:, None])
        return float(np.mean(np.sum((1 - 1 / variance)[:, None] * told**2, axis=0)))


def reference_consistency(read: Read, rate: float, *, drifting: bool = False) -> ReferenceConsistency:
    """Every statistic with its critical value; `rate` is that of false alarms for each.

    The bias may change steadily where it is `drifting`.
    """
    held = _held(read, drifting=drifting)
    ranked = unlike_the_others(held, range(read.dwells + read.sweeps), lambda piece: _of_piece(read, piece), rate)
    return ReferenceConsistency(
        told_by(held, _suspicions(read), rate),
        ranked[0][1],
        {piece: statistic for piece, statistic in ranked if statistic[0] > statistic[1]},
    )


def _held(read: Read, *, drifting: bool) -> HeldReadings:
    theta, movement = read.theta, read.movement
    found = apart(noise(theta, movement) + read.known.T @ read.known, effects(theta, movement))
    base = slopes(theta, movement, second_order=read.second_order)
    if drifting:
        base = np.column_stack([base, _bias_over_time(read)])
    left = (movement.readings() - predicted(theta, movement)).ravel()
    return HeldReadings(found.turn @ left, found.turn @ base, found.turn, found.growth)


def _suspicions(read: Read) -> Suspicions:
    """By name of the check (3 K, k): what each would add to the readings; None is anything at all."""
    s, f, time = felt(read.theta, read.movement), matrix(read.theta), _time(read)
    found: dict[str, Array | None] = {
        "bias_changed": _bias_over_time(read),
        "scale_changed": per_axis((s @ f.T) * time[:, None]),
        "loose_mounting": ((f @ -cross(s)) * time[:, None, None]).reshape(-1, 3),
        "even_term": jacobian(read.theta, read.movement)[:, SECOND],
        "odd_term": of_sensor(read.theta, read.movement, lambda along: along**3),
        "asymmetry": of_sensor(read.theta, read.movement, np.abs),
        "residuals": None,
    }
    if read.dwells and read.sweeps:
        found["sweeps_against_dwells"] = in_sweeps(read.movement)
    return found


def _of_piece(read: Read, piece: int) -> Array:
    """(3 K, 3 or 9): other readings in this dwell, or sweep."""
    first, wide = (3 * piece, 3) if piece < read.dwells else (3 * read.dwells + 9 * (piece - read.dwells), 9)
    columns = np.zeros((read.movement.readings().size, wide))
    columns[first : first + wide] = np.eye(wide)
    return columns


def _bias_over_time(read: Read) -> Array:
    return per_axis((_time(read) * read.movement.constant())[:, None] * np.ones(3))


def _time(read: Read) -> Array:
    """(K,) of the middles, from −1 to 1."""
    middle = of_pieces(read.times_s, read.movement)
    time: Array = (2 * middle - middle.max() - middle.min()) / np.ptp(middle)
    return time

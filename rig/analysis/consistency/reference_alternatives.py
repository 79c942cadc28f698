"""What might be wrong with readings of a constant reference: as columns of a suspicion, as damages of some size.

As `rig.analysis.consistency.alternatives`, of accelerometers and magnetometers.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rig.analysis.consistency.residual_tests import Damage, Suspicions
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import SECOND, Movement, cross, felt, jacobian
from rig.estimation.reference.reading_errors import in_sweeps, of_pieces, of_sensor, per_axis
from rig.estimation.reference.reference_model import REFERENCE, matrix


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
        """Number N of dwells."""
        return len(self.movement.dwells.readings_m_s2)

    @property
    def sweeps(self) -> int:
        """Number M of sweeps."""
        return len(self.movement.sweeps.speeds_rad_s)


def suspicions(read: Read) -> Suspicions:
    """What each suspicion would add, by name of the check (3 K, k), to the readings; None is anything at all."""
    s, f, time = felt(read.theta, read.movement), matrix(read.theta), _time(read)
    found: dict[str, Array | None] = {
        "bias_changed": bias_over_time(read),
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


def of_piece(read: Read, piece: int) -> Array:
    """(3 K, 3 or 9): other readings in this dwell, or sweep."""
    first, wide = (3 * piece, 3) if piece < read.dwells else (3 * read.dwells + 9 * (piece - read.dwells), 9)
    columns = np.zeros((read.movement.readings().size, wide))
    columns[first : first + wide] = np.eye(wide)
    return columns


def bias_over_time(read: Read) -> Array:
    return per_axis((_time(read) * read.movement.constant())[:, None] * np.ones(3))


def _time(read: Read) -> Array:
    """(K,) times of the middles, from −1 to 1."""
    middle = of_pieces(read.times_s, read.movement)
    time: Array = (2 * middle - middle.max() - middle.min()) / np.ptp(middle)
    return time


def _later(read: Read) -> Array:
    """(K, 1) ½ in the second half of the time, −½ in the first: of what changes half-way the mean is meant."""
    middle = (read.times_s.min() + read.times_s.max()) / 2
    return of_pieces(np.where(read.times_s > middle, 0.5, -0.5), read.movement)[:, None]


def _in_dwells(read: Read) -> Array:
    """(3 K, 3 N) another reading of each axis in each dwell."""
    count = 3 * read.dwells
    return np.eye(read.movement.readings().size)[:, :count]


def _along(read: Read) -> Array:
    """(K, 3) what each axis reads of the reference."""
    along: Array = felt(read.theta, read.movement) @ matrix(read.theta).T
    return along


def _bent(change: Callable[[Array], Array]) -> Callable[[Read], Array]:
    """What is added to the readings by a `change` of the force, both in terms of the reference."""

    def patterns(read: Read) -> Array:
        size = float(np.linalg.norm(read.theta[REFERENCE]))
        return of_sensor(read.theta, read.movement, lambda along: size * change(along / size))

    return patterns


DAMAGES: tuple[Damage[Read], ...] = (  # (3 K, k) each
    Damage(
        "the bias changes half-way", "bias_changed", None,
        lambda read: per_axis(_later(read) * read.movement.constant()[:, None] * np.ones(3)),
    ),
    Damage(
        "all scale factors change half-way", "scale_changed", "1",
        lambda read: (_along(read) * _later(read)).reshape(-1, 1),
    ),
    Damage(
        "one scale factor changes half-way", "scale_changed", "1", lambda read: per_axis(_along(read) * _later(read))
    ),
    Damage(
        "the sensor turns on the flange half-way", "loose_mounting", "rad",
        lambda read: (
            (matrix(read.theta) @ -cross(felt(read.theta, read.movement))) * _later(read)[:, :, None]
        ).reshape(-1, 3),
    ),
    Damage("an even part, of v²/g", "even_term", "1", _bent(np.square)),
    Damage("an odd part, of v³/g²", "odd_term", "1", _bent(lambda along: along**3)),
    Damage("another scale upwards than downwards", "asymmetry", "1", _bent(lambda along: np.abs(along) / 2)),
    Damage(
        "another bias in sweeps than in dwells", "sweeps_against_dwells", None, lambda read: in_sweeps(read.movement)
    ),
    Damage("another reading in one dwell", "disturbed_dwell", None, _in_dwells),
)  # fmt: skip

"""The graph solved: Gauss's and Newton's steps, and with them the sizes of what a hand does, found from what is left.

A size is found by the factors that it makes, each counted with its share of degrees of freedom, and beside what is
stated of hands as if that had been seen in a few more (`SEEN`): a short session cannot talk itself out of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.by_hand.faces import faced
from rig.estimation.by_hand.graph import ACCELERATION, CLOSURE, FLAT, MOVE, PRIOR, WALK, Factor, Graph, State, factors
from rig.estimation.by_hand.moves import Moved, Taken, moved
from rig.estimation.by_hand.session import LARGEST, STATED, Faced, Handled, Sizes, Told

PASSES, SIZED = 30, 4  # of the fit, slow by few moves; in each but the first, how often the sizes are found anew
SETTLED = 1e-2  # of the standard uncertainty
SEEN = 5.0  # degrees of freedom that what is stated of hands counts
LEAST = 0.4  # of what is stated: so good is no hand
OF_KIND = {
    "repeat_rad": (FLAT, "repeat"),
    "closure_rad": (CLOSURE, "closure"),
    "of_angle": (MOVE, "of_angle"),
    "walk_rad_s_sqrt_s": (WALK, "walk"),
    "acceleration_m_s2": (ACCELERATION, "acceleration"),
}
NEVER_LESS = ("of_angle", "walk_rad_s_sqrt_s")  # what the model leaves out is there, seen or not


@dataclass(frozen=True, slots=True)
class Fit:
    """The graph where it has come to rest; `covariance` (p, p), `chi_square` of all but the priors."""

    session: Handled
    told: Told
    faced: Faced
    state: State
    moved: Moved
    sizes: Sizes
    factors: tuple[Factor, ...]
    covariance: Array
    chi_square: float
    freedom: float
    iterations: int

    def freedom_of(self, factor: Factor) -> Array:
        """(r,) share of each row of a factor that the solution does not take up."""
        design, _ = white([factor])
        return np.asarray(np.clip(1 - _taken(design, self.covariance), 1e-6, 1.0), dtype=np.float64)


def fit(session: Handled, told: Told, trusted: int | None = None) -> Fit:
    """The solution of a session of a rest at least, and the sizes by its first `trusted` rests, None by all.

    Raises Fault `no_fit`, Refused `first_face_not_told`.
    """
    biases = np.array([rest.mean_rad_s for rest in session.rests])
    found = STATED
    begun = Taken(np.eye(3), biases, np.zeros((3, 3)), np.zeros(6))
    seen = moved(session, begun, np.tile([0.0, 0.0, 1.0], (len(biases), 1)))
    on = faced(session, told, seen)
    state, iterations, settled = _start(seen, on, begun), 0, False
    while iterations < PASSES and not settled:
        rows = list(factors(Graph(session, on, told, state, seen, found)))
        if iterations:
            rows, found = sized_anew(rows, found, trusted)
        step, covariance = solved(rows)
        if not np.isfinite(step).all() or np.abs(step[:9]).max() > 1.0:
            raise Fault("no_fit", "the moves contradict each other so much that no fit converges", _REMEDY)
        state, iterations = state.stepped(step), iterations + 1
        settled = iterations > 2 and bool((np.abs(step) < SETTLED * np.sqrt(np.diag(covariance))).all())
        seen = moved(session, state.taken, state.attitudes[:, 2])
    rows = list(factors(Graph(session, on, told, state, seen, found)))
    _, covariance = solved(rows)
    chi_square, freedom = left(rows, covariance)
    return Fit(session, told, on, state, seen, found, tuple(rows), covariance, chi_square, freedom, iterations)


_REMEDY = "See that each move is between two rests on the table, that no reading is lost, and which axes are which"


def _start(seen: Moved, on: Faced, begun: Taken) -> State:
    """Every attitude by dead reckoning, its vertical that of the face."""
    attitudes = [_upright(np.eye(3), on.up[0])]
    for row, rotation in enumerate(seen.rotations):
        attitudes.append(_upright(attitudes[-1] @ rotation, on.up[row + 1]))
    return State(
        matrix=begun.matrix,
        sensitivity=begun.sensitivity,
        bends=begun.bends,
        level=np.eye(3),
        offset=np.zeros(3),
        table=np.zeros(2),
        normals=np.zeros((6, 2)),
        attitudes=np.array(attitudes),
        biases=begun.biases,
    )


def _upright(attitude: Array, up: Array) -> Array:
    """The attitude (3, 3) next to one in which the vertical in the body is `up` (3,)."""
    from scipy.spatial.transform import Rotation

    there = attitude[2]
    axis = np.cross(there, up)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        if there @ up > 0:
            return attitude
        axis, sine = np.cross(up, np.eye(3)[np.argmin(np.abs(up))]), 0.0
    angle = np.arctan2(sine, there @ up)
    turn = np.asarray(Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle).as_matrix(), dtype=np.float64)
    return np.asarray(attitude @ turn.T, dtype=np.float64)


def _ends(row: Factor) -> int:
    """The last rest that a factor is of."""
    return row.at + (row.kind in (MOVE, WALK, CLOSURE))


def solved(rows: Sequence[Factor]) -> tuple[Array, Array]:
    """The step (p,) that the rows ask for, and its covariance (p, p)."""
    design, missed = white(rows)
    size = np.linalg.norm(design, axis=0)
    scaled = design / size
    covariance = np.asarray(np.linalg.inv(scaled.T @ scaled), dtype=np.float64) / np.outer(size, size)
    return -covariance @ (design.T @ missed), covariance


def white(rows: Sequence[Factor]) -> tuple[Array, Array]:
    """The design (r, p) of all rows and what they missed (r,), in standard deviations."""
    std = np.concatenate([row.std for row in rows])
    design, missed = np.concatenate([row.design for row in rows]), np.concatenate([row.missed for row in rows])
    return design / std[:, None], missed / std


def _taken(design: Array, covariance: Array) -> Array:
    """(r,) share of each row of a design (r, p) that the solution takes up."""
    taken: Array = np.sum(design @ covariance * design, axis=1)
    return taken


def sized_anew(rows: Sequence[Factor], now: Sizes, trusted: int | None = None) -> tuple[list[Factor], Sizes]:
    """Rows whose sizes are `now`, with the sizes that they alone tell: those of the first `trusted` rests, or all."""
    found = list(rows)
    for _ in range(SIZED):
        step, covariance = solved(found)
        sizes = _sized([row for row in found if trusted is None or _ends(row) < trusted], step, covariance, now)
        found, now = resized(found, now, sizes), sizes
    return found, now


def resized(rows: Sequence[Factor], now: Sizes, then: Sizes) -> list[Factor]:
    """Rows whose sizes are `now`, with the sizes `then`."""
    cause_of = {kind: (cause, getattr(then, name) / getattr(now, name)) for name, (kind, cause) in OF_KIND.items()}
    found = []
    for row in rows:
        cause, times = cause_of.get(row.kind, ("", 1.0))
        causes = {name: std * times if name == cause else std for name, std in row.causes.items()}
        found.append(replace(row, causes=causes))
    return found


def left(rows: Sequence[Factor], covariance: Array) -> tuple[float, float]:
    """What is left of all but the priors, and its degrees of freedom."""
    design, missed = white([row for row in rows if row.kind != PRIOR])
    return float(missed @ missed), len(design) - float(_taken(design, covariance).sum())


def _sized(rows: Sequence[Factor], step: Array, covariance: Array, now: Sizes) -> Sizes:
    """The sizes by which the rows are as far off as they should be, once the step is taken."""
    found: dict[str, float] = {}
    for name, (kind, cause) in OF_KIND.items():
        stated = getattr(STATED, name)
        square = freedom = SEEN
        if own := [row for row in rows if row.kind == kind]:
            design, missed = white(own)
            share = np.concatenate([np.square(row.causes[cause] / row.std) for row in own])
            free = np.clip(1 - _taken(design, covariance), 0.0, 1.0)
            left = np.square(missed + design @ step) - free * (1 - share)
            square += float(left.sum()) * (getattr(now, name) / stated) ** 2
            freedom += float(share @ free)
        least = stated * (1.0 if name in NEVER_LESS else LEAST)
        size = stated * float(np.sqrt(max(square, 0.0) / freedom))
        found[name] = min(max(least, size), getattr(LARGEST, name))
    return Sizes(**found)

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
from rig.estimation.by_hand.graph import ACCELERATION, CLOSURE, FLAT, MOVE, WALK, Factor, Graph, State, factors
from rig.estimation.by_hand.moves import Moved, Taken, moved
from rig.estimation.by_hand.session import LARGEST, STATED, Faced, Handled, Sizes, Told

PASSES, SIZED = 10, 4  # of the fit; in each but the first, how often the sizes are found anew
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
    settled: bool

    def freedom_of(self, factor: Factor) -> Array:
        """(r,) share of each row of a factor that the solution does not take up."""
        design = factor.design / factor.std[:, None]
        taken: Array = np.einsum("rp,pq,rq->r", design, self.covariance, design)
        return np.asarray(np.clip(1 - taken, 1e-6, 1.0), dtype=np.float64)


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
        rows = tuple(factors(Graph(session, on, told, state, seen, found)))
        step, covariance = solved(rows)
        for _ in range(SIZED if iterations else 0):
            found = _sized([row for row in rows if trusted is None or _ends(row) < trusted], step, covariance, found)
            rows = tuple(factors(Graph(session, on, told, state, seen, found)))
            step, covariance = solved(rows)
        if not np.isfinite(step).all() or np.abs(step[:9]).max() > 1.0:
            raise Fault("no_fit", "the moves contradict each other so much that no fit converges", _REMEDY)
        state, iterations = state.stepped(step), iterations + 1
        settled = iterations > 2 and bool((np.abs(step) < SETTLED * np.sqrt(np.diag(covariance))).all())
        seen = moved(session, state.taken, state.attitudes[:, 2])
    rows = tuple(factors(Graph(session, on, told, state, seen, found)))
    _, covariance = solved(rows)
    chi_square, freedom = left(rows, covariance)
    return Fit(session, told, on, state, seen, found, rows, covariance, chi_square, freedom, iterations, settled)


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
    design = np.vstack([row.design / row.std[:, None] for row in rows])
    missed = np.concatenate([row.missed / row.std for row in rows])
    size = np.linalg.norm(design, axis=0)
    information = (design / size).T @ (design / size)
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64) / np.outer(size, size)
    return -covariance @ (design.T @ missed), covariance


def sized_anew(rows: Sequence[Factor], now: Sizes) -> tuple[list[Factor], Sizes]:
    """Rows whose sizes are `now`, with the sizes that they alone tell."""
    found = list(rows)
    for _ in range(SIZED):
        sizes = _sized(found, *solved(found), now)
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
    chi_square = freedom = 0.0
    for row in rows:
        if row.kind != "prior":
            design = row.design / row.std[:, None]
            chi_square += float(np.sum((row.missed / row.std) ** 2))
            freedom += len(design) - float(np.einsum("rp,pq,rq->", design, covariance, design))
    return chi_square, freedom


def _sized(rows: Sequence[Factor], step: Array, covariance: Array, now: Sizes) -> Sizes:
    """The sizes by which the rows are as far off as they should be, once the step is taken."""
    found: dict[str, float] = {}
    for name, (kind, cause) in OF_KIND.items():
        stated = getattr(STATED, name)
        square = freedom = SEEN
        for row in (row for row in rows if row.kind == kind):
            design, variance = row.design / row.std[:, None], row.std**2
            share = row.causes[cause] ** 2 / variance
            free = np.clip(1 - np.einsum("rp,pq,rq->r", design, covariance, design), 0.0, 1.0)
            unit = row.causes[cause] * stated / getattr(now, name)
            left = (row.missed + row.design @ step) ** 2 - free * variance * (1 - share)
            square += float(np.sum(share * left / unit**2))
            freedom += float(np.sum(share * free))
        least = stated * (1.0 if name in NEVER_LESS else LEAST)
        size = stated * float(np.sqrt(max(square, 0.0) / freedom))
        found[name] = min(max(least, size), getattr(LARGEST, name))
    return Sizes(**found)

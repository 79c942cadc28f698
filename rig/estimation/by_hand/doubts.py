"""What of a session contradicts all the rest of it, by name.

Each doubt is that some factors are not what they were taken for: each of their equations gets a column, which leaves it
out, and what is left is compared. The doubt after which least is left is the one that is named.

One rest or turn that is far off makes the sizes large that are found of a hand, and hides behind them: the result
holds, with a larger U. It is found by the sizes without it (`hidden`). A bias is left out of this: real ones go by
steps.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.by_hand.fit import Fit, resized, sized_anew, solved, white
from rig.estimation.by_hand.graph import ACCELERATION, CLOSURE, FLAT, LEANING, MOVE, TABLE, WALK, Factor
from rig.estimation.by_hand.session import LARGEST, STATED, Rest, Sizes

A_ROW = 4.0  # of chi square: what leaves out more has to explain more
BY_MUCH = 16.0  # of chi square beyond that: 1 in 10^5
NEARLY = 0.99  # of the largest size
OF_DOUBT = {
    "turn_not_closed": (CLOSURE, LEANING),
    "lost_in_move": (MOVE, CLOSURE, LEANING),
    "bias_jumped": (WALK,),
    "not_flat": (FLAT, ACCELERATION),
}
JUMP_RAD_S = 1e-3  # no bias walks so far from one rest to the next
OF_ONE, HIDING = 3.0, ("repeat_rad", "closure_rad")  # sizes that one rest or move makes so many times as large
HIDDEN = ("not_flat", "table_moved", "turn_not_closed")
FREE = 1e-9  # of an equation: where less of it is left, the others do not tell what it says
AT_ONCE = 8.0  # the same where somebody stands beside it and can do it again: 1 in 10^3


@dataclass(frozen=True, slots=True)
class Doubt:
    """A doubt about a rest or move, and by how much less is left without what is doubted."""

    name: str
    at: int
    less: float


def doubted(fit: Fit, since: int | None = None) -> Fault | None:
    """What is wrong with a session, or with what came `since` a rest; None where nothing is."""
    worst = max(_told(fit, since), key=lambda each: each.less, default=None)
    if worst is not None and worst.less > (BY_MUCH if since is None else AT_ONCE):
        return named(fit, worst)
    return None if since is not None else _beyond(fit)


def hidden(fit: Fit) -> Fault | None:
    """The one rest or turn by which the sizes of a hand are much larger than they are without it, and with them U."""
    if not _much_larger(fit.sizes, STATED):
        return None
    told = sorted(_told(fit, None), key=lambda each: each.less)
    most = {each.name: each for each in told if each.name in HIDDEN}
    anew = [replace(each, less=_less_anew(fit, each.name, each.at)) for each in most.values()]
    worst = max(anew, key=lambda each: each.less, default=None)
    return named(fit, worst) if worst is not None and worst.less > BY_MUCH else None


def _doubts(fit: Fit, since: int | None) -> Iterator[tuple[str, int]]:
    """What may be doubted of a session, or of what came `since` a rest."""
    count = len(fit.session.rests)
    first = 0 if since is None else since
    for at in range(max(first - 1, 0), count - 1):
        if fit.faced.turns[at] and fit.told.closure:
            yield "turn_not_closed", at
        yield "lost_in_move", at
        if np.abs(np.subtract(*(fit.session.rests[at + each].mean_rad_s for each in (1, 0)))).max() > JUMP_RAD_S:
            yield "bias_jumped", at
    faces = fit.faced.faces
    yield from (("not_flat", at) for at in range(first, count) if faces[at] is not None)
    if fit.session.acceleration is not None:
        yield from (("table_moved", at) for at in range(max(first, 1), count) if faces[at] is not None)


def _told(fit: Fit, since: int | None) -> list[Doubt]:
    """The doubts, each with the chi square that goes with what is doubted, beyond what goes with as many equations.

    What the solution takes up of its columns goes with it in any case, so the graph is not solved for each doubt.
    """
    design, missed = white(fit.factors)
    std = np.concatenate([row.std for row in fit.factors])
    basis = np.linalg.qr(design / np.linalg.norm(design, axis=0))[0]

    def without(taken: Array) -> Array:
        return np.asarray(taken - basis @ (basis.T @ taken), dtype=np.float64)

    left, told = without(missed), []
    for name, at in _doubts(fit, since):
        columns = without(_columns(fit, name, at) / std[:, None])
        rest = left - columns @ np.linalg.lstsq(columns, left, rcond=FREE)[0]
        less = float(missed @ missed - rest @ rest) - A_ROW * columns.shape[1]
        told.append(Doubt(name, at, less if columns.size else 0.0))
    return told


def _less_anew(fit: Fit, name: str, at: int) -> float:
    """The chi square that goes, by the sizes without what is doubted; 0 where none of these is much smaller."""
    columns = _columns(fit, name, at)
    ends = np.cumsum([len(row.missed) for row in fit.factors])[:-1]
    parts = zip(fit.factors, np.split(columns, ends), strict=True)
    rows = [replace(row, design=np.hstack([row.design, part])) for row, part in parts]
    try:
        rows, sizes = sized_anew(rows, fit.sizes)
        if not columns.size or not _much_larger(fit.sizes, sizes):
            return 0.0
        less = _least(resized(fit.factors, fit.sizes, sizes)) - _least(rows)
        return less - float(A_ROW * columns.shape[1])
    except np.linalg.LinAlgError:
        return 0.0


def _is(row: Factor, at: int, *kinds: str) -> bool:
    return row.at == at and row.kind in kinds


def _columns(fit: Fit, name: str, at: int) -> Array:
    """(R, q) columns beside the design of all R equations, for what is doubted."""
    if name == "table_moved":
        return np.concatenate([_leaning_from(fit, row, at) for row in fit.factors])
    out = np.concatenate([np.full(len(row.missed), _is(row, at, *OF_DOUBT[name])) for row in fit.factors])
    return np.eye(len(out))[:, out]


def _leaning_from(fit: Fit, row: Factor, at: int) -> Array:
    """(r, 2) columns of a row: how the table leans from rest `at` on, and by what the way there turned more.

    Not so at the last rest: there, a side that does not lie flat looks like this.
    """
    other = np.zeros((len(row.design), 2))
    if row.kind == ACCELERATION and row.at >= at:
        other = row.design[:, TABLE]
    elif row.kind == MOVE and row.at == at - 1 and at < len(fit.session.rests) - 1:
        other = fit.state.attitudes[row.at].T[:, :2] @ np.array([[0.0, -1.0], [1.0, 0.0]])
    return other


def _much_larger(sizes: Sizes, than: Sizes) -> bool:
    return any(getattr(sizes, each) > OF_ONE * getattr(than, each) for each in HIDING)


def _least(rows: Sequence[Factor]) -> float:
    """What is left of the rows where it is least."""
    design, missed = white(rows)
    return float(np.sum(np.square(missed + design @ solved(rows)[0])))


def named(fit: Fit, doubt: Doubt) -> Fault:
    rests, moves = fit.session.rests, fit.session.moves
    at_s = rests[doubt.at].start_s
    if doubt.name == "turn_not_closed":
        move = moves[doubt.at]
        missed = float(next(row for row in fit.factors if _is(row, doubt.at, CLOSURE)).missed[0])
        return Fault(
            "turn_not_closed",
            f"the turn from {move.start_s:.1f} to {move.end_s:.1f} s ended {abs(np.degrees(missed)):.1f}° from where "
            "it began",
            "Turn against a straight edge, so that it ends where it began (rig solve: or say --no-closure)",
        )
    if doubt.name == "lost_in_move":
        move = moves[doubt.at]
        return Fault(
            "lost_in_move",
            f"what the gyroscope read from {move.start_s:.1f} to {move.end_s:.1f} s is not how the body turned",
            "See that no reading is lost, and that time stamps are those of the readings; make the move again",
        )
    if doubt.name == "bias_jumped":
        return _jumped(doubt.at, rests)
    if doubt.name == "table_moved":
        return Fault("table_moved", f"from {at_s:.1f} s on the table leans otherwise", "Begin anew, and leave it alone")
    return Fault(
        "not_flat",
        f"at {at_s:.1f} s the body did not lie flat on its face, as it does at the other rests",
        "Look for what lies under it, and lay it down again",
    )


def _jumped(at: int, rests: Sequence[Rest]) -> Fault:
    """The Fault that the bias is another after the move `at`; of a rest at an end, a creep looks like it."""
    after_s = rests[at + 1].start_s
    what = f"the gyroscope's bias was another after the move that ended at {after_s:.1f} s"
    if at == len(rests) - 2:
        what += ", or the body crept in the last rest, which comes then"
        return Fault(
            "bias_jumped", what, "Let it lie for another rest, which tells them apart; after a fall begin anew"
        )
    if at == 0:
        what += f", or the body crept in the first rest, until {rests[0].end_s:.1f} s"
    return Fault("bias_jumped", what, "Handle it gently: a fall or a knock does that; begin anew")


def _beyond(fit: Fit) -> Fault | None:
    """Something was found to be larger than a hand, or a sensor, makes it."""
    sizes = fit.sizes
    if sizes.repeat_rad >= NEARLY * LARGEST.repeat_rad:
        what = f"the faces do not lie as they lay before, by {1e3 * sizes.repeat_rad:.1f} mrad or more"
        return Fault("not_flat", what, _REMEDY)
    if sizes.acceleration_m_s2 >= NEARLY * LARGEST.acceleration_m_s2:
        what = f"the accelerometer contradicts the faces by {sizes.acceleration_m_s2:.2f} m/s² or more"
        return Fault("not_flat", what, _REMEDY)
    if sizes.closure_rad >= NEARLY * LARGEST.closure_rad:
        what = f"the turns do not end where they began, by {1e3 * sizes.closure_rad:.0f} mrad or more"
        return Fault("turn_not_closed", what, "Turn against a straight edge (rig solve: or say --no-closure)")
    if sizes.of_angle >= NEARLY * LARGEST.of_angle:
        what = f"the moves contradict each other by {100 * sizes.of_angle:.2f} % of a quarter turn or more"
        return Fault("lost_in_move", what, _REMEDY)
    if sizes.walk_rad_s_sqrt_s >= NEARLY * LARGEST.walk_rad_s_sqrt_s:
        what = f"the bias goes by {sizes.walk_rad_s_sqrt_s:.1g} rad/s within a second"
        return Fault("bias_jumped", what, "Let it warm up, and handle it gently")
    return None


_REMEDY = "Lay it down on a flat table, each time on the whole of a face, and see that no reading is lost"

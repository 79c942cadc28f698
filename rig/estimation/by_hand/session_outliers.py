"""The search for the rest or move that contradicts the others: outlier tests of a session by hand.

A fault hypothesis is that some factors are wrong, so each of their equations gets a column of its own (Baarda's
mean-shift model, 1968). The hypothesis with the largest decrease of χ² is reported.

A single large outlier inflates the hand's standard deviations, which then mask the outlier: the result is right, but
has a larger U. `find_masked_fault` re-estimates the standard deviations without each candidate. Biases are no
candidates, because real biases jump.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.by_hand.fit import GraphFit, estimate_stds, replace_stds, solve_step, whiten_rows
from rig.estimation.by_hand.graph import ACCELERATION, CLOSURE, FLAT, MOVE, OFFSET, TABLE, TILT, WALK, Factor
from rig.estimation.by_hand.session_parts import MAX_STDS, STATED, HandRest, HandStds

EQUATION_CHI_SQUARE_DROP = 4.0  # expected for each equation left out
CHI_SQUARE_DROP_LIMIT = 16.0  # further decrease that shows an outlier: false-alarm probability 1 in 10^5
AT_LIMIT_RATIO = 0.99  # least fraction of the largest standard deviation that counts as at its limit
FACTORS_OF = {
    "turn_not_closed": (CLOSURE, TILT),
    "lost_in_move": (MOVE, CLOSURE, TILT),
    "bias_jumped": (WALK,),
    "not_flat": (FLAT, ACCELERATION),
}
JUMP_RAD_S = 1e-3  # change of the mean reading between two rests: no bias drifts by as much
# the standard deviations that one outlier inflates, and their least ratio to the stated ones if it does
INFLATION_RATIO, INFLATED_STDS = 3.0, ("repeat_rad", "closure_rad")
HIDEABLE_OUTLIERS = ("not_flat", "table_moved", "accelerometer_jumped", "turn_not_closed")
MIN_REDUNDANCY = 1e-9  # redundancy below which the other equations do not check an equation
MIN_SKEW_PROBABILITY = 1e-5  # of faces as far out of square as they seem
LIVE_DROP_LIMIT = 8.0  # during the session, in which a move can be repeated: 1 in 10^3


@dataclass(frozen=True, slots=True)
class FaultHypothesis:
    """A possible fault of the rest or move `index`, and the drop of χ² if the affected equations need not hold."""

    name: str
    index: int
    chi_square_drop: float


def find_contradiction(fit: GraphFit, since: int | None = None) -> Fault | None:
    """Return the fault of a session, or of its part that begins at the rest `since`; None if there is no fault."""
    worst = max(_test_hypotheses(fit, since), key=lambda hypothesis: hypothesis.chi_square_drop, default=None)
    if worst is not None and worst.chi_square_drop > (CHI_SQUARE_DROP_LIMIT if since is None else LIVE_DROP_LIMIT):
        return describe_fault(fit, worst)
    return None if since is not None else _find_excessive_std(fit) or _find_unlikely_box(fit)


def find_masked_fault(fit: GraphFit) -> Fault | None:
    """Return the fault of the single rest or turn that inflates the stds of the hand's moves, if there is one."""
    if not _much_larger(fit.stds, STATED):
        return None
    hypotheses = sorted(_test_hypotheses(fit, None), key=lambda hypothesis: hypothesis.chi_square_drop)
    most = {hypothesis.name: hypothesis for hypothesis in hypotheses if hypothesis.name in HIDEABLE_OUTLIERS}
    re_estimated = [
        replace(hypothesis, chi_square_drop=_drop_with_new_stds(fit, hypothesis.name, hypothesis.index))
        for hypothesis in most.values()
    ]
    worst = max(re_estimated, key=lambda hypothesis: hypothesis.chi_square_drop, default=None)
    return describe_fault(fit, worst) if worst is not None and worst.chi_square_drop > CHI_SQUARE_DROP_LIMIT else None


def _hypotheses(fit: GraphFit, since: int | None) -> Iterator[tuple[str, int]]:
    """Yield possible faults of a session, or of its part from the rest `since` on: name, and index of rest or move."""
    count = len(fit.session.rests)
    first = 0 if since is None else since
    for index in range(max(first - 1, 0), count - 1):
        if fit.faces.turns[index] and fit.conditions.closure:
            yield "turn_not_closed", index
        yield "lost_in_move", index
        if np.abs(fit.session.rests[index + 1].mean_rad_s - fit.session.rests[index].mean_rad_s).max() > JUMP_RAD_S:
            yield "bias_jumped", index
    faces = fit.faces.faces
    yield from (("not_flat", index) for index in range(first, count) if faces[index] is not None)
    if fit.session.acceleration is not None:
        yield from (("table_moved", index) for index in range(max(first, 1), count) if faces[index] is not None)
        yield from (("accelerometer_jumped", index) for index in range(max(first, 1), count))


def _test_hypotheses(fit: GraphFit, since: int | None) -> list[FaultHypothesis]:
    """Return each hypothesis with its decrease of χ², corrected for the number of columns.

    The fault's columns are made orthogonal to the model's, so the graph need not be solved for each hypothesis.
    """
    design, residual = whiten_rows(fit.factors)
    std = np.concatenate([row.std for row in fit.factors])
    basis = np.linalg.qr(design / np.linalg.norm(design, axis=0))[0]

    def remove_explained(columns: Array) -> Array:
        return np.asarray(columns - basis @ (basis.T @ columns), dtype=np.float64)

    remaining = remove_explained(residual)
    hypotheses = []
    for name, index in _hypotheses(fit, since):
        columns = remove_explained(_fault_columns(fit, name, index) / std[:, None])
        rest = remaining - columns @ np.linalg.lstsq(columns, remaining, rcond=MIN_REDUNDANCY)[0]
        chi_square_drop = float(residual @ residual - rest @ rest) - EQUATION_CHI_SQUARE_DROP * columns.shape[1]
        hypotheses.append(FaultHypothesis(name, index, chi_square_drop if columns.size else 0.0))
    return hypotheses


def _drop_with_new_stds(fit: GraphFit, name: str, index: int) -> float:
    """Return the decrease of χ² if the fault is fitted and the stds are re-estimated; 0 if these hardly change."""
    columns = _fault_columns(fit, name, index)
    ends = np.cumsum([len(row.residual) for row in fit.factors])[:-1]
    parts = zip(fit.factors, np.split(columns, ends), strict=True)
    rows = [replace(row, design=np.hstack([row.design, part])) for row, part in parts]
    try:
        rows, stds = estimate_stds(rows, fit.stds)
        if not columns.size or not _much_larger(fit.stds, stds):
            return 0.0
        chi_square_drop = _minimum_chi_square(replace_stds(fit.factors, fit.stds, stds)) - _minimum_chi_square(rows)
        return chi_square_drop - float(EQUATION_CHI_SQUARE_DROP * columns.shape[1])
    except np.linalg.LinAlgError:
        return 0.0


def _matches(row: Factor, index: int, *kinds: str) -> bool:
    return row.index == index and row.kind in kinds


def _fault_columns(fit: GraphFit, name: str, index: int) -> Array:
    """Return the columns (R, q) that the fault `name` at the rest or move `index` adds to the design of R equations."""
    if name == "table_moved":
        return np.concatenate([_tilt_columns(fit, row, index) for row in fit.factors])
    if name == "accelerometer_jumped":
        return np.concatenate(
            [row.design[:, OFFSET] * (row.kind == ACCELERATION and row.index >= index) for row in fit.factors]
        )
    out = np.concatenate([np.full(len(row.residual), _matches(row, index, *FACTORS_OF[name])) for row in fit.factors])
    return np.eye(len(out))[:, out]


def _tilt_columns(fit: GraphFit, row: Factor, index: int) -> Array:
    """Return the derivatives (r, 2) of a factor's equations by a lasting tilt of the table before rest `index`.

    They are zero for the move to the last rest, where a tilted table looks like a body that does not lie flat.
    """
    other = np.zeros((len(row.design), 2))
    if row.kind == ACCELERATION and row.index >= index:
        other = row.design[:, TABLE]
    elif row.kind == MOVE and row.index == index - 1 and index < len(fit.session.rests) - 1:
        other = fit.state.attitudes[row.index].T[:, :2] @ np.array([[0.0, -1.0], [1.0, 0.0]])
    return other


def _much_larger(stds: HandStds, than: HandStds) -> bool:
    return any(getattr(stds, name) > INFLATION_RATIO * getattr(than, name) for name in INFLATED_STDS)


def _minimum_chi_square(rows: Sequence[Factor]) -> float:
    """Return the χ² of the rows, minimised over all parameters."""
    design, residual = whiten_rows(rows)
    return float(np.sum(np.square(residual + design @ solve_step(rows)[0])))


def describe_fault(fit: GraphFit, hypothesis: FaultHypothesis) -> Fault:
    """Return the Fault that explains a fault hypothesis to the operator, with its time."""
    rests, moves = fit.session.rests, fit.session.moves
    at_s = rests[hypothesis.index].start_s
    if hypothesis.name == "turn_not_closed":
        move = moves[hypothesis.index]
        residual = float(next(row for row in fit.factors if _matches(row, hypothesis.index, CLOSURE)).residual[0])
        return Fault(
            "turn_not_closed",
            f"the turn from {move.start_s:.1f} to {move.end_s:.1f} s ended {abs(np.degrees(residual)):.1f}° from where "
            "it began",
            "Turn against a straight edge, so that it ends where it began. For a file recorded without one: "
            "--no-closure",
        )
    if hypothesis.name == "lost_in_move":
        move = moves[hypothesis.index]
        return Fault(
            "lost_in_move",
            f"from {move.start_s:.1f} to {move.end_s:.1f} s the gyroscope's readings contradict how the body turned",
            "See that no reading is lost, and that time stamps are those of the readings; make the move again",
        )
    if hypothesis.name == "bias_jumped":
        return _describe_jump(hypothesis.index, rests)
    if hypothesis.name == "table_moved":
        return Fault(
            "table_moved", f"from {at_s:.1f} s on the table is tilted differently", "Begin again, and leave it alone"
        )
    if hypothesis.name == "accelerometer_jumped":
        return Fault(
            "accelerometer_jumped",
            f"from {at_s:.1f} s on the accelerometer has another bias",
            "Begin again: let it warm up, and handle it gently",
        )
    return Fault(
        "not_flat",
        f"at {at_s:.1f} s the body did not lie flat on its face as at the other rests",
        "Look for something under it, and lay it down again",
    )


def _describe_jump(index: int, rests: Sequence[HandRest]) -> Fault:
    """Return the Fault of a bias that jumped in the move `index`; at the first or last rest a creep looks the same."""
    after_s = rests[index + 1].start_s
    what = f"the gyroscope had another bias after the move that ended at {after_s:.1f} s"
    if index == len(rests) - 2:
        what += ", or the body crept in the last rest, which follows it"
        return Fault(
            "bias_jumped", what, "Let it lie for another rest, which tells the two apart; after a fall, begin again"
        )
    if index == 0:
        what += f", or the body crept in the first rest, until {rests[0].end_s:.1f} s"
    return Fault("bias_jumped", what, "Handle it gently: a fall or a knock causes this; begin again")


def _find_excessive_std(fit: GraphFit) -> Fault | None:
    """Return the Fault for an impossibly large standard deviation of hand or sensor; None if there is none."""
    stds = fit.stds
    if stds.repeat_rad >= AT_LIMIT_RATIO * MAX_STDS.repeat_rad:
        what = f"the faces were not laid down as before: they differ by {1e3 * stds.repeat_rad:.1f} mrad or more"
        return Fault("not_flat", what, _REMEDY)
    if stds.acceleration_m_s2 >= AT_LIMIT_RATIO * MAX_STDS.acceleration_m_s2:
        what = f"the accelerometer contradicts the faces by {stds.acceleration_m_s2:.2f} m/s² or more"
        return Fault("not_flat", what, _REMEDY)
    if stds.closure_rad >= AT_LIMIT_RATIO * MAX_STDS.closure_rad:
        what = f"the turns do not end where they began, by {1e3 * stds.closure_rad:.0f} mrad or more"
        return Fault(
            "turn_not_closed", what, "Turn against a straight edge. For a file recorded without one: --no-closure"
        )
    if stds.of_angle >= AT_LIMIT_RATIO * MAX_STDS.of_angle:
        what = f"the moves contradict each other by {100 * stds.of_angle:.2f} % of a quarter turn or more"
        return Fault("lost_in_move", what, _REMEDY)
    if stds.walk_rad_s_sqrt_s >= AT_LIMIT_RATIO * MAX_STDS.walk_rad_s_sqrt_s:
        what = f"the bias changes by {stds.walk_rad_s_sqrt_s:.1g} rad/s within a second"
        return Fault("bias_jumped", what, "Let it warm up, and handle it gently")
    return None


def _find_unlikely_box(fit: GraphFit) -> Fault | None:
    """Return a Fault if χ² of the faces' normals shows that the faces are further out of square than stated, else None.

    A scale factor that changes in mid-session looks like a skewed box, because the faces follow the moves' angles.
    """
    from scipy.special import chdtri

    skew_rad, stated_rad = fit.state.normals.ravel(), fit.conditions.box_rad
    if np.sum(np.square(skew_rad / stated_rad)) < chdtri(len(skew_rad), MIN_SKEW_PROBABILITY):
        return None
    return Fault(
        "not_flat",
        f"the moves fit together only if the faces are up to {np.degrees(np.abs(skew_rad).max()):.2g}° out of square, "
        f"but only {np.degrees(stated_rad):.2g}° is stated",
        "If the faces of the body are really so far out of square, state its squareness_deg (rig solve: "
        "--squareness-deg); otherwise begin again",
    )


_REMEDY = "Lay it down on a flat table, each time on a complete face, and check that no reading is lost"

"""The solution of a session by hand: scale, bias and axes, their budget, and summaries of rests and moves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation import refusals
from rig.estimation.arrays import Array, scale_of
from rig.estimation.by_hand.creep import find_creeping_rests
from rig.estimation.by_hand.fit import PRIOR_DOF, GraphFit, fit_session, whiten_rows
from rig.estimation.by_hand.flip_axes import check_axes
from rig.estimation.by_hand.graph import CLOSURE, MOVE, ROUNDING, Factor
from rig.estimation.by_hand.session_outliers import find_contradiction, find_masked_fault
from rig.estimation.by_hand.session_parts import FACES, MAX_STDS, STATED, HandRecording, SessionConditions, drop_rests
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.estimation.gyroscope.rotations_by_angle import TurnedSolution
from rig.estimation.sensor_axes import SensorAxes, parameter_jacobian

MAX_REPEATABILITY_RATIO = 3.0  # to the stated value: faces that repeat worse may be different faces
MAX_RESTS = 300  # their equations fill a gigabyte; a session has some twenty rests
MAX_SCALE_U = 0.02  # k = 2: above it, there is no result
REAL_HAND_STD = 5e-4  # of the scale factor: recordings of real hands differ by as much between their parts
MOVES_LEFT_OUT = "moves left out"  # begins a warning of moves without a rotation
CLOCK, RECORDED_HANDS = "clock", "recordings of real hands"
CONTRIBUTORS: dict[str, tuple[Literal["A", "B"], tuple[str, ...], str]] = {
    "noise": ("A", ("noise", "acceleration noise", "stamps"), "scatter at rest, and of the time stamps"),
    "placement": (
        "A",
        ("repeat", "closure", "box", "table", "lean", "acceleration", "along", "level", "heading", "held"),
        "how the faces lie and the turns end, against each other",
    ),
    "bias from rest to rest": (
        "A",
        ("walk", "earth", "bias", "drift", "jump"),
        "scatter of the rests; the Earth's rate",
    ),
    ROUNDING: ("B", (ROUNDING,), "the steps of the readings, which may be rounded or cut"),
    "angles of the moves": ("A", ("of_angle",), "how the moves contradict each other"),
    "nonlinearity": ("B", ("nonlinearity", "matrix"), "what is known of parts, and the moves this way and that"),
    "g-sensitivity": ("B", ("g-sensitivity",), "what is known of parts, and the rests on opposite faces"),
}


@dataclass(frozen=True, slots=True)
class RestSummary:
    """The fit of a rest: its largest residual in units of that residual's std, and its `face`, None if unknown."""

    face: str | None
    normalised_residual: float


@dataclass(frozen=True, slots=True)
class MoveSummary:
    """The fit of a move by the angle `angle_rad`.

    - `kind`: a "turn" has whole turns, a "flip" none; a move is "omitted" if its rotation was not measured.
    - `turns`: the signed number of whole turns.
    - `normalised_residual`: the largest residual in units of its own standard deviation.
    - `closure_rad`: the error of the heading after whole turns, None if the model has no such error for the move.
    """

    kind: Literal["flip", "turn", "omitted"]
    angle_rad: float
    turns: int
    normalised_residual: float
    closure_rad: float | None


@dataclass(frozen=True, slots=True)
class HandSolution:
    """The solution of a session by hand.

    - `turned`: scale, bias and axes, of the same type as a solution from known rotations.
    - `stds`: three values of each standard deviation of `HandStds`, by name: estimated, stated, and largest allowed.
    - `creeping_s`: times at which the body crept during intended rests, which are left out.
    - `expanded_scale` (3,): U (k = 2) from this session and its clock. The budget of `turned` has one contributor more,
      which is estimated from recordings of real hands.
    """

    turned: TurnedSolution
    rests: tuple[RestSummary, ...]
    moves: tuple[MoveSummary, ...]
    stds: dict[str, tuple[float, float, float]]
    chi_square: float
    dof: float
    expanded_scale: Array
    creeping_s: tuple[tuple[float, float], ...] = ()

    @property
    def budget(self) -> Budget:
        return self.turned.budget

    @property
    def scale(self) -> Array:
        return self.turned.scale

    @property
    def bias_rad_s(self) -> Array:
        """The biases b (3,) at the last rest, in the model rate = K (reading + b)."""
        return self.turned.bias_rad_s

    @property
    def covariance(self) -> Array:
        """The covariance (6, 6) of scale and bias from the session and its clock."""
        return self.turned.covariance


def solve_by_hand(session: HandRecording, conditions: SessionConditions) -> HandSolution:
    """Return the calibration from a session in which a hand turns the sensors.

    Raise Fault `too_few_moves`, `clipping`, `lost_in_move`, `held_not_laid_down`, `turn_not_closed`, `not_flat`,
    `table_moved`, `bias_jumped`, `accelerometer_jumped`, `wrong_face`, `mirrored_axis`, `swapped_axes`, `wrong_unit`,
    `no_fit`, `zero_reading`, `too_many_moves`; Refused `first_face_unknown`.
    """
    _check_session(session)
    fitted: GraphFit | None = None
    try:
        fitted = fit_session(session, conditions)
        if rows := find_creeping_rests(fitted):
            session = drop_rests(session, rows)
            fitted = fit_session(session, conditions)
        fault = _check_precision(fitted) or find_contradiction(fitted)
    except Fault as error:
        fault = error if all(move.is_usable for move in session.moves) else insufficient_session(session, None)
    other = None
    if fitted is None or _looseness(fitted) > MAX_REPEATABILITY_RATIO:
        other = _find_first_face(session, conditions, None if fault is not None else fitted)
    if (reason := other or fault) is not None or fitted is None:
        raise reason or insufficient_session(session, None)
    refusals.check_unit(scale_of(fitted.state.matrix))
    refusals.check_handedness(fitted.state.matrix)
    one = find_masked_fault(fitted)
    return summarise_fit(fitted, () if one is None else (f"{one.what}: U is larger for this session alone",))


def _check_session(session: HandRecording) -> None:
    """Refuse a session that no fit can solve. Raise as `solve_by_hand` does."""
    lost = sum(move.lost or move.clipped for move in session.moves)
    if len(session.rests) < 2 or 2 * lost > len(session.moves):
        raise insufficient_session(session, None)
    if len(session.rests) > MAX_RESTS:
        what = f"there are {len(session.rests)} rests; no more than {MAX_RESTS} are solved together"
        raise Fault("too_many_moves", what, "Split the recording")
    if session.acceleration is not None:
        refusals.check_signal(np.array([rest.acceleration_m_s2 for rest in session.rests]))
    check_axes(session)


def summarise_fit(fit: GraphFit, warnings: tuple[str, ...] = ()) -> HandSolution:
    """Return the solution of a converged graph; `warnings` are added to its own."""
    matrix, conditions = fit.state.matrix, fit.conditions
    axes = SensorAxes.from_matrix(matrix)
    chosen = parameter_columns(fit)
    covariance = fit.covariance[np.ix_(chosen, chosen)]
    to_parameters = parameter_jacobian(matrix, axes.scale)
    clock = np.zeros((6, 6))
    clock[:3, :3] = np.outer(axes.scale, axes.scale) * (1e-6 * conditions.clock_ppm) ** 2 / 3
    of_session = to_parameters @ covariance @ to_parameters.T + clock
    design, _ = whiten_rows(fit.factors)
    conditioned = design / np.linalg.norm(design, axis=0)
    turned = TurnedSolution(
        scale=axes.scale,
        bias_rad_s=-fit.state.biases[-1],
        covariance=of_session,
        matrix=matrix,
        matrix_covariance=covariance,
        non_orthogonality_rad=axes.non_orthogonality_rad,
        mounting=axes.mounting,
        angles_covariance_rad2=axes.angles_covariance_rad2(covariance[:9, :9]),
        residuals_rad_s=np.zeros((0, 3)),
        inflation=max(1.0, fit.stds.repeat_rad / STATED.repeat_rad),
        inflation_dof=np.inf,
        budget=_budget(fit, to_parameters, clock),
        observations=len(fit.session.rests) + sum(move.is_usable for move in fit.session.moves),
        rank=12,
        condition=float(np.sqrt(np.linalg.cond(conditioned[:, chosen].T @ conditioned[:, chosen]))),
        iterations=fit.iterations,
        warnings=(*_warnings(fit), *warnings),
        estimator="by_hand",
    )
    return HandSolution(
        turned=turned,
        rests=tuple(RestSummary(face, _largest_residual(fit, row)) for row, face in enumerate(fit.faces.faces)),
        moves=tuple(_summarise_move(fit, row) for row in range(len(fit.session.moves))),
        stds={
            name: (getattr(fit.stds, name), getattr(STATED, name), getattr(MAX_STDS, name))
            for name in fit.stds.__slots__
            if name != "acceleration_m_s2" or fit.session.acceleration is not None
        },
        chi_square=fit.chi_square,
        dof=fit.dof,
        expanded_scale=2 * np.sqrt(np.diag(of_session)[:3]),
        creeping_s=fit.session.creeping_s,
    )


def parameter_columns(fit: GraphFit) -> NDArray[np.intp]:
    """Return the columns (12,), among all unknowns, of the gyroscope's matrix and of the last rest's bias."""
    count = fit.covariance.shape[0]
    return np.asarray(np.r_[0:9, count - 3 : count])


def insufficient_session(session: HandRecording, expanded: Array | None) -> Fault:
    """Return the Fault of a session that has no result because its moves are unusable or too few.

    `expanded` (3,) is the relative U of the scale factors so far, None if unknown.
    """
    clipped = sum(move.clipped for move in session.moves)
    lost = sum(move.lost for move in session.moves)
    if clipped:
        peak = max(move.peak_rad_s for move in session.moves if move.clipped)
        return Fault(
            "clipping",
            f"in {clipped} of {len(session.moves)} moves the gyroscope was at the end of its range, "
            f"{np.degrees(peak):.0f} °/s",
            "Turn more slowly, or set a larger range",
        )
    if lost:
        return Fault(
            "lost_in_move",
            f"in {lost} of {len(session.moves)} moves readings are missing",
            "Look at the cable and at how the readings are logged; record again",
        )
    if session.held_in_air_s:
        start_s, end_s = session.held_in_air_s[0]
        return Fault(
            "held_not_laid_down",
            f"from {start_s:.1f} to {end_s:.1f} s the body was held in the hand, not laid down"
            + (f", and {len(session.held_in_air_s) - 1} more times" if len(session.held_in_air_s) > 1 else ""),
            "After every move, lay it down and let go of it for a second",
        )
    so_far = "" if expanded is None else f"; the scale is known to {float(f'{100 * expanded.max():.2g}'):g} %"
    if creeping_s := session.creeping_s:
        so_far += f"; {len(creeping_s)} more are left out because the body crept from {creeping_s[0][0]:.1f} s on"
    return Fault(
        "too_few_moves",
        f"there are {len(session.rests)} rests and {sum(move.is_usable for move in session.moves)} moves{so_far}",
        "Lay it on all six faces in at least eight moves, with a second of rest after each",
    )


def _check_precision(fit: GraphFit) -> Fault | None:
    expanded = 2 * np.sqrt(np.diag(fit.covariance)[[0, 4, 8]])
    return insufficient_session(fit.session, expanded) if expanded.max() > MAX_SCALE_U else None


def _looseness(fit: GraphFit) -> float:
    """Return the larger of two ratios of estimated to stated std: that of the faces and that of the moves."""
    stds = fit.stds
    return max(stds.repeat_rad / STATED.repeat_rad, stds.of_angle / STATED.of_angle)


def _find_first_face(session: HandRecording, conditions: SessionConditions, but: GraphFit | None) -> Fault | None:
    """Return a Fault if a fit with another first face than the stated one is consistent and clearly better, else None.

    `but` is the fit with the stated face, None if the session contradicts it.
    """
    if session.acceleration is not None or conditions.first_face is None:
        return None
    for face in (face for face in FACES if face != conditions.first_face):
        try:
            fitted = fit_session(session, replace(conditions, first_face=face))
        except Fault:
            continue
        better = but is None or _looseness(fitted) < _looseness(but) / 2
        if better and _check_precision(fitted) is None and find_contradiction(fitted) is None:
            return Fault(
                "wrong_face",
                f"the body did not begin with {conditions.first_face} upwards: its moves are those from {face}",
                f"Give --first-face {face}, or check again which axis is which",
            )
    return None


def _budget(fit: GraphFit, to_parameters: Array, clock: Array) -> Budget:
    """Return the budget of scale and bias.

    `to_parameters` (6, 12) maps the fitted matrix and bias to scale and bias; `clock` (6, 6) is the covariance due to
    the clock's error.
    """
    chosen = parameter_columns(fit)
    covariances = {name: np.zeros((6, 6)) for name in CONTRIBUTORS}
    line_of = {cause: name for name, (_, causes, _) in CONTRIBUTORS.items() for cause in causes}
    for row in fit.factors:
        gain = to_parameters @ fit.covariance[chosen] @ (row.design / row.std[:, None] ** 2).T
        for cause, std in row.causes.items():
            effect = gain * std
            covariances[line_of[cause]] += effect @ effect.T
    samples = float(sum(rest.samples for rest in fit.session.rests))
    estimated = dict.fromkeys(("placement", "bias from rest to rest", "angles of the moves"), fit.dof + PRIOR_DOF)
    dof = {"noise": samples} | estimated
    lines = [
        Contributor(name, kind, "normal", None, "", source, dof.get(name, np.inf), covariances[name])
        for name, (kind, _, source) in CONTRIBUTORS.items()
        if name != ROUNDING or covariances[name].any()
    ]
    ppm, source = fit.conditions.clock_ppm, fit.conditions.clock_source
    lines.append(Contributor(CLOCK, "B", "rectangular", ppm, "ppm", source, np.inf, clock))
    real = np.diag([*(REAL_HAND_STD * scale_of(fit.state.matrix)) ** 2, 0.0, 0.0, 0.0])
    source = "by how much recordings of hands elsewhere disagree with themselves"
    lines.append(Contributor(RECORDED_HANDS, "B", "normal", None, "", source, np.inf, real))
    return Budget(tuple(lines))


def _largest_residual(fit: GraphFit, index: int, kinds: Sequence[str] = ("flat", "acceleration")) -> float:
    rows = [row for row in fit.factors if row.index == index and row.kind in kinds]
    return max((_largest_of_factor(fit, row) for row in rows), default=0.0)


def _largest_of_factor(fit: GraphFit, row: Factor) -> float:
    return float(np.max(np.abs(row.residual) / (row.std * np.sqrt(np.maximum(fit.redundancy_numbers(row), 0.05)))))


def _summarise_move(fit: GraphFit, row: int) -> MoveSummary:
    """Return the kind and angle of the move `row`, and its residuals in the fit of the whole session."""
    move, turns = fit.session.moves[row], fit.faces.turns[row]
    closure = next((factor for factor in fit.factors if factor.kind == CLOSURE and factor.index == row), None)
    return MoveSummary(
        kind="omitted" if not move.is_usable else "turn" if turns else "flip",
        angle_rad=float(np.linalg.norm(np.linalg.solve(fit.state.matrix, fit.integrals.swept_rad[row]))),
        turns=turns,
        normalised_residual=_largest_residual(fit, row, (MOVE, CLOSURE)),
        closure_rad=None if closure is None else float(closure.residual[0]),
    )


def _warnings(fit: GraphFit) -> tuple[str, ...]:
    warnings = []
    for words, fault in (("at the end of its range", "clipped"), ("with readings missing", "lost")):
        if starts := [move.start_s for move in fit.session.moves if getattr(move, fault)]:
            at_s = ", ".join(f"{start_s:.1f}" for start_s in starts)
            warnings.append(f"{MOVES_LEFT_OUT}, the gyroscope {words}: from {at_s} s")
    if spikes_s := fit.session.spikes_s:
        warnings.append(
            f"{len(spikes_s)} readings of the gyroscope, far from those before and after, are interpolated: the first "
            f"at {spikes_s[0]:.1f} s"
        )
    return tuple(warnings)

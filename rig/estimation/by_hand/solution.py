"""A session by hand solved: scale, bias and axes, what their uncertainty is made of, and what was found on the way."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation import refusals
from rig.estimation.arrays import Array, scale_of
from rig.estimation.by_hand.axes import check_axes
from rig.estimation.by_hand.creep import crept
from rig.estimation.by_hand.doubts import doubted, hidden
from rig.estimation.by_hand.fit import SEEN, Fit, fit, white
from rig.estimation.by_hand.graph import CLOSURE, MOVE, Factor
from rig.estimation.by_hand.session import FACES, LARGEST, STATED, Handled, Told, without_crept
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.estimation.gyroscope.known_turns import TurnedSolution
from rig.estimation.sensor_axes import SensorAxes, parameter_jacobian

LOOSE = 3.0  # times what is stated of hands: faces that repeat no better may be other faces
MOST_RESTS = 300  # their equations together fill a gigabyte; a session has some twenty
ENOUGH = 0.02  # U (k = 2) of the scale, beyond which nothing has been told
REAL_HANDS = 5e-4  # of the scale: by so much (1 u) recordings of real hands have been seen to disagree with themselves
CLOCK, RECORDED_HANDS = "clock", "recordings of real hands"
LINES: dict[str, tuple[Literal["A", "B"], tuple[str, ...], str]] = {
    "noise": ("A", ("noise", "acceleration noise", "stamps"), "scatter at rest, and of the time stamps"),
    "placement": (
        "A",
        ("repeat", "closure", "box", "table", "lean", "acceleration", "along", "level", "heading", "held"),
        "how the faces lie and the turns end, against each other",
    ),
    "bias from rest to rest": ("A", ("walk", "earth", "bias"), "scatter of the rests; the Earth's rate"),
    "angles of the moves": ("A", ("of_angle",), "how the moves contradict each other"),
    "nonlinearity": ("B", ("nonlinearity", "matrix"), "what is known of parts, and the moves this way and that"),
    "g-sensitivity": ("B", ("g-sensitivity",), "what is known of parts, and the rests on opposite faces"),
}


@dataclass(frozen=True, slots=True)
class RestFound:
    """A rest on a `face`, None on none; `pull` is its largest residual over that of such residuals."""

    face: str | None
    pull: float


@dataclass(frozen=True, slots=True)
class MoveFound:
    """A move by `angle_rad` in all, a flip or so many whole `turns` on a face, which missed by `closure_rad`."""

    kind: Literal["flip", "turn", "omitted"]
    angle_rad: float
    turns: int
    pull: float
    closure_rad: float | None


@dataclass(frozen=True, slots=True)
class HandSolution:
    """What a session by hand gives.

    - `turned` is the solution as that of told turns is; its budget is `budget`.
    - `sizes` are what was found of the hand, what was stated and what is refused, by name.
    - `crept` is when the body crept at what were to be rests, which are left out.
    - `expanded_scale` (3,) is U (k = 2) by this session and its clock alone; the budget has real hands beside.
    """

    turned: TurnedSolution
    rests: tuple[RestFound, ...]
    moves: tuple[MoveFound, ...]
    sizes: dict[str, tuple[float, float, float]]
    chi_square: float
    freedom: float
    expanded_scale: Array
    crept: tuple[tuple[float, float], ...] = ()

    @property
    def budget(self) -> Budget:
        return self.turned.budget

    @property
    def scale(self) -> Array:
        return self.turned.scale

    @property
    def bias_rad_s(self) -> Array:
        """Biases (3,) as g = K (m + b) has them, at the last rest."""
        return self.turned.bias_rad_s

    @property
    def covariance(self) -> Array:
        """The covariance (6, 6) of scale and bias, by this session and its clock."""
        return self.turned.covariance


def solve_by_hand(session: Handled, told: Told) -> HandSolution:
    """The solution of a session.

    Raises Fault `too_few_moves`, `clipping`, `lost_in_move`, `held_not_laid_down`, `turn_not_closed`, `not_flat`,
    `table_moved`, `bias_jumped`, `wrong_face`, `mirrored_axis`, `swapped_axes`, `wrong_unit`, `no_fit`, `zero_reading`,
    `too_many_moves`; Refused `first_face_not_told`.
    """
    if len(session.rests) < 2:
        raise too_few(session, None)
    if 2 * sum(move.lost or move.clipped for move in session.moves) > len(session.moves):
        raise too_few(session, None)
    if len(session.rests) > MOST_RESTS:
        what = f"there are {len(session.rests)} rests; no more than {MOST_RESTS} are solved together"
        raise Fault("too_many_moves", what, "Give the recording in pieces")
    if session.acceleration is not None:
        refusals.check_signal(np.array([rest.acceleration_m_s2 for rest in session.rests]))
    check_axes(session)
    found: Fit | None = None
    try:
        found = fit(session, told)
        if rows := crept(found):
            session = without_crept(session, rows)
            found = fit(session, told)
        fault = _too_little(found) or doubted(found)
    except Fault as error:
        fault = error if all(move.tells for move in session.moves) else too_few(session, None)
    other = None
    if found is None or _looseness(found) > LOOSE:
        other = _another_face(session, told, None if fault is not None else found)
    if (reason := other or fault) is not None or found is None:
        raise reason or too_few(session, None)
    refusals.check_unit(scale_of(found.state.matrix))
    refusals.check_handedness(found.state.matrix)
    one = hidden(found)
    return solution_of(found, () if one is None else (f"{one.what}: for this one alone U is larger",))


def solution_of(fit: Fit, warnings: tuple[str, ...] = ()) -> HandSolution:
    """The solution of a graph that has come to rest, with what else was found to warn of."""
    matrix, told = fit.state.matrix, fit.told
    axes = SensorAxes.of(matrix)
    chosen = sought(fit)
    covariance = fit.covariance[np.ix_(chosen, chosen)]
    to_parameters = parameter_jacobian(matrix, axes.scale)
    clock = np.zeros((6, 6))
    clock[:3, :3] = np.outer(axes.scale, axes.scale) * (1e-6 * told.clock_ppm) ** 2 / 3
    of_session = to_parameters @ covariance @ to_parameters.T + clock
    design, _ = white(fit.factors)
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
        widened=max(1.0, fit.sizes.repeat_rad / STATED.repeat_rad),
        widened_freedom=np.inf,
        budget=_budget(fit, to_parameters, clock),
        observations=len(fit.session.rests) + sum(move.tells for move in fit.session.moves),
        rank=12,
        condition=float(np.sqrt(np.linalg.cond(conditioned[:, chosen].T @ conditioned[:, chosen]))),
        iterations=fit.iterations,
        warnings=(*_warnings(fit), *warnings),
        estimator="by_hand",
    )
    return HandSolution(
        turned=turned,
        rests=tuple(RestFound(face, _pull(fit, row)) for row, face in enumerate(fit.faced.faces)),
        moves=tuple(_move_found(fit, row) for row in range(len(fit.session.moves))),
        sizes={
            name: (getattr(fit.sizes, name), getattr(STATED, name), getattr(LARGEST, name))
            for name in fit.sizes.__slots__
            if name != "acceleration_m_s2" or fit.session.acceleration is not None
        },
        chi_square=fit.chi_square,
        freedom=fit.freedom,
        expanded_scale=2 * np.sqrt(np.diag(of_session)[:3]),
        crept=fit.session.crept,
    )


def sought(fit: Fit) -> NDArray[np.intp]:
    """(12,) the places of F and of the last rest's bias among all that is found."""
    count = fit.covariance.shape[0]
    return np.asarray(np.r_[0:9, count - 3 : count])


def too_few(session: Handled, expanded: Array | None) -> Fault:
    """Why nothing is told yet: by what went wrong, else that there is too little of it."""
    clipped, lost = (sum(getattr(move, each) for move in session.moves) for each in ("clipped", "lost"))
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
    if session.held:
        start_s, end_s = session.held[0]
        return Fault(
            "held_not_laid_down",
            f"from {start_s:.1f} to {end_s:.1f} s the body was held still, not laid down"
            + (f", and {len(session.held) - 1} times more" if len(session.held) > 1 else ""),
            "Lay it down and let go, for a second, after every move",
        )
    so_far = "" if expanded is None else f"; the scale is known to {100 * expanded.max():.1g} %"
    if session.crept:
        so_far += f"; {len(session.crept)} more are left out, for the body crept from {session.crept[0][0]:.1f} s on"
    return Fault(
        "too_few_moves",
        f"there are {len(session.rests)} rests and {sum(move.tells for move in session.moves)} moves{so_far}",
        "Lay it on all six faces, eight moves at least, with a second of rest after each",
    )


def _too_little(fit: Fit) -> Fault | None:
    expanded = 2 * np.sqrt(np.diag(fit.covariance)[[0, 4, 8]])
    return too_few(fit.session, expanded) if expanded.max() > ENOUGH else None


def _looseness(fit: Fit) -> float:
    """How many times as large as stated what holds faces and moves together was found to be."""
    sizes = fit.sizes
    return max(sizes.repeat_rad / STATED.repeat_rad, sizes.of_angle / STATED.of_angle)


def _another_face(session: Handled, told: Told, but: Fit | None) -> Fault | None:
    """The Fault that the body lay otherwise at first, where with another face all is well."""
    if session.acceleration is not None or told.first_face is None:
        return None
    for face in (each for each in FACES if each != told.first_face):
        try:
            found = fit(session, replace(told, first_face=face))
        except Fault:
            continue
        better = but is None or _looseness(found) < _looseness(but) / 2
        if better and _too_little(found) is None and doubted(found) is None:
            return Fault(
                "wrong_face",
                f"the body did not begin with {told.first_face} upwards: its moves are those from {face}",
                f"Say --first-face {face}, or look again which axis is which",
            )
    return None


def _budget(fit: Fit, to_parameters: Array, clock: Array) -> Budget:
    chosen = sought(fit)
    spread = {name: np.zeros((6, 6)) for name in LINES}
    line_of = {cause: name for name, (_, causes, _) in LINES.items() for cause in causes}
    for row in fit.factors:
        gain = to_parameters @ fit.covariance[chosen] @ (row.design / row.std[:, None] ** 2).T
        for cause, std in row.causes.items():
            effect = gain * std
            spread[line_of[cause]] += effect @ effect.T
    samples = float(sum(rest.samples for rest in fit.session.rests))
    freedom = {"noise": samples, "placement": fit.freedom + SEEN, "bias from rest to rest": fit.freedom + SEEN}
    freedom["angles of the moves"] = fit.freedom + SEEN
    lines = [
        Contributor(name, kind, "normal", None, "", source, freedom.get(name, np.inf), spread[name])
        for name, (kind, _, source) in LINES.items()
    ]
    ppm, source = fit.told.clock_ppm, fit.told.clock_source
    lines.append(Contributor(CLOCK, "B", "rectangular", ppm, "ppm", source, np.inf, clock))
    real = np.diag([*(REAL_HANDS * scale_of(fit.state.matrix)) ** 2, 0.0, 0.0, 0.0])
    source = "by how much recordings of hands elsewhere disagree with themselves"
    lines.append(Contributor(RECORDED_HANDS, "B", "normal", None, "", source, np.inf, real))
    return Budget(tuple(lines))


def _pull(fit: Fit, at: int, kinds: Sequence[str] = ("flat", "acceleration")) -> float:
    rows = [row for row in fit.factors if row.at == at and row.kind in kinds]
    return max((_pull_of(fit, row) for row in rows), default=0.0)


def _pull_of(fit: Fit, row: Factor) -> float:
    return float(np.max(np.abs(row.missed) / (row.std * np.sqrt(np.maximum(fit.freedom_of(row), 0.05)))))


def _move_found(fit: Fit, row: int) -> MoveFound:
    move, turns = fit.session.moves[row], fit.faced.turns[row]
    closure = next((each for each in fit.factors if each.kind == CLOSURE and each.at == row), None)
    return MoveFound(
        kind="omitted" if not move.tells else "turn" if turns else "flip",
        angle_rad=float(np.linalg.norm(np.linalg.solve(fit.state.matrix, fit.moved.swept_rad[row]))),
        turns=turns,
        pull=_pull(fit, row, (MOVE, CLOSURE)),
        closure_rad=None if closure is None else float(closure.missed[0]),
    )


def _warnings(fit: Fit) -> tuple[str, ...]:
    said = []
    for words, each in (("at the end of its range", "clipped"), ("with readings missing", "lost")):
        if starts := [move.start_s for move in fit.session.moves if getattr(move, each)]:
            at_s = ", ".join(f"{start_s:.1f}" for start_s in starts)
            said.append(f"moves left out, the gyroscope {words}: from {at_s} s")
    return tuple(said)

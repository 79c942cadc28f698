"""A session by hand in `result.json` and at the terminal."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from rig.data.entries.by_hand import ByHandEntry, HandErrorEntry, MoveByHandEntry, RestByHandEntry
from rig.report.entry import entry

if TYPE_CHECKING:
    from rig.estimation.by_hand import HandSolution

WORDS = {
    "face_repeatability_rad": "repeatability of faces {:.2f} mrad",
    "closure_error_rad": "closure error of turns {:.1f} mrad",
    "angle_fraction": "angle error of moves {:.3f} % of a quarter turn",
    "bias_random_walk_rad_s_sqrt_s": "random walk of the bias {:.1e} rad/s/√s",
    "level_m_s2": "level error of the accelerometer {:.4f} m/s²",
}
# Errors of handling: names of the solution → names of `result.json`.
PUBLIC_NAMES = {
    "repeat_rad": "face_repeatability_rad",
    "closure_rad": "closure_error_rad",
    "of_angle": "angle_fraction",
    "walk_rad_s_sqrt_s": "bias_random_walk_rad_s_sqrt_s",
    "acceleration_m_s2": "level_m_s2",
}
UNITS = {"face_repeatability_rad": 1e3, "closure_error_rad": 1e3, "angle_fraction": 1e2}


def hand_entry(solution: "HandSolution") -> ByHandEntry:
    """Return the entry of the solution of a session by hand."""
    return ByHandEntry(
        rests=tuple(entry(RestByHandEntry, rest) for rest in solution.rests),
        moves=tuple(entry(MoveByHandEntry, move) for move in solution.moves),
        errors=tuple(
            HandErrorEntry(name=PUBLIC_NAMES[name], estimate=size, stated=stated, limit=limit)
            for name, (size, stated, limit) in solution.stds.items()
        ),
        chi_square=solution.chi_square,
        degrees_of_freedom=solution.dof,
        session_std=tuple(np.sqrt(np.diag(solution.covariance))[:3].tolist()),
    )


def hand_lines(entry: ByHandEntry) -> Iterator[str]:
    """Yield lines on the faces, the moves, and the estimated errors of a session by hand."""
    flips, turns = (sum(move.kind == kind for move in entry.moves) for kind in ("flip", "turn"))
    faces = " ".join(rest.face or "(none)" for rest in entry.rests)
    yield f"by hand: {len(entry.rests)} rests, {flips} flips, {turns} turns; faces upwards: {faces}"
    for number, move in enumerate(entry.moves, 1):
        if move.closure_error_rad is not None:
            closure = f"{1e3 * move.closure_error_rad:+.1f} mrad closure error"
            yield f"move {number}: {move.turns:+d} turns, {np.degrees(move.angle_rad):.2f}°, {closure}"
    estimates = {size.name: size for size in entry.errors}
    used = {"closure_error_rad": any(move.closure_error_rad is not None for move in entry.moves)}
    phrases = [
        WORDS[name].format(UNITS.get(name, 1.0) * estimates[name].estimate)
        for name in WORDS  # a name that a later version adds has no words here
        if name in estimates and used.get(name, True)
    ]
    yield f"estimated errors of handling (one standard deviation): {'; '.join(phrases)}"
    worst = max(
        [*(rest.normalised_residual for rest in entry.rests), *(move.normalised_residual for move in entry.moves)],
        default=0.0,
    )
    reduced = entry.chi_square / max(entry.degrees_of_freedom, 1.0)
    yield f"χ²/dof {reduced:.2f}, the largest normalised residual {worst:.1f}"
    expanded_scale = ", ".join(f"{2 * std:.1e}" for std in entry.session_std)
    yield (
        f"U of k by this session and its clock alone: {expanded_scale}; the U of the table includes the scatter "
        "between repeated sessions by hand. Only another clock shows an error of this clock"
    )

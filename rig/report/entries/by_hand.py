"""What `result.json` and the terminal say of a session by hand."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from rig.data.entries.by_hand import ByHandEntry, HandErrorEntry, MoveByHandEntry, RestByHandEntry
from rig.report.entry import entry

if TYPE_CHECKING:
    from rig.estimation.by_hand import HandSolution

WORDS = {
    "face_repeatability_rad": "faces that are laid down again lie otherwise by {:.2f} mrad",
    "closure_error_rad": "turns miss where they began by {:.1f} mrad",
    "angle_fraction": "moves differ by {:.3f} % of a quarter turn",
    "bias_random_walk_rad_s_sqrt_s": "the bias walks by {:.1e} rad/s/√s",
    "level_m_s2": "the accelerometer's level is off by {:.4f} m/s²",
}
# What the solution calls the errors of a hand, and `result.json`.
PUBLIC_NAMES = {
    "repeat_rad": "face_repeatability_rad",
    "closure_rad": "closure_error_rad",
    "of_angle": "angle_fraction",
    "walk_rad_s_sqrt_s": "bias_random_walk_rad_s_sqrt_s",
    "acceleration_m_s2": "level_m_s2",
}
UNITS = {"face_repeatability_rad": 1e3, "closure_error_rad": 1e3, "angle_fraction": 1e2}


def by_hand_entry(solution: "HandSolution") -> ByHandEntry:
    """The entry of a solution."""
    return ByHandEntry(
        rests=tuple(entry(RestByHandEntry, each) for each in solution.rests),
        moves=tuple(entry(MoveByHandEntry, each) for each in solution.moves),
        errors=tuple(
            HandErrorEntry(name=PUBLIC_NAMES[name], estimate=size, stated=stated, limit=limit)
            for name, (size, stated, limit) in solution.stds.items()
        ),
        chi_square=solution.chi_square,
        degrees_of_freedom=solution.freedom,
        session_std=tuple(np.sqrt(np.diag(solution.covariance))[:3].tolist()),
    )


def by_hand_lines(entry: ByHandEntry) -> Iterator[str]:
    """Faces, moves and sizes, in words."""
    flips, turns = (sum(each.kind == kind for each in entry.moves) for kind in ("flip", "turn"))
    faces = " ".join(rest.face or "(none)" for rest in entry.rests)
    yield f"by hand: {len(entry.rests)} rests, {flips} flips, {turns} turns; faces upwards: {faces}"
    for number, move in enumerate(entry.moves, 1):
        if move.closure_error_rad is not None:
            closure = f"{1e3 * move.closure_error_rad:+.1f} mrad off where it began"
            yield f"move {number}: {move.turns:+d} turns, {np.degrees(move.angle_rad):.2f}°, {closure}"
    there = {size.name: size for size in entry.errors}
    used = {"closure_error_rad": any(move.closure_error_rad is not None for move in entry.moves)}
    said = [
        WORDS[name].format(UNITS.get(name, 1.0) * there[name].estimate)
        for name in WORDS  # what a later version may add has no words here
        if name in there and used.get(name, True)
    ]
    yield f"as found (one standard deviation): {'; '.join(said)}"
    worst = max(
        [*(each.normalised_residual for each in entry.rests), *(each.normalised_residual for each in entry.moves)],
        default=0.0,
    )
    yield f"χ²/dof {entry.chi_square / max(entry.degrees_of_freedom, 1.0):.2f}, the largest pull {worst:.1f}"
    known = ", ".join(f"{2 * std:.1e}" for std in entry.session_std)
    yield (
        f"U of k by this session and its clock alone: {known}; the table has beside it how real hands' recordings "
        "disagree with themselves. Nothing shows an error of the clock but another clock"
    )

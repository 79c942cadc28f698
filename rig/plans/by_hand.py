"""The wanted moves of a calibration by hand, and the next move to request. Pure functions.

Twelve flips over all six faces determine scale factors and angles between axes best in a given time; whole turns are a
check that needs no flat table. The order does not matter: the next request follows from the item's face and past moves.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from rig.config.procedures.hand_sections import ByHandSection, HandSection
from rig.motion.by_hand import FACES, Face, HandMove, Instruction
from rig.motion.steps import Plan
from rig.motion.turner_state import Joints

# The faces in the order in which they point up, beginning with the one at the start.
FACE_ORDER: tuple[Face, ...] = ("+z", "+x", "+y", "-z", "-x", "-y", "+z", "+y", "-x", "-z", "+x", "-y")
MIN_FLIPS_BEFORE_TURNS = 8  # the scale factor is then known well enough to recognise the end of a whole turn
TURN_AXES = ("z", "x", "y")  # of the requested whole turns, in this order

Pair = tuple[Face, Face]


def plan_by_hand(
    turner: HandSection, procedure: ByHandSection, start_q_rad: Joints | None = None, done: Collection[int] = ()
) -> Plan:
    """Return a plan without steps, because the moves of a session by hand are requested during it."""
    return Plan((), (), ())


@dataclass(frozen=True, slots=True)
class WantedMoves:
    """The moves wanted in a session: the numbers of flips between faces and of whole turns."""

    flips: int
    turns: int

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The flips in the order of the requests, if the operator makes no other move between them."""
        count = len(FACE_ORDER)
        return tuple((FACE_ORDER[index % count], FACE_ORDER[(index + 1) % count]) for index in range(self.flips))

    @property
    def about(self) -> tuple[tuple[str, int], ...]:
        """The whole turns: axis and direction, +1 or -1; a second turn about an axis has the opposite direction."""
        return tuple((TURN_AXES[index % 3], -1 if index // 3 % 2 else 1) for index in range(self.turns))


@dataclass(frozen=True, slots=True)
class RemainingMoves:
    """The moves that a session still lacks; `flips_done`: the number of flips that were made."""

    pairs: tuple[Pair, ...]
    turns: tuple[tuple[str, int], ...]
    faces: tuple[Face, ...]
    flips: int
    flips_done: int

    @property
    def done(self) -> bool:
        """Whether the session has all turns, and all wanted flips or as many other flips over all six faces."""
        return not self.turns and (not self.pairs or (self.flips == 0 and not self.faces))


def still_open(wanted: WantedMoves, moves: Sequence[HandMove], faces_up: Sequence[Face]) -> RemainingMoves:
    """Return the `wanted` moves that remain after `moves`; `faces_up` are the faces that were up at rest."""
    pairs, turns, flips = list(wanted.pairs), list(wanted.about), wanted.flips
    for move in moves:
        if move.kind == "flip":
            flips -= 1
            faces_of_move = {move.from_face, move.to_face}
            if (pair := next((candidate for candidate in pairs if set(candidate) == faces_of_move), None)) is not None:
                pairs.remove(pair)
            continue
        axis = move.from_face[1] if move.turns else ""
        if (turn := next((candidate for candidate in turns if candidate[0] == axis), None)) is not None:
            turns.remove(turn)
    faces = tuple(face for face in FACES if face not in faces_up)
    return RemainingMoves(tuple(pairs), tuple(turns), faces, max(flips, 0), wanted.flips - flips)


def next_instruction(remaining: RemainingMoves, face: Face | None) -> Instruction | None:
    """Return the next request for an item with side `face` up (None if unknown), or None if no move remains."""
    if remaining.done or face is None:
        return None if remaining.done else Instruction("lay", FACE_ORDER[0])
    turn = next((candidate for candidate in remaining.turns if candidate[0] == face[1]), None)
    if turn is not None and remaining.flips_done >= MIN_FLIPS_BEFORE_TURNS:
        return Instruction("turn", face, turn[1])
    if (pair := next((candidate for candidate in remaining.pairs if face in candidate), None)) is not None:
        return Instruction("lay", pair[1] if pair[0] == face else pair[0])
    firsts = [pair[0] for pair in remaining.pairs]
    return Instruction(
        "lay", next(iter([*firsts, *remaining.faces, *(_positive_side(axis) for axis, _ in remaining.turns)]))
    )


def simulate_session(wanted: WantedMoves) -> Iterator[Instruction]:
    """Yield the requests to an operator who follows all of them and begins with +z up."""
    moves, faces_up = list[HandMove](), list[Face](["+z"])
    while (instruction := next_instruction(still_open(wanted, moves, faces_up), faces_up[-1])) is not None:
        yield instruction
        flip = instruction.say == "lay"
        moves.append(HandMove("flip" if flip else "turn", faces_up[-1], instruction.face, instruction.turns))
        faces_up.append(instruction.face)


def _positive_side(axis: str) -> Face:
    """Return the side of the item in the positive direction of an axis."""
    return next(face for face in FACES if face == f"+{axis}")

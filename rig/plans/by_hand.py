"""Which moves of a hand a calibration still wants, and which is asked for next. Pure.

Twelve flips over all six faces tell scale factors and right angles best for the time they take, and whole turns are a
check that needs no flat table. Any order does: what is asked next follows from how the item lies and what was taken.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from rig.config.procedures.hand_sections import ByHandSection, HandSection
from rig.motion.by_hand import FACES, Face, HandMove, Instruction
from rig.motion.state import Joints
from rig.motion.steps import Plan

ROUND: tuple[Face, ...] = ("+z", "+x", "+y", "-z", "-x", "-y", "+z", "+y", "-x", "-z", "+x", "-y")  # and from the start
TURNS_FROM = 8  # flips: from then on the scale is known so well that a turn shows where it ends
AXES = ("z", "x", "y")  # about which whole turns are asked, one after the other

Pair = tuple[Face, Face]


def plan_by_hand(
    turner: HandSection, procedure: ByHandSection, start_q_rad: Joints | None = None, done: Collection[int] = ()
) -> Plan:
    """No step: what a hand does is asked for as it goes on, and no joint moves."""
    return Plan((), (), ())


@dataclass(frozen=True, slots=True)
class Wanted:
    """The list of a session: so many flips between faces, so many whole turns."""

    flips: int
    turns: int

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The flips in the order in which they are asked for, when nothing comes between."""
        count = len(ROUND)
        return tuple((ROUND[place % count], ROUND[(place + 1) % count]) for place in range(self.flips))

    @property
    def about(self) -> tuple[tuple[str, int], ...]:
        """The whole turns: about which axis, in which direction, +1 or -1; a second one about an axis goes back."""
        return tuple((AXES[place % 3], -1 if place // 3 % 2 else 1) for place in range(self.turns))


@dataclass(frozen=True, slots=True)
class Open:
    """What of a list was not made yet; `made` counts the flips that were."""

    pairs: tuple[Pair, ...]
    turns: tuple[tuple[str, int], ...]
    faces: tuple[Face, ...]
    flips: int
    made: int

    @property
    def done(self) -> bool:
        """Whether all is made: the flips of the list, or as many others, over all six faces."""
        return not self.turns and (not self.pairs or (self.flips == 0 and not self.faces))


def still_open(wanted: Wanted, taken: Sequence[HandMove], seen: Sequence[Face]) -> Open:
    """What a list still wants after moves that were `taken`; `seen` are the faces that lay up at rest."""
    pairs, turns, flips = list(wanted.pairs), list(wanted.about), wanted.flips
    for move in taken:
        if move.kind == "flip":
            flips -= 1
            made = {move.from_face, move.to_face}
            if (pair := next((each for each in pairs if set(each) == made), None)) is not None:
                pairs.remove(pair)
            continue
        axis = move.from_face[1] if move.turns else ""
        if (turn := next((each for each in turns if each[0] == axis), None)) is not None:
            turns.remove(turn)
    faces = tuple(face for face in FACES if face not in seen)
    return Open(tuple(pairs), tuple(turns), faces, max(flips, 0), wanted.flips - flips)


def asked_next(left: Open, face: Face | None) -> Instruction | None:
    """What is asked for next of an item that lies with that side up, None where nobody knows; None when all is made."""
    if left.done or face is None:
        return None if left.done else Instruction("lay", ROUND[0])
    turn = next((each for each in left.turns if each[0] == face[1]), None)
    if turn is not None and left.made >= TURNS_FROM:
        return Instruction("turn", face, turn[1])
    if (pair := next((each for each in left.pairs if face in each), None)) is not None:
        return Instruction("lay", pair[1] if pair[0] == face else pair[0])
    firsts = [pair[0] for pair in left.pairs]
    return Instruction("lay", next(iter([*firsts, *left.faces, *(_side(axis) for axis, _ in left.turns)])))


def listed(wanted: Wanted) -> Iterator[Instruction]:
    """What is asked for, one after the other, of somebody who does it and begins with +z up."""
    taken, seen = list[HandMove](), list[Face](["+z"])
    while (asked := asked_next(still_open(wanted, taken, seen), seen[-1])) is not None:
        yield asked
        flip = asked.say == "lay"
        taken.append(HandMove("flip" if flip else "turn", seen[-1], asked.face, asked.turns))
        seen.append(asked.face)


def _side(axis: str) -> Face:
    """The positive side of an axis."""
    return next(face for face in FACES if face == f"+{axis}")

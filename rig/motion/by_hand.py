"""Instructions to turn an item on a table by hand: the side that comes up, or whole turns on one side. Pure functions.

A face is named by the item's axis that points upwards when that side is up: "+x", "-x", "+y", "-y", "+z", "-z".
"""

from dataclasses import dataclass
from typing import Literal

Face = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
FACES: tuple[Face, ...] = ("+z", "+x", "+y", "-z", "-x", "-y")
Say = Literal["lay", "turn"]


@dataclass(frozen=True, slots=True)
class Instruction:
    """One action of the operator.

    "lay": put the item down with the side `face` up. "turn": with the side `face` up, turn the item by whole `turns`
    about the vertical, counterclockwise from above if positive, and release it in its first position.
    """

    say: Say
    face: Face
    turns: int = 0

    @property
    def words(self) -> str:
        """The request to the operator in one line."""
        if self.say == "lay":
            return f"Lay it down with the side {self.face} up, and let go"
        count = "one whole turn" if abs(self.turns) == 1 else f"{abs(self.turns)} whole turns"
        sense = "counterclockwise" if self.turns > 0 else "clockwise"
        return f"Leave the side {self.face} up and turn it {count} {sense} on the table, back against the rule; let go"


@dataclass(frozen=True, slots=True)
class HandMove:
    """A recorded move: a flip from one face to another, or whole turns on one face."""

    kind: Literal["flip", "turn"]
    from_face: Face
    to_face: Face
    turns: int = 0

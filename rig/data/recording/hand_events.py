"""The events of a calibration by hand in its recording. Times are the board's, in microseconds."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from rig.motion.by_hand import Face, Instruction

Microseconds = Annotated[int, Field(ge=0, le=2**63 - 1)]
Reason = Annotated[str, Field(pattern=r"^[a-z_0-9]+$", max_length=40)]


@dataclass(frozen=True, slots=True)
class HandAsked:
    """A request to the operator; if the last move was refused, `again` names the error and `why` describes it."""

    instruction: Instruction
    again: Reason | None = None
    why: Annotated[str, Field(max_length=500)] = ""


@dataclass(frozen=True, slots=True)
class HandRested:
    """A rest of the item with the side `face` up."""

    begin_us: Microseconds
    end_us: Microseconds
    face: Face


@dataclass(frozen=True, slots=True)
class HandMoveAccepted:
    """An accepted move between two rests: a flip, or whole turns on a face."""

    begin_us: Microseconds
    end_us: Microseconds
    kind: Literal["flip", "turn"]
    from_face: Face
    to_face: Face
    turns: Annotated[int, Field(ge=-1000, le=1000)]


@dataclass(frozen=True, slots=True)
class HandMoveRefused:
    """A refused move between two valid rests; `again` is the error's name."""

    begin_us: Microseconds
    end_us: Microseconds
    again: Reason


@dataclass(frozen=True, slots=True)
class HandRestRefused:
    """A refused rest, which becomes a pause of a move; `again` is the error's name."""

    begin_us: Microseconds
    end_us: Microseconds
    again: Reason


@dataclass(frozen=True, slots=True)
class HandBegunAnew:
    """A restart that discards everything before `begin_us`; `again` names its cause, such as a table that moved."""

    begin_us: Microseconds
    again: Reason


HandEvent = HandAsked | HandRested | HandMoveAccepted | HandMoveRefused | HandRestRefused | HandBegunAnew

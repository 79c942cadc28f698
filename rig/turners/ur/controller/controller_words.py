"""What the controller says to everybody at its primary interface: errors by their code, what ended a program. Pure.

(Client interface description of the maker: a robot message holds a time stamp, a source and its kind; of an error
code, kind 6, code, argument, level, a type and a value follow, of a runtime exception, kind 10, line and column, of a
key message, kind 7, code, argument and a title; then a text.)
"""

import struct
from dataclasses import dataclass

from rig.errors.quoting import printable
from rig.turners.ur.controller.primary import MESSAGE

ERROR_CODE, KEY, EXCEPTION = 6, 7, 10
ERROR = struct.Struct(">iiiII")  # code, argument, level, type of the value, value
PLACE = struct.Struct(">ii")  # line, column
TITLED = struct.Struct(">iiB")  # code, argument, length of the title that follows
STOPPED = b"PROGRAM_XXX_STOPPED"
READ_ONLY = 210  # the answer to a line of script in local control
TEXT = 160  # characters of one message


@dataclass(frozen=True, slots=True)
class ErrorCode:
    """An error as the pendant shows it, `C210A0`; `text` may be empty."""

    code: int
    argument: int
    text: str

    @property
    def words(self) -> str:
        """The error in the controller's own words."""
        return " ".join(filter(None, (f"C{self.code}A{self.argument}", self.text)))


@dataclass(frozen=True, slots=True)
class ProgramException:
    """Why the controller ended a program."""

    text: str


@dataclass(frozen=True, slots=True)
class ProgramStopped:
    """A program of that name has ended, for whatever reason."""

    program: str


def words_in(message: bytes) -> ErrorCode | ProgramException | ProgramStopped | None:
    """What a robot message says; None for one that is none of these, or is cut short."""
    if len(message) < MESSAGE.size:
        return None
    kind, rest = MESSAGE.unpack_from(message)[2], message[MESSAGE.size :]
    if kind == ERROR_CODE and len(rest) >= ERROR.size:
        code, argument, *_ = ERROR.unpack_from(rest)
        return ErrorCode(code, argument, _text(rest[ERROR.size :]))
    if kind == KEY and len(rest) >= TITLED.size:
        title, text = rest[TITLED.size :][: rest[TITLED.size - 1]], rest[TITLED.size + rest[TITLED.size - 1] :]
        return ProgramStopped(_text(text)) if title == STOPPED else None
    if kind == EXCEPTION and len(rest) >= PLACE.size:
        return ProgramException(_text(rest[PLACE.size :]))
    return None


def _text(told: bytes) -> str:
    return printable(told.decode(errors="replace").strip())[:TEXT]

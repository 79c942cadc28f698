"""Messages of the controller's primary interface, in words: errors by their code, and ends of programs. Pure.

Source: the maker's client interface description. A robot message holds a time stamp, a source and its kind. An error
code (kind 6) continues with code, argument, level, a type and a value. A runtime exception (kind 10) continues with
line and column, a key message (kind 7) with code, argument and a title. Each ends with a text.
"""

import struct
from dataclasses import dataclass

from rig.errors.quoting import printable
from rig.turners.ur.controller.primary_interface import MESSAGE

ERROR_CODE, KEY, EXCEPTION = 6, 7, 10
ERROR = struct.Struct(">iiiII")  # code, argument, level, type of the value, value
POSITION = struct.Struct(">ii")  # line, column
TITLED = struct.Struct(">iiB")  # code, argument, length of the title that follows
STOPPED_TITLE = b"PROGRAM_XXX_STOPPED"
READ_ONLY_ERROR = 210  # the answer to a line of script in local control
MAX_CHARACTERS = 160  # of one message


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
    """The controller's reason for ending a program."""

    text: str


@dataclass(frozen=True, slots=True)
class ProgramStopped:
    """The end of the named program, for any reason."""

    program: str


def decode_message(message: bytes) -> ErrorCode | ProgramException | ProgramStopped | None:
    """Decode a robot message; return None for a message of another kind, or an incomplete one."""
    if len(message) < MESSAGE.size:
        return None
    kind, rest = MESSAGE.unpack_from(message)[2], message[MESSAGE.size :]
    if kind == ERROR_CODE and len(rest) >= ERROR.size:
        code, argument, *_ = ERROR.unpack_from(rest)
        return ErrorCode(code, argument, _text(rest[ERROR.size :]))
    if kind == KEY and len(rest) >= TITLED.size:
        title, text = rest[TITLED.size :][: rest[TITLED.size - 1]], rest[TITLED.size + rest[TITLED.size - 1] :]
        return ProgramStopped(_text(text)) if title == STOPPED_TITLE else None
    if kind == EXCEPTION and len(rest) >= POSITION.size:
        return ProgramException(_text(rest[POSITION.size :]))
    return None


def _text(data: bytes) -> str:
    return printable(data.decode(errors="replace").strip())[:MAX_CHARACTERS]

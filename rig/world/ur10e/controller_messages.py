"""The controller's messages to its clients: texts, programs started and stopped, errors, exceptions of programs."""

from collections import deque
from dataclasses import dataclass
from enum import IntEnum

KEPT_MESSAGES = 200
MAX_CHARACTERS = 4000  # of a message


class MessageKind(IntEnum):
    """Kinds of robot messages, as the primary interface numbers them."""

    TEXT = 0
    SAFETY_MODE = 5
    ERROR_CODE = 6
    KEY = 7
    EXCEPTION = 10


class ReportLevel(IntEnum):
    """Severities of an error."""

    INFO = 1
    WARNING = 2
    VIOLATION = 3


@dataclass(frozen=True, slots=True)
class ErrorReport:
    """An error of the controller, which the pendant shows as C code A argument, such as `C100A7`.

    The maker's client library lists the codes and arguments (error_code_texts.h); `level` is the severity.
    """

    code: int
    argument: int
    level: ReportLevel


MODE_CHANGED = 100  # the argument is the mode
# Assumptions: the levels, and that a line out of reach is an invalid setpoint (the maker's tests expect an error).
INVALID_SETPOINT = ErrorReport(204, 5, ReportLevel.VIOLATION)
STOPPED_FOR_TEST = ErrorReport(209, 0, ReportLevel.VIOLATION)
READ_ONLY = ErrorReport(210, 0, ReportLevel.WARNING)  # sent by the socket in local control


@dataclass(frozen=True, slots=True)
class Message:
    """A message to all clients. `position`: line and column of the program, for an exception.

    For a change of the safety mode, `text` is the name of the new mode.
    """

    number: int
    kind: MessageKind
    text: str
    title: str = ""
    position: tuple[int, int] = (0, 0)
    error: ErrorReport | None = None


class ProgramError(Exception):
    """An error for which the controller stops a program with a pop-up. `position`: line and column, if known."""

    def __init__(self, text: str, position: tuple[int, int] = (0, 0)) -> None:
        super().__init__(text)
        self.position = position


class OutOfReach(ProgramError):
    """An error of a straight line to a pose out of reach, which the controller answers with a protective stop."""


class Messages:
    """The controller's newest messages, numbered."""

    def __init__(self) -> None:
        self._messages: deque[Message] = deque(maxlen=KEPT_MESSAGES)
        self.last = 0  # number of the newest message

    def say(
        self, text: str, kind: MessageKind = MessageKind.TEXT, title: str = "", position: tuple[int, int] = (0, 0)
    ) -> None:
        self._add(Message(self.last + 1, kind, text[:MAX_CHARACTERS], title, position))

    def report(self, error: ErrorReport) -> None:
        """Add an error by its code."""
        self._add(Message(self.last + 1, MessageKind.ERROR_CODE, "", error=error))

    def complain(self, error: ProgramError) -> None:
        """Add a message about the exception of a program."""
        self.say(str(error), MessageKind.EXCEPTION, position=error.position)

    def _add(self, message: Message) -> None:
        self.last = message.number
        self._messages.append(message)

    def after(self, number: int) -> list[Message]:
        """Return the messages after number `number`; 0 selects all messages."""
        return [message for message in self._messages if message.number > number] if self.last > number else []

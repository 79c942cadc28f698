"""What the controller tells everybody who listens: texts, programs started and stopped, errors, programs' faults."""

from collections import deque
from dataclasses import dataclass
from enum import IntEnum

KEPT = 200
TEXT_MAX = 4000  # characters of one


class MessageKind(IntEnum):
    """Kinds of robot messages, as the primary interface numbers them."""

    TEXT = 0
    SAFETY_MODE = 5
    ERROR_CODE = 6
    KEY = 7
    EXCEPTION = 10


class ReportLevel(IntEnum):
    """How bad an error is."""

    INFO = 1
    WARNING = 2
    VIOLATION = 3


@dataclass(frozen=True, slots=True)
class ErrorReport:
    """What the pendant shows as `C100A7`: code and argument (error_code_texts.h of the maker's client library)."""

    code: int
    argument: int
    level: ReportLevel


MODE_CHANGED = 100  # the argument is the mode
# The levels are assumed, and that a line out of reach is an invalid setpoint: the maker's tests want an error there.
INVALID_SETPOINT = ErrorReport(204, 5, ReportLevel.VIOLATION)
STOPPED_FOR_TEST = ErrorReport(209, 0, ReportLevel.VIOLATION)
READ_ONLY = ErrorReport(210, 0, ReportLevel.WARNING)  # the socket, in local control


@dataclass(frozen=True, slots=True)
class Message:
    """Something the controller tells everybody. `place`: line and column of the program, for an exception.

    Of a change of the safety mode the text is the mode's name.
    """

    number: int
    kind: MessageKind
    text: str
    title: str = ""
    place: tuple[int, int] = (0, 0)
    error: ErrorReport | None = None


class ProgramError(Exception):
    """A program did what the controller answers with a pop-up: it stops. `place`: line and column, if known."""

    def __init__(self, text: str, place: tuple[int, int] = (0, 0)) -> None:
        super().__init__(text)
        self.place = place


class OutOfReach(ProgramError):
    """A straight line led to where the arm cannot be: the controller answers with a protective stop."""


class Messages:
    """The newest messages, numbered."""

    def __init__(self) -> None:
        self._messages: deque[Message] = deque(maxlen=KEPT)
        self.last = 0  # number of the newest

    def say(
        self, text: str, kind: MessageKind = MessageKind.TEXT, title: str = "", place: tuple[int, int] = (0, 0)
    ) -> None:
        self._keep(Message(self.last + 1, kind, text[:TEXT_MAX], title, place))

    def report(self, error: ErrorReport) -> None:
        """Say an error by its code."""
        self._keep(Message(self.last + 1, MessageKind.ERROR_CODE, "", error=error))

    def complain(self, error: ProgramError) -> None:
        """Say what a program did wrong."""
        self.say(str(error), MessageKind.EXCEPTION, place=error.place)

    def _keep(self, message: Message) -> None:
        self.last = message.number
        self._messages.append(message)

    def after(self, number: int) -> list[Message]:
        """What has been said since the message `number`; since ever with 0."""
        return [message for message in self._messages if message.number > number] if self.last > number else []

"""What the controller tells everybody who listens: texts, programs started and stopped, what a program did wrong."""

from collections import deque
from dataclasses import dataclass
from enum import IntEnum

KEPT = 200
TEXT_MAX = 4000  # characters of one


class MessageKind(IntEnum):
    """Kinds of robot messages, as the primary interface numbers them."""

    TEXT = 0
    SAFETY_MODE = 5
    KEY = 7
    EXCEPTION = 10


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


class ProgramError(Exception):
    """A program did what the controller answers with a pop-up: it stops. `place`: line and column, if known."""

    def __init__(self, text: str, place: tuple[int, int] = (0, 0)) -> None:
        super().__init__(text)
        self.place = place


class Messages:
    """The newest messages, numbered."""

    def __init__(self) -> None:
        self._messages: deque[Message] = deque(maxlen=KEPT)
        self.last = 0  # number of the newest

    def say(
        self, text: str, kind: MessageKind = MessageKind.TEXT, title: str = "", place: tuple[int, int] = (0, 0)
    ) -> None:
        self.last += 1
        self._messages.append(Message(self.last, kind, text[:TEXT_MAX], title, place))

    def complain(self, error: ProgramError) -> None:
        """Say what a program did wrong."""
        self.say(str(error), MessageKind.EXCEPTION, place=error.place)

    def after(self, number: int) -> list[Message]:
        """What has been said since the message `number`; since ever with 0."""
        return [message for message in self._messages if message.number > number] if self.last > number else []

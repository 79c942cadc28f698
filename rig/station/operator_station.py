"""The operator's station: receives events and answers questions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from rig.station.events import Answered, ListenerDropped, Prompt, RunEvent


class Listener(Protocol):
    """A receiver of all events, which must not block. A receiver that raises an error gets no more events."""

    def event(self, event: RunEvent) -> None: ...


class Station(Protocol):
    """The receiver of a run's events and questions."""

    def event(self, event: RunEvent) -> None: ...

    def ask(self, prompt: Prompt) -> bool: ...

    def confirm_part(self) -> None:
        """Confirm that the devices that have answered belong to the part of this run. Raise Refused `same_chip`."""
        ...


@dataclass(slots=True)
class Stations:
    """A station that sends events to its listeners, and questions to `answer` if an operator attends.

    If not `attended`, everything is agreed to in advance. `mount` mounts the item for a stage in a simulated
    laboratory, after agreement. `confirm` confirms the part of a batch.
    """

    listeners: Sequence[Listener]
    answer: Callable[[Sequence[str], str], bool]
    attended: bool = True
    mount: Callable[[int], None] | None = None
    confirm: Callable[[], None] | None = None

    def event(self, event: RunEvent) -> None:
        """Send an event to all listeners, in order. Drop those that raise an error, and report it to the others."""
        failed: list[tuple[Listener, Exception]] = []
        for listener in self.listeners:
            try:
                listener.event(event)
            except Exception as error:
                failed.append((listener, error))
        for dropped, _ in failed:
            self.listeners = [listener for listener in self.listeners if listener is not dropped]
        for dropped, why in failed:
            self.event(ListenerDropped(type(dropped).__name__, f"{type(why).__name__}: {why}"))

    def confirm_part(self) -> None:
        """Confirm the part as in the protocol; do nothing in a single run, which has no other part to compare with."""
        if self.confirm is not None:
            self.confirm()

    def ask(self, prompt: Prompt) -> bool:
        """Return whether the operator agrees; all listeners get the question and the answer."""
        self.event(prompt)
        mounts = self.mount is not None and prompt.mounts is not None
        can_be_answered = self.attended or mounts or not prompt.for_a_person
        agreed = can_be_answered and self.answer(prompt.announcement, prompt.to_do)
        if agreed and self.mount is not None and prompt.mounts is not None:
            self.mount(prompt.mounts)
        self.event(Answered(agreed))
        return agreed


def always_yes(announcement: Sequence[str], to_do: str) -> bool:
    """Return True, for a run without an operator."""
    return True

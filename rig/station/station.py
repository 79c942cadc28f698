"""Whoever stands at the rig: is told what happens, and agrees to what is asked."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from rig.station.events import Answered, ListenerDropped, Prompt, RunEvent


class Listener(Protocol):
    """Is told everything, and must not block. One that raises is told nothing more: a run does not depend on it."""

    def event(self, event: RunEvent) -> None: ...


class Station(Protocol):
    """Where a run reports to and asks."""

    def event(self, event: RunEvent) -> None: ...

    def ask(self, prompt: Prompt) -> bool: ...


@dataclass(slots=True)
class Stations:
    """Several listeners, and one who answers; not `attended`, everything was agreed to beforehand.

    Who can `mount` the item for a stage does so when that is agreed to: the operator of a simulated laboratory.
    """

    listeners: Sequence[Listener]
    answer: Callable[[Sequence[str], str], bool]
    attended: bool = True
    mount: Callable[[int], None] | None = None

    def event(self, event: RunEvent) -> None:
        """Tell everyone, in order. Who raises is dropped, and the others are told of that."""
        failed: list[tuple[Listener, Exception]] = []
        for listener in self.listeners:
            try:
                listener.event(event)
            except Exception as error:
                failed.append((listener, error))
        for gone, _ in failed:
            self.listeners = [listener for listener in self.listeners if listener is not gone]
        for gone, why in failed:
            self.event(ListenerDropped(type(gone).__name__, f"{type(why).__name__}: {why}"))

    def ask(self, prompt: Prompt) -> bool:
        """Whether the operator agrees; everyone hears the question and the answer."""
        self.event(prompt)
        mounts = self.mount is not None and prompt.mounts is not None
        can_be_answered = self.attended or mounts or not prompt.for_a_person
        agreed = can_be_answered and self.answer(prompt.announcement, prompt.to_do)
        if agreed and self.mount is not None and prompt.mounts is not None:
            self.mount(prompt.mounts)
        self.event(Answered(agreed))
        return agreed


def always_yes(announcement: Sequence[str], to_do: str) -> bool:
    """The answer where there is nobody to ask."""
    return True

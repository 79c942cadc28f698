"""Whoever stands at the rig: is told what happens, and agrees to what is asked."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from rig.station.events import Answered, Prompt, RunEvent


class Listener(Protocol):
    """Is told everything. It must neither block nor raise: a run does not depend on who looks on."""

    def event(self, event: RunEvent) -> None: ...


class Station(Protocol):
    """Where a run reports to and asks."""

    def event(self, event: RunEvent) -> None: ...

    def ask(self, prompt: Prompt) -> bool: ...


@dataclass(frozen=True, slots=True)
class Stations:
    """Several listeners, and one who answers."""

    listeners: Sequence[Listener]
    answer: Callable[[Sequence[str], str], bool]

    def event(self, event: RunEvent) -> None:
        """Tell everyone, in order."""
        for listener in self.listeners:
            listener.event(event)

    def ask(self, prompt: Prompt) -> bool:
        """Whether the operator agrees; everyone hears the question and the answer."""
        self.event(prompt)
        agreed = self.answer(prompt.announcement, prompt.to_do)
        self.event(Answered(agreed))
        return agreed


def always_yes(announcement: Sequence[str], to_do: str) -> bool:
    """The answer where there is nobody to ask."""
    return True

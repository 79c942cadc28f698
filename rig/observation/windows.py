"""When the sweeps, rests and dwells of a recording were, on the controller's clock. Pure."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from rig.data.recording.events import (
    DwellFinished,
    DwellStarted,
    Event,
    RestFinished,
    RestStarted,
    SweepFinished,
    SweepStarted,
)
from rig.data.recording.run_file import RunData
from rig.estimation.arrays import Array
from rig.motion.steps import Dwell, Sweep

Ending = TypeVar("Ending", bound=Event)


@dataclass(frozen=True, slots=True)
class Window:
    """A window from one controller time to another, s."""

    start_s: float
    end_s: float


def inside(time_s: Array, window: Window) -> slice:
    """The samples of a window among those at rising times (n,)."""
    return slice(*np.searchsorted(time_s, [window.start_s, window.end_s]).tolist())


@dataclass(frozen=True, slots=True)
class Finished:
    """A sweep that was begun and finished, and when."""

    sweep: Sweep
    window: Window


@dataclass(frozen=True, slots=True)
class Dwelt:
    """A dwell that was begun and finished, and when."""

    dwell: Dwell
    window: Window


def swept(run: RunData) -> Iterator[Finished]:
    """The sweeps of a recording that were begun and finished, in order; an interrupted one is left out."""
    for event, window in _between(run, SweepStarted, SweepFinished):
        yield Finished(event.sweep, window)


def rested(run: RunData, superseded: Collection[int] = ()) -> Iterator[Window]:
    """The rests that were begun and finished, in order; a dwell is one too.

    Not those whose index is in `superseded`, nor a rest just before or after such a sweep or dwell: what made it worth
    repeating may have begun before it, and have lasted.
    """
    rests = [window for _, window in _between(run, RestStarted, RestFinished) if not _beside(run, window, superseded)]
    dwells = [each.window for each in dwelt(run) if each.dwell.index not in superseded]
    yield from sorted([*rests, *dwells], key=lambda window: window.start_s)


def dwelt(run: RunData) -> Iterator[Dwelt]:
    """The dwells that were begun and finished, in order."""
    for event, window in _between(run, DwellStarted, DwellFinished):
        yield Dwelt(event.dwell, window)


def _beside(run: RunData, rest: Window, superseded: Collection[int]) -> bool:
    """Whether what came before the rest, or was to come after it, is in `superseded`."""
    before, after = -1, None
    for recorded in run.events if superseded else ():
        match recorded.event:
            case SweepStarted(step) | DwellStarted(step):
                if recorded.controller_time_s is not None and recorded.controller_time_s <= rest.start_s:
                    before = step.index
                elif after is None:
                    after = step.index
    return before in superseded or (before + 1 if after is None else after) in superseded


def _between(run: RunData, begin: type[Event], end: type[Ending]) -> Iterator[tuple[Ending, Window]]:
    """Every event of type `end` that has one of type `begin` before it, both at a known time of the controller's."""
    started_s = None
    for recorded in run.events:
        event, time_s = recorded.event, recorded.controller_time_s
        if isinstance(event, begin):
            started_s = time_s
        elif isinstance(event, end) and started_s is not None and time_s is not None:
            yield event, Window(started_s, time_s)
            started_s = None

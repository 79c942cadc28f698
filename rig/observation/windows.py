"""The windows of a recording's sweeps, rests and dwells on the controller's clock. Pure functions.

The types of events are imported only inside the functions that read a recording, because a plan, which has windows too,
does not need them.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.motion.steps import Dwell, Sweep

if TYPE_CHECKING:
    from rig.data.recording.recorded_events import Event

Ending = TypeVar("Ending", bound="Event")


@dataclass(frozen=True, slots=True)
class Window:
    """A window from one controller time to another, s."""

    start_s: float
    end_s: float


def inside(time_s: Array, window: Window) -> slice:
    """Return the slice of the rising times (n,) that lie in a window."""
    return slice(*np.searchsorted(time_s, [window.start_s, window.end_s]).tolist())


@dataclass(frozen=True, slots=True)
class FinishedSweep:
    """A sweep that was started and finished, and its window."""

    sweep: Sweep
    window: Window


@dataclass(frozen=True, slots=True)
class FinishedDwell:
    """A dwell that was started and finished, and its window."""

    dwell: Dwell
    window: Window


def swept(run: RunData) -> Iterator[FinishedSweep]:
    """Yield the sweeps that were started and finished, in order; interrupted sweeps are left out."""
    from rig.data.recording.recorded_events import SweepFinished, SweepStarted

    for event, window in _pair_events(run, SweepStarted, SweepFinished):
        yield FinishedSweep(event.sweep, window)


def iterate_rests(run: RunData, superseded: Collection[int] = ()) -> Iterator[Window]:
    """Yield the rests and dwells that were started and finished, in order.

    Dwells whose index is in `superseded`, and rests next to a superseded sweep or dwell, are left out, because a
    disturbance may begin earlier or last longer.
    """
    from rig.data.recording.recorded_events import RestFinished, RestStarted

    rests = [
        window
        for _, window in _pair_events(run, RestStarted, RestFinished)
        if not _is_superseded(run, window, superseded)
    ]
    dwells = [dwell.window for dwell in dwelt(run) if dwell.dwell.index not in superseded]
    yield from sorted([*rests, *dwells], key=lambda window: window.start_s)


def dwelt(run: RunData) -> Iterator[FinishedDwell]:
    """Yield the dwells that were started and finished, in order."""
    from rig.data.recording.recorded_events import DwellFinished, DwellStarted

    for event, window in _pair_events(run, DwellStarted, DwellFinished):
        yield FinishedDwell(event.dwell, window)


def _is_superseded(run: RunData, rest: Window, superseded: Collection[int]) -> bool:
    """Return whether the sweep or dwell before the rest, or the next one after it, is in `superseded`."""
    from rig.data.recording.recorded_events import DwellStarted, SweepStarted

    before, after = -1, None
    for recorded in run.events if superseded else ():
        match recorded.event:
            case SweepStarted(step) | DwellStarted(step):
                if recorded.controller_time_s is not None and recorded.controller_time_s <= rest.start_s:
                    before = step.index
                elif after is None:
                    after = step.index
    return before in superseded or (before + 1 if after is None else after) in superseded


def _pair_events(run: RunData, begin: "type[Event]", end: type[Ending]) -> Iterator[tuple[Ending, Window]]:
    """Yield each event of type `end` that follows one of type `begin`, with the window between the two.

    Events without a controller time are left out.
    """
    started_s = None
    for recorded in run.events:
        event, time_s = recorded.event, recorded.controller_time_s
        if isinstance(event, begin):
            started_s = time_s
        elif isinstance(event, end) and started_s is not None and time_s is not None:
            yield event, Window(started_s, time_s)
            started_s = None

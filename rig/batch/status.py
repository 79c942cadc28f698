"""What a station is doing at this moment, made of its batch and of the events of its runs."""

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from rig.batch.batch import Batch
from rig.errors import Refused
from rig.station.events import (
    Answered,
    ArmConnected,
    Failed,
    Interrupted,
    PhaseRecorded,
    Progress,
    Prompt,
    RunEvent,
    SamplingStarted,
    VerdictReached,
)

State = Literal["waiting", "checking", "asking", "running", "solving", "refused", "fault", "stopped", "ended"]
NEWEST = 60  # parts that are told of: a tray has fewer
ENDINGS = ("fault", "stopped", "ended")  # states that say how a station ended


@dataclass(frozen=True, slots=True)
class Now:
    """What is told of a station: its `state`, the present `part`, what it is `doing` in words, the seconds left.

    `parts` are the batch's newest, serial number and state of each; `counts` how many of all became what. `rig` is the
    rig's name in a history, empty until it is known. `over` is the last word: nothing comes after it.
    """

    state: State = "waiting"
    part: str = ""
    doing: str = ""
    left_s: float | None = None
    operator: str = ""
    work_order: str = ""
    simulated: bool = False
    counts: dict[str, int] | None = None
    parts: tuple[tuple[str, str], ...] = ()
    rig: str = ""
    over: bool = False

    def json(self) -> str:
        """The text that goes into the history."""
        return json.dumps(asdict(self), separators=(",", ":"), ensure_ascii=False)


@dataclass(slots=True)
class Present:
    """What a station is doing, kept up to date: a listener of its runs, and told of its batch.

    `hears` are told of every change, and must not block.
    """

    now: Now
    hears: Sequence[Callable[[Now], None]] = field(default=())

    def event(self, event: RunEvent) -> None:
        """Take an event, as a Listener does."""
        self._becomes(after(self.now, event))

    def batch(self, batch: Batch) -> None:
        """The batch has changed."""
        self._becomes(of_batch(self.now, batch))

    @contextmanager
    def asking(self, what: str) -> Iterator[None]:
        """The operator is asked something between two runs, for the length of the `with` block."""
        self._becomes(replace(self.now, state="asking", doing=what, left_s=None))
        yield
        self._becomes(replace(self.now, state="checking" if self.now.part else "waiting", doing=""))

    def _becomes(self, now: Now) -> None:
        if now != self.now:
            self.now = now
            for hear in self.hears:
                hear(now)


def of_batch(now: Now, batch: Batch) -> Now:
    """What is told once something of the batch has changed."""
    in_hand = batch.in_hand
    counts: dict[str, int] = {}
    for part in batch.parts:
        counts[part.state] = counts.get(part.state, 0) + 1
    return replace(
        now,
        state="ended" if batch.ended_utc else "checking" if in_hand else "waiting",
        part=in_hand.serial if in_hand else "",
        doing="",
        left_s=None,
        operator=batch.begun.operator,
        work_order=batch.begun.work_order,
        counts=counts,
        parts=tuple((part.serial, part.state) for part in batch.parts[-NEWEST:]),
    )


def last(now: Now) -> Now:
    """What is told when nothing comes after it: a batch that has not ended, and that no fault ended, has stopped."""
    return replace(now, state=now.state if now.state in ENDINGS else "stopped", left_s=None, over=True)


def after(now: Now, event: RunEvent) -> Now:
    """What is told after an event of a run."""
    changed: dict[str, Any] | None = None
    match event:
        case ArmConnected(report):
            changed = {"rig": now.rig or report.serial_number}
        case Prompt(_, to_do):
            changed = {"state": "asking", "doing": f"whether to {to_do}"}
        case Answered(agreed):
            changed = {"state": "checking" if agreed else "waiting", "doing": ""}
        case SamplingStarted():
            changed = {"state": "running", "doing": ""}
        case Progress(step=step, remaining_s=left_s):
            changed = {"state": "running", "doing": step.name, "left_s": round(left_s, 1)}
        case PhaseRecorded():
            changed = {"state": "solving", "doing": ""}
        case VerdictReached(passed):
            changed = {"state": "solving", "doing": "PASS" if passed else "FAIL"}
        case Failed(error):
            state = "refused" if isinstance(error, Refused) else "fault"
            changed = {"state": state, "doing": f"{error.name}: {error.what}"}
        case Interrupted(text):
            changed = {"state": "stopped", "doing": text}
    return now if changed is None else replace(now, **{"left_s": None, **changed})

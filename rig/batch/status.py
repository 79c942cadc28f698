"""The present state of a station, from its batch and the events of its runs."""

import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

from rig.batch.batch_state import Batch
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
    SamplesTaken,
    SamplingStarted,
    VerdictReached,
)

State = Literal["waiting", "checking", "asking", "running", "solving", "refused", "fault", "stopped", "ended"]
MAX_PARTS = 60  # the newest, in the status: a tray has fewer
FINAL_STATES = ("fault", "stopped", "ended")  # of a station


@dataclass(frozen=True, slots=True)
class Now:
    """The present state of a station.

    - state, part: the present activity, and the serial number of its part.
    - doing: the activity in words.
    - left_s: its remaining time, None if unknown.
    - operator, work_order, simulated: properties of the batch.
    - counts: the numbers of parts by state.
    - parts: serial number and state of the newest parts.
    - rig: the rig's name in a history, empty if unknown.
    - over: whether this is the last state.
    - fraction: the finished fraction of the run (0 to 1), None without a run.
    - turn_deg_s: the present rate of the turner.
    - sensors: each sensor's name, number of samples and number of lost samples.
    - verdict: the last part's serial number and state, until the next part begins.
    - why: the reason of that part's state.
    - truth: the agreement of that part's result with a simulated laboratory's truth, empty without a truth.
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
    fraction: float | None = None
    turn_deg_s: float | None = None
    sensors: tuple[tuple[str, int, int], ...] = ()
    verdict: tuple[str, str] | None = None
    why: str = ""
    truth: str = ""

    def json(self) -> str:
        """Return the state as JSON for the history."""
        return json.dumps(asdict(self), separators=(",", ":"), ensure_ascii=False)


@dataclass(slots=True)
class Present:
    """The present state of a station. The `listeners` are called after every change and must not block."""

    now: Now
    listeners: Sequence[Callable[[Now], None]] = field(default=())

    def event(self, event: RunEvent) -> None:
        """Update the station's state after an event of a run."""
        self._becomes(after(self.now, event))

    def batch(self, batch: Batch) -> None:
        """Update the station's state after a change of its batch."""
        self._becomes(update_by_batch(self.now, batch))

    @contextmanager
    def asking(self, what: str) -> Iterator[None]:
        """Show during the block that the operator is asked a question between two runs; `what`: its subject."""
        self._becomes(replace(self.now, state="asking", doing=what, left_s=None))
        yield
        self._becomes(replace(self.now, state="checking" if self.now.part else "waiting", doing=""))

    def _becomes(self, now: Now) -> None:
        if now != self.now:
            self.now = now
            for listener in self.listeners:
                listener(now)


def update_by_batch(now: Now, batch: Batch) -> Now:
    """Return a station's state after a change of its batch."""
    in_hand = batch.in_hand
    newest = batch.parts[-1] if batch.parts and not in_hand else None
    counts: dict[str, int] = {}
    for part in batch.parts:
        counts[part.state] = counts.get(part.state, 0) + 1
    return replace(
        now,
        state="ended" if batch.ended_utc else "checking" if in_hand else "waiting",
        part=in_hand.serial if in_hand else "",
        doing="",
        left_s=None,
        fraction=None,
        turn_deg_s=None,
        sensors=(),
        verdict=(newest.serial, newest.state) if newest else None,
        why=newest.ended.why if newest and newest.ended else "",
        truth=newest.ended.truth if newest and newest.ended else "",
        operator=batch.begun.operator,
        work_order=batch.begun.work_order,
        counts=counts,
        parts=tuple((part.serial, part.state) for part in batch.parts[-MAX_PARTS:]),
    )


def last(now: Now) -> Now:
    """Return the state at the end; "stopped" for a batch that ended neither by itself nor by a fault."""
    return replace(now, state=now.state if now.state in FINAL_STATES else "stopped", left_s=None, over=True)


def after(now: Now, event: RunEvent) -> Now:
    """Return a station's state after an event of a run."""
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
        case Progress(step=step, elapsed_s=elapsed_s, remaining_s=left_s, arm_speed_rad_s=speed_rad_s):
            whole_s = elapsed_s + left_s
            changed = {
                "state": "running",
                "doing": step.name,
                "left_s": round(left_s, 1),
                "fraction": round(elapsed_s / whole_s, 3) if whole_s > 0 else None,
                "turn_deg_s": round(math.degrees(speed_rad_s), 1),
            }
        case SamplesTaken(sensors):
            return replace(now, sensors=tuple((one.sensor, one.samples, one.lost) for one in sensors))
        case PhaseRecorded():
            changed = {"state": "solving", "doing": ""}
        case VerdictReached(passed):
            changed = {"state": "solving", "doing": "PASS" if passed else "FAIL"}
        case Failed(error):
            state = "refused" if isinstance(error, Refused) else "fault"
            changed = {"state": state, "doing": f"{error.name}: {error.what}"}
        case Interrupted(text):
            changed = {"state": "stopped", "doing": text}
    if changed is None:
        return now
    values: dict[str, Any] = {"left_s": None, "fraction": None, "turn_deg_s": None, **changed}
    return replace(now, **values)

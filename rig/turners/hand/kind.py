"""The hand of an operator, as a kind of turner: without joints, without states, with nothing that could move by itself.

What it did is read from the sensors themselves; the time of a recording is the board's.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rig.config.procedures.hand_sections import HandSection
from rig.errors import Fault, Problem
from rig.motion.carried import Carried
from rig.motion.geometry import DenavitHartenberg
from rig.motion.state import Joints, Made, Row
from rig.motion.steps import Motion, Plan
from rig.turners.kind import OnState, TurnerKind, Words
from rig.turners.turner import Turner

GEOMETRY = DenavitHartenberg((), (), (), ())
NOBODY = "none, turned by hand"
LOOK_S = 0.02


@dataclass(frozen=True, slots=True)
class HandState:
    """A `State` of no joints; its time is the computer's, by which nothing is solved."""

    time_s: float
    host_time_s: float

    @property
    def q_rad(self) -> Joints:
        """No angles."""
        return ()

    @property
    def qd_rad_s(self) -> Joints:
        """No speeds."""
        return ()

    def to_record(self) -> Row:
        """The times."""
        return self.time_s, self.host_time_s


@dataclass(frozen=True, slots=True)
class HandReport:
    """A `Report` of what cannot be asked."""

    state: HandState
    host: str = "this table"
    serial_number: str = NOBODY
    software: str = NOBODY
    model: str | None = None
    kinematics: DenavitHartenberg | None = GEOMETRY
    joints: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The turner in a line of text."""
        return "none, an operator's hand turns the item"


class Hand:
    """A `Turner` that is told nothing: who drives the operator is the runner (`rig.runner.by_hand.session`)."""

    missed_states = 0

    @property
    def latest(self) -> HandState:
        """The present moment."""
        now_s = time.monotonic()
        return HandState(now_s, now_s)

    def report(self) -> HandReport:
        """A report that says no more than that a hand turns."""
        return HandReport(self.latest)

    def check(self) -> None:
        """A hand has nothing that can go wrong."""

    def take_control(self, carried: Carried) -> None:
        """There is nothing to take."""

    def move(self, motion: Motion, watch: Callable[[], None] = lambda: None) -> None:
        """A hand makes no planned motion. Raises Fault `unplanned_motion`."""
        raise Fault(
            "unplanned_motion",
            "a script orders a motion of joints, and a hand turns the item",
            "Use the procedure by_hand, or name the arm that is to move",
        )

    def rest(self, duration_s: float, watch: Callable[[], None] = lambda: None) -> None:
        """Wait for so long by the computer's clock."""
        end_s = time.monotonic() + duration_s
        while (left_s := end_s - time.monotonic()) > 0:
            watch()
            time.sleep(min(LOOK_S, left_s))


@contextmanager
def _connect(section: HandSection, on_state: OnState, log: Path) -> Iterator[Turner]:
    yield Hand()


def _look(section: HandSection) -> HandReport:
    return Hand().report()


def _stance(report: HandReport) -> str:
    return "no joints: a hand turns the item"


def _problems(plans: Sequence[Plan], section: HandSection, report: HandReport | None) -> list[Problem]:
    """A plan with motions is none for a hand."""
    if not any(plan.motions for plan in plans):
        return []
    return [
        Problem(
            "unplanned_motion",
            "the plan has motions of joints, and a hand turns the item",
            "Use the procedure by_hand, or name the arm that is to move",
        )
    ]


MADE = Made("none", None, GEOMETRY)
HAND = TurnerKind(
    name="hand",
    section=HandSection,
    connect=_connect,
    look=_look,
    stance=_stance,
    problems=_problems,
    meant=lambda section: MADE,
    made=lambda section, report: MADE,
    carried=lambda section: Carried(0.0),
    words=Words(
        name="hand",
        short="hand",
        turned="the item",
        method="The items are laid on their faces on a flat table and turned by hand, through {turns}; every move "
        "from rest to rest is integrated",
        briefly="moves by hand from rest to rest on a flat table",
        directions="the faces of the item",
    ),
)

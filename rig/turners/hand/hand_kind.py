"""An operator's hand as a kind of turner: it has no joints, measures no motion and cannot be driven.

The sensors' readings determine the motion; the clock of a recording is the board's.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rig.config.procedures.hand_sections import HandSection
from rig.errors import Fault, Problem
from rig.motion.carried import FlangeLoad
from rig.motion.chain import DenavitHartenberg
from rig.motion.steps import Motion, Plan
from rig.motion.turner_state import Joints, Row, TurnerIdentity
from rig.turners.turner import Turner
from rig.turners.turner_kind import OnState, TurnerKind, Wording

GEOMETRY = DenavitHartenberg((), (), (), ())
NO_DEVICE = "none, turned by hand"
LOOK_S = 0.02


@dataclass(frozen=True, slots=True)
class HandState:
    """A `State` without joints. Its time is the computer's, which the solution does not use."""

    time_s: float
    host_time_s: float

    @property
    def q_rad(self) -> Joints:
        """The joint angles: none."""
        return ()

    @property
    def qd_rad_s(self) -> Joints:
        """The joint rates: none."""
        return ()

    def to_record(self) -> Row:
        """Return the row of a run file: the state's times."""
        return self.time_s, self.host_time_s


@dataclass(frozen=True, slots=True)
class HandReport:
    """A `Report` of a turner that cannot be queried."""

    state: HandState
    host: str = "this table"
    serial_number: str = NO_DEVICE
    software: str = NO_DEVICE
    model: str | None = None
    kinematics: DenavitHartenberg | None = GEOMETRY
    joints: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The turner described in a line of text."""
        return "none, an operator's hand turns the item"


class Hand:
    """A `Turner` without control: the runner guides the operator (`rig.runner.by_hand.hand_session`)."""

    missed_states = 0

    @property
    def latest(self) -> HandState:
        """The present time, as a state."""
        now_s = time.monotonic()
        return HandState(now_s, now_s)

    def report(self) -> HandReport:
        """Return a report that names a hand as the turner."""
        return HandReport(self.latest)

    def check(self) -> None:
        """Do nothing: a hand has no faults to raise."""

    def take_control(self, carried: FlangeLoad) -> None:
        """Do nothing: a hand needs no preparation."""

    def move(self, motion: Motion, watch: Callable[[], None] = lambda: None) -> None:
        """Raise Fault `unplanned_motion`, because a hand cannot be driven."""
        raise Fault(
            "unplanned_motion",
            "a script orders a motion of joints, and a hand turns the item",
            "Use the procedure by_hand, or name the arm that is to move",
        )

    def rest(self, duration_s: float, watch: Callable[[], None] = lambda: None) -> None:
        """Wait for `duration_s` of the computer's clock."""
        end_s = time.monotonic() + duration_s
        while (remaining_s := end_s - time.monotonic()) > 0:
            watch()
            time.sleep(min(LOOK_S, remaining_s))


@contextmanager
def _connect(section: HandSection, on_state: OnState, log: Path) -> Iterator[Turner]:
    yield Hand()


def _make_report(section: HandSection) -> HandReport:
    return Hand().report()


def _stance(report: HandReport) -> str:
    return "no joints: a hand turns the item"


def _problems(plans: Sequence[Plan], section: HandSection, report: HandReport | None) -> list[Problem]:
    """Return a problem if a plan has motions of joints."""
    if not any(plan.motions for plan in plans):
        return []
    return [
        Problem(
            "unplanned_motion",
            "the plan has motions of joints, and a hand turns the item",
            "Use the procedure by_hand, or name the arm that is to move",
        )
    ]


RECORDED = TurnerIdentity("none", None, GEOMETRY)
HAND = TurnerKind(
    name="hand",
    section=HandSection,
    connect=_connect,
    look=_make_report,
    stance=_stance,
    problems=_problems,
    describe_configured=lambda section: RECORDED,
    describe_connected=lambda section, report: RECORDED,
    carried=lambda section: FlangeLoad(0.0),
    words=Wording(
        name="hand",
        short="hand",
        turned="the item",
        method="The items are laid on their faces on a flat table and turned by hand, through {turns}; every move "
        "from rest to rest is integrated",
        briefly="moves by hand from rest to rest on a flat table",
        directions="the faces of the item",
    ),
)

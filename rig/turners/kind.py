"""What is known of a kind of turner: how it is configured, connected, looked at, judged, and spoken of."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from rig.config.models import TurnerSection
from rig.errors import Problem
from rig.motion.carried import Carried
from rig.motion.state import Made, Report, State, StateField
from rig.motion.steps import Plan
from rig.turners.turner import Turner

SectionT = TypeVar("SectionT", bound=TurnerSection)
ReportT = TypeVar("ReportT", bound=Report)
OnState = Callable[[State], None]


@dataclass(frozen=True, slots=True)
class Words:
    """How documents and messages speak of a turner.

    `name` is a noun without an article ("robot arm"), `short` what an operator calls it ("arm"), `turned` what a sweep
    turns of it ("the wrists"); `method` says in a clause how it turns the items, for the
    certificate; `briefly` the same in a few words, for the digital certificate; in both `{turns}`
    stands for what sweeps turned through; `directions` whence its axes are known; `beware` is what an operator must be
    told of it before it moves, `stands` says in a clause how it is left while somebody mounts the item anew; `clock` is
    what its states are timed by, `told` by whose word its axes are known, `traced` what that means for a certificate.
    """

    name: str
    short: str
    turned: str
    method: str
    briefly: str
    directions: str
    beware: str = ""
    stands: str = "stands still"
    clock: str = "the arm controller's clock"
    told: str = "as its controller or the nominal model tells them"
    traced: str = "not traceable, a contributor of the uncertainty"


@dataclass(frozen=True, slots=True)
class TurnerKind(Generic[SectionT, ReportT]):
    """A kind of turner, registered by the entry point `name` of the group `rig.turners`.

    - `section`: what `turner:` in the configuration may say with `kind: name`.
    - `connect`: the turner, for the length of a `with` block that ends with it stopped; every state goes, in order, to
      the function given; the file is for what a maker's client prints. Raises `Refused` by name.
    - `look`: what it says of itself; nothing moves and no program is stopped. Raises `Refused` by name.
    - `stance`: how it stands, in a line of text.
    - `problems`: all that is known to speak against driving the last of the plans, before anything moves: of the plans
      by themselves where there is no report. Pure.
    - `meant`: which one the configuration means: as it is on the drawing, before anything has answered.
    - `made`: what a recording says of the one that was found. Raises `Refused` where it is not the one that was meant.
    - `carried`: what it is to be told of its load.
    - `fields`: what its states tell beyond times and joints, in the order of their `to_record`.
    """

    name: str
    section: type[SectionT]
    connect: Callable[[SectionT, OnState, Path], AbstractContextManager[Turner]]
    look: Callable[[SectionT], ReportT]
    stance: Callable[[ReportT], str]
    problems: Callable[[Sequence[Plan], SectionT, ReportT | None], list[Problem]]
    meant: Callable[[SectionT], Made]
    made: Callable[[SectionT, ReportT], Made]
    carried: Callable[[SectionT], Carried]
    words: Words
    fields: tuple[StateField, ...] = ()


AnyTurner = TurnerKind[Any, Any]

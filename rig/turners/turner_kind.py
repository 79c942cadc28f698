"""The description of a kind of turner: configuration, connection, pre-flight, identity and wording."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from rig.config.models import TurnerSection
from rig.errors import Problem
from rig.motion.carried import FlangeLoad
from rig.motion.state_rows import StateField
from rig.motion.steps import Plan
from rig.motion.turner_state import Report, State, TurnerIdentity
from rig.turners.turner import Turner

SectionT = TypeVar("SectionT", bound=TurnerSection)
ReportT = TypeVar("ReportT", bound=Report)
OnState = Callable[[State], None]


@dataclass(frozen=True, slots=True)
class Wording:
    """The wording for a turner in documents and messages.

    - name: a noun without an article ("robot arm").
    - short: the operator's name for it ("arm").
    - turned: the part that is turned in a sweep ("the wrists").
    - method: a clause for the certificate on how it turns the items; "{turns}" stands for the rotation of the sweeps.
    - briefly: the method in a few words, for the digital certificate.
    - directions: the source of its axes' directions.
    - beware: a warning for the operator before it moves.
    - stands: a clause on its state while the item is remounted.
    - clock: the clock that stamps its states.
    - axes_source: the source of its axes, as a clause.
    - axes_traceability: the traceability of its axes, for the certificate.
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
    axes_source: str = "as reported by its controller or by the nominal model"
    axes_traceability: str = "not traceable, a contributor of the uncertainty"


@dataclass(frozen=True, slots=True)
class TurnerKind(Generic[SectionT, ReportT]):
    """A kind of turner, registered by the entry point of its name in the group `rig.turners`.

    - name: the kind in a configuration (`turner: kind: name`).
    - section: the model of the section `turner:`.
    - connect: returns a context manager of the turner, which is stopped at its end. `connect` is called with the
      section, a function that gets every state in order, and a file for the output of a maker's client. Raise Refused
      if no turner answers.
    - look: reads the turner's report about itself; nothing moves, no program is stopped. Raise Refused as `connect`.
    - stance: describes its pose in a line of text.
    - problems: lists all reasons not to execute the last of the plans, before anything moves; without a report, only
      those due to the plans. Pure.
    - describe_configured: returns the configured turner with its nominal geometry, before any connection.
    - describe_connected: returns the connected turner for the recording. Raise `Refused` for a turner other than the
      configured one.
    - carried: returns the payload to set on the turner.
    - words: its wording in documents and messages.
    - fields: the fields of its states after times and joints, in the order of `to_record`.
    """

    name: str
    section: type[SectionT]
    connect: Callable[[SectionT, OnState, Path], AbstractContextManager[Turner]]
    look: Callable[[SectionT], ReportT]
    stance: Callable[[ReportT], str]
    problems: Callable[[Sequence[Plan], SectionT, ReportT | None], list[Problem]]
    describe_configured: Callable[[SectionT], TurnerIdentity]
    describe_connected: Callable[[SectionT, ReportT], TurnerIdentity]
    carried: Callable[[SectionT], FlangeLoad]
    words: Wording
    fields: tuple[StateField, ...] = ()


AnyTurner = TurnerKind[Any, Any]

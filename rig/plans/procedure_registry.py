"""The procedures by name: the stock ones, and those that packages add through the entry-point group `rig.procedures`.

The stock procedures are those in `STOCK_SECTIONS`; each has its script in the module of its name in `procedures/`. The
rig knows a procedure only through its `Procedure`; a procedure that is not installed comes from a file
(`rig.plans.script_file`).
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint
from typing import Any, Generic, Literal, Protocol, TypeVar

from rig.analysis.analyses import calibrate
from rig.analysis.estimator_names import DEFAULT_ESTIMATOR, Estimator
from rig.analysis.outcome import Outcome
from rig.config.models import ArmSection, ProcedureSection, TurnerSection
from rig.config.procedures.procedure_sections import STOCK_SECTIONS
from rig.data.recording.run_data import RunData
from rig.errors import Refused
from rig.errors.installed import load_entry_points
from rig.motion.steps import Plan
from rig.motion.turner_state import Joints
from rig.plans.verbs import Script

GROUP = "rig.procedures"
Readings = Literal["raw", "calibrated"]
SectionT = TypeVar("SectionT", bound=ProcedureSection)
SectionT_contra = TypeVar("SectionT_contra", bound=ProcedureSection, contravariant=True)


class Planner(Protocol[SectionT_contra]):
    """A pure function that plans the steps from the turner's pose `start_q_rad` (home if None) without those in `done`.

    The `index` of a sweep or dwell, by which `done` names it, is its number in the whole procedure. Raise Refused if
    the movement is impossible.
    """

    def __call__(
        self,
        turner: Any,  # is of the section named by `Procedure.turner`
        procedure: SectionT_contra,
        start_q_rad: Joints | None = None,
        done: Collection[int] = (),
        /,
    ) -> Plan: ...


# The recordings of this phase (none if it did not happen), the outcome of the phase before (None for the first one),
# the estimator's name.
Analysis = Callable[[Sequence[RunData], Outcome | None, str], Outcome]


def calibration(runs: Sequence[RunData], before: Outcome | None, estimator: str) -> Outcome:
    """Return the usual outcome: scale and bias of every sensor from averaged revolutions, compared with the limits."""
    return calibrate(runs, estimator)


@dataclass(frozen=True, slots=True)
class Procedure(Generic[SectionT]):
    """A procedure: its name, its section in the configuration, its planner, its script and its analysis.

    - readings: the readings of the sensors to calibrate, either "raw", which the board also averages, or "calibrated",
      which the board corrects.
    - then: the procedure that follows with the same movement if the section has `then_verify`.
    - turner: the section type of the turner that the procedure needs.
    - estimator: the estimator of the result, unless another is requested.
    """

    name: str
    section: type[SectionT]
    plan: Planner[SectionT]
    script: Script
    analyse: Analysis = calibration
    readings: Readings = "raw"
    then: str | None = None
    turner: type[TurnerSection] = ArmSection
    estimator: Estimator = DEFAULT_ESTIMATOR

    @property
    def reads_corrected(self) -> bool:
        """Whether the board corrects the readings of the sensors to calibrate, by its stored calibrations."""
        return self.readings == "calibrated"

    @property
    def calibrates_along(self) -> bool:
        """Whether the board averages and solves during the recording, for which it needs raw readings."""
        return self.readings == "raw"

    def following(self, procedures: "Procedures") -> "AnyProcedure | None":
        """Return the procedure that the key `then` names, or None. Raise Refused `no_such_procedure`."""
        if self.then is not None and self.then not in procedures:
            raise Refused(
                "no_such_procedure",
                f"the procedure {self.name} is to be followed by {self.then!r}, which is not installed",
                f"Let `then` name one of: {', '.join(procedures)}",
            )
        return None if self.then is None else procedures[self.then]


AnyProcedure = Procedure[Any]
Procedures = Mapping[str, AnyProcedure]


@cache
def _load_installed() -> Mapping[str, tuple[AnyProcedure, str]]:
    """Return the installed procedures by name, each with its Python module."""
    stock = (EntryPoint(name, f"procedures.{name}:PROCEDURE", GROUP) for name in STOCK_SECTIONS)
    entries = load_entry_points(GROUP, _not_loaded, stock)
    return {procedure.name: (procedure, entry.module) for entry, procedure in entries}


def _not_loaded(what: str, remedy: str) -> Refused:
    return Refused("procedure_not_loaded", f"the procedure {what}", remedy)


def load_procedures() -> Procedures:
    """Return the procedures of the packages installed here. Raise Refused `procedure_not_loaded`."""
    return {name: procedure for name, (procedure, _) in _load_installed().items()}


def module_of(name: str) -> str:
    """Return the module of an installed procedure."""
    return _load_installed()[name][1]


def sections(procedures: Procedures) -> Mapping[str, type[ProcedureSection]]:
    """Return the types of the `procedure:` section of a configuration, by name."""
    return {name: procedure.section for name, procedure in procedures.items()}

"""Kinds of sensors that packages add, with their own solvers, on an arm or from a file's attitudes. Pure functions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from rig.analysis.check import Check
from rig.data.installed_kinds import InstalledKind, installed_kinds
from rig.data.quantity import Quantity
from rig.data.recording.motion_file import Item
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import RunSettings
from rig.errors import Fault
from rig.errors.attempts import attempt
from rig.observation.observed_run import ObservedRun


@dataclass(frozen=True, slots=True)
class OfKind:
    """The solution by an installed kind's solver, and its checks."""

    solution: object
    checks: tuple[Check, ...] = ()


@dataclass(frozen=True, slots=True)
class KindFound:
    """The result for one sensor of an installed kind: `solved`, or if that is None, the `fault` that says why."""

    name: str
    sensor: RecordedSensor | Item
    quantity: Quantity
    solved: OfKind | None
    fault: Fault | None = None

    @property
    def checks(self) -> tuple[Check, ...]:
        """The solver's checks; empty without a solution."""
        return () if self.solved is None else self.solved.checks


def kinds_on_arm(recordings: Sequence[ObservedRun], settings: RunSettings) -> Iterator[KindFound]:
    """Yield the solution or the Fault of every recorded sensor of an installed kind, in the order of the kinds."""
    for kind in installed_kinds():
        faults = dict[str, Fault]()
        for name, sensor in recordings[0].run.measuring(kind.quantity).items():
            solve = partial(_solve, kind, name, recordings, settings)
            yield KindFound(name, sensor, kind.quantity, attempt(faults, name, solve), faults.get(name))


def _solve(kind: InstalledKind, name: str, recordings: Sequence[ObservedRun], settings: RunSettings) -> OfKind:
    from rig.observation.arm_placements import placements_on_arm  # with all that other programs' files need

    placements = placements_on_arm(recordings, name, kind.quantity, settings.observation)
    solved: OfKind = kind.solve(name, placements, settings.site)
    return solved

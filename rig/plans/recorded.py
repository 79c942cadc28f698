"""A run as it was recorded, and judged again by the procedure that judged it when it ended."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rig.analysis.outcome import Outcome
from rig.data.run_file import RunData, read_run
from rig.data.run_folder import SCRIPT, recordings
from rig.errors import Refused
from rig.plans.registry import AnyProcedure, installed
from rig.plans.script_file import load_script


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """The recordings of a run, oldest first: of `raw` readings, and of those the board `corrected`.

    `path` is the run folder, or the run file when a recording stands `alone`.
    """

    path: Path
    raw: tuple[RunData, ...]
    corrected: tuple[RunData, ...]
    alone: bool = False

    @property
    def movement(self) -> tuple[RunData, ...]:
        """The recordings of the first movement."""
        return self.raw or self.corrected

    def only_raw(self) -> "RecordedRun":
        """The calibration alone."""
        return replace(self, corrected=(), alone=True)

    def judged_by(self, overrides: Sequence[str]) -> "RecordedRun":
        """The same with other thresholds or limits, see `RunSettings.with_overrides`."""
        raw, corrected = (tuple(run.judged_by(overrides) for run in runs) for runs in (self.raw, self.corrected))
        return replace(self, raw=raw, corrected=corrected)


def open_run(path: Path) -> RecordedRun:
    """The recordings in a run folder, or a run file. Raises Refused `no_run`, and as `read_run`."""
    if not path.is_dir():
        run = read_run(path)
        corrected = _is_corrected(run)
        return RecordedRun(path, () if corrected else (run,), (run,) if corrected else (), alone=True)
    # Corrected readings are compared as one whole movement: what was interrupted before it does not count.
    files = recordings(path, "raw"), recordings(path, "calibrated")[-1:]
    raw, repeated = (tuple(map(read_run, each)) for each in files)
    if not raw and not repeated:
        raise Refused("no_run", f"{path} holds no run.h5", "Give a run folder or a run file")
    return RecordedRun(path, raw, repeated)


def judged(run: RecordedRun, estimator: str) -> Outcome:
    """What a run says, phase after phase; one that was to follow and is missing has not passed.

    Of a recording that stands alone it is what that recording says. Raises Fault and Refused by name as the
    procedure's analysis does.
    """
    folder = run.path if run.path.is_dir() else run.path.parent
    procedure = procedure_of(run.movement[0], folder)
    outcome = procedure.analyse(run.movement, None, estimator)
    if run.raw and run.corrected:
        return procedure_of(run.corrected[0], folder).analyse(run.corrected, outcome, estimator)
    if run.raw and not run.alone and run.raw[0].settings.then_verify:
        missing = procedure.following(installed())
        return outcome if missing is None else missing.analyse([], outcome, estimator)
    return outcome


def _is_corrected(run: RunData) -> bool:
    """Whether the board corrected what the sensors to calibrate streamed."""
    return any(sensor.mode == "calibrated" for sensor in run.sensors.values())


def procedure_of(run: RunData, folder: Path) -> AnyProcedure:
    """The procedure the recording names: an installed one, or the script kept in its `folder`.

    Raises Refused `another_script` when the script there is not the one it was recorded with, and as `load_script`.
    """
    name = run.settings.procedure
    procedures = installed()
    if name not in procedures or not run.provenance.script_installed:
        script = load_script(folder / SCRIPT, run.provenance.script_identity)
        procedures = {**procedures, name: script.procedure}
    found = procedures[name]
    # Recordings of before there were phases name the procedure that the run began with.
    if found.reads_corrected != _is_corrected(run):
        return found.following(procedures) or found
    return found

"""A recorded run, and its analysis by the procedure that judged it."""

import os
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from rig.analysis.outcome import Outcome
from rig.data.processes.reading_process import ReadingTask
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import read_run
from rig.data.run_folder import SCRIPT, recordings
from rig.errors import Refused
from rig.plans.procedure_registry import AnyProcedure, load_procedures
from rig.plans.script_file import ScriptFile, kept_script, load_script

RAW, CORRECTED = "six_observation", "verify"  # procedures that judge any recording: of raw readings, of corrected ones


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """The recordings of a run, oldest first: `raw` as measured, and `corrected` by the board.

    `path` is the run folder or a run file. If `alone`, the recordings are judged without the run's other phases.
    `script` is the script that the user has named, or None.
    """

    path: Path
    raw: tuple[RunData, ...]
    corrected: tuple[RunData, ...]
    alone: bool = False
    script: ScriptFile | None = None

    @property
    def movement(self) -> tuple[RunData, ...]:
        """The calibration's recordings; if there are none, the verification's."""
        return self.raw or self.corrected

    def only_raw(self) -> "RecordedRun":
        """Return the run's calibration without its verification."""
        return replace(self, corrected=(), alone=True)

    def override_settings(self, overrides: Sequence[str]) -> "RecordedRun":
        """Return the run with other thresholds or limits, see `RunSettings.apply_overrides`."""
        raw, corrected = (
            tuple(run.override_settings(overrides) for run in runs) for runs in (self.raw, self.corrected)
        )
        return replace(self, raw=raw, corrected=corrected)


def open_run(
    path: Path,
    script: Path | None = None,
    *,
    only: Container[str] | None = None,
    begun: Mapping[Path, ReadingTask] = MappingProxyType({}),
) -> RecordedRun:
    """Return the recordings in a run folder, or a run file; `script`, if given, is executed.

    `only` selects recordings of a folder by name; by default all are included, also those added to the folder later.
    `begun` has, by path, the files whose reading has already begun. Raise Refused `no_run`, and what `read_run` and
    `load_script` raise.
    """
    named = None if script is None else load_script(script)
    if not path.is_dir():
        run = read_run(path, begun=begun.get(path))
        corrected = _is_corrected(run)
        return RecordedRun(path, () if corrected else (run,), (run,) if corrected else (), alone=True, script=named)
    # Corrected readings are compared as one complete movement: interrupted ones before it do not count.
    raw_files, repeated_files = (
        [file for file in recordings(path, readings) if only is None or file.name in only]
        for readings in ("raw", "calibrated")
    )
    raw, repeated = (
        tuple(read_run(file, begun=begun.get(file)) for file in files) for files in (raw_files, repeated_files[-1:])
    )
    if not raw and not repeated:
        why = "holds no run.h5" if os.access(path, os.R_OK | os.X_OK) else "cannot be read: Permission denied"
        raise Refused("no_run", f"{path} {why}", "Give a run folder or a run file")
    return RecordedRun(path, raw, repeated, script=named)


def judge_phases(run: RecordedRun, estimator: str | None = None) -> Outcome:
    """Return the outcome of a run, phase by phase; `estimator` None stands for the procedure's own.

    A planned phase that is missing counts as failed, unless the run is a single recording (`alone`). Raise Fault and
    Refused as the procedure's analysis does.
    """
    procedure = _procedure_of(run, run.movement[0])
    estimator = estimator or procedure.estimator
    outcome = procedure.analyse(run.movement, None, estimator)
    if run.raw and run.corrected:
        return _procedure_of(run, run.corrected[0]).analyse(run.corrected, outcome, estimator)
    if run.raw and not run.alone and run.raw[0].settings.then_verify:
        missing = procedure.following(load_procedures())
        return outcome if missing is None else missing.analyse([], outcome, estimator)
    return outcome


def describe_omission(run: RecordedRun) -> str | None:
    """Return a sentence if the solution lacks the analysis of a script that is not executed, or None."""
    for recording in (*run.raw, *run.corrected):
        if recording.external is None and _script_of(run, recording) is None and not _is_by_installed(recording):
            return (
                f"recorded by the script {recording.provenance.script}, which no run of yours on this computer was "
                "begun with: it is not executed, and what it adds to the analysis is left out (--script FILE names it)"
            )
    return None


def _is_corrected(run: RunData) -> bool:
    """Return whether the board corrected the readings of the sensors to calibrate."""
    return any(sensor.mode == "calibrated" for sensor in run.sensors.values())


def _procedure_of(run: RecordedRun, recording: RunData) -> AnyProcedure:
    """Return the procedure of a recording: installed, or defined by the user's own script.

    If neither is available, return an installed procedure for the same kind of readings, because a solution needs no
    script. Raise Refused `another_script` if the script is not that of the recording, and what `kept_script` raises.
    """
    if _is_by_installed(recording):
        return load_procedures()[recording.settings.procedure]
    if (script := _script_of(run, recording)) is not None:
        return script.procedure
    return load_procedures()[CORRECTED if _is_corrected(recording) else RAW]


def _is_by_installed(recording: RunData) -> bool:
    return recording.provenance.script_installed and recording.settings.procedure in load_procedures()


def _script_of(run: RecordedRun, recording: RunData) -> ScriptFile | None:
    """Return the script of a recording if the user has named it, or executed it before."""
    folder = run.path if run.path.is_dir() else run.path.parent
    if _is_by_installed(recording) or (run.script is None and not (folder / SCRIPT).exists()):
        return None
    try:
        return kept_script(folder, recording.provenance.script_identity, run.script)
    except Refused as refused:
        if refused.name == "foreign_script":
            return None
        raise

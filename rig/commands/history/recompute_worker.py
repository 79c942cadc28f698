"""The work of one worker, on any computer, in the recomputation of a history: one recording, and its answer."""

import platform
from dataclasses import dataclass
from pathlib import Path

from rig.config.files.regular_file import UnfitFile
from rig.data.processes.forked_reader import load_hdf5
from rig.data.version import VERSION
from rig.errors import RigError
from rig.history.entered.finished_run import EnteredRecording, recording_of
from rig.history.recompute.result_comparison import Answer, RecomputedResult, State, Unsolved

# Refusals that do not judge a recording: it has no such setting or estimator, or this computer cannot solve it.
NO_JUDGEMENT = ("unknown_setting", "wrong_setting", "unknown_estimator")
LOCAL_ONLY = ("missing_extra", "another_script", "no_script", "not_a_script", "script_failed", "temporary_folder_full")


@dataclass(frozen=True, slots=True)
class Task:
    """The `recordings` of one run as they were entered, to be solved again, and where and how to solve them.

    `key` names the result to compare with. `places` are pairs of computer and folder where the recordings may be.
    `overrides` change settings; `estimator` is None for the procedure's own; `rig_version` must be the worker's.
    """

    key: str
    recordings: tuple[EnteredRecording, ...]
    places: tuple[tuple[str, str], ...]
    overrides: tuple[str, ...]
    estimator: str | None
    rig_version: str = VERSION


def solve_task(task: Task) -> Answer:
    """Return the solution of recordings that equal the entered ones byte by byte, or why there is no solution."""
    if task.rig_version != VERSION:
        return Unsolved("failed", f"the worker has version {VERSION} of the rig, not {task.rig_version}")
    folder = _find_folder(task)
    return folder if isinstance(folder, Unsolved) else _solve(folder, task)


def _find_folder(task: Task) -> Path | Unsolved:
    """Return the newest folder in which all recordings are as entered, or why there is none."""
    if not task.recordings:
        return Unsolved("missing", "the history has no recording of it")
    damaged = None
    for _, path in task.places:
        damages = [_find_damage(Path(path) / recording.name, recording) for recording in task.recordings]
        if all(damage is None for damage in damages):
            return Path(path)
        damaged = damaged or next((damage for damage in damages if damage and damage.state == "damaged"), None)
    places = ", ".join(f"{path} ({computer})" for computer, path in task.places)
    where = f"{places or 'any folder in the history'}, as seen from {platform.node()}"
    return damaged or Unsolved("missing", f"its recordings are not in {where}")


def _find_damage(file: Path, entered: EnteredRecording) -> Unsolved | None:
    """Return why a recording is missing, unreadable or not as entered; None if it is as entered."""
    try:
        recording = recording_of(file)
    except (FileNotFoundError, NotADirectoryError):
        return Unsolved("missing", f"{file} does not exist")
    except (UnfitFile, OSError) as error:
        return Unsolved("damaged", f"{file} cannot be read: {getattr(error, 'strerror', None) or error}")
    if recording.sha256 == entered.sha256:
        return None
    return Unsolved("damaged", f"{file} has the SHA-256 {recording.sha256[:12]}…, not that of its entry")


def _solve(folder: Path, task: Task) -> Answer:
    """Return the result of the recordings in a folder under today's program, or the reason for its absence."""
    from rig.plans.recorded_run import describe_omission, judge_phases, open_run
    from rig.report.document import document_of
    from rig.report.kinds.kind_registry import history_records

    load_hdf5()  # once, for the processes that read all the recordings
    try:
        recorded = open_run(folder, only=[recording.name for recording in task.recordings])
    except (RigError, OSError) as error:
        return Unsolved("failed", f"{folder} cannot be read: {error}")
    try:
        outcome = judge_phases(recorded.override_settings(task.overrides), task.estimator)
    except RigError as error:
        state: State = "unjudged" if error.name in NO_JUDGEMENT else "failed" if error.name in LOCAL_ONLY else "refused"
        return Unsolved(state, f"{folder}: {error}")
    document = document_of(outcome)
    return RecomputedResult(
        document.verdict,
        tuple(check.name for check in document.checks if not check.passed),
        history_records(document),
        describe_omission(recorded),
    )

"""What a worker does, on this computer or another, when everything is solved again: one recording, and its answer."""

import platform
from dataclasses import dataclass
from pathlib import Path

from rig.config.files.regular_file import UnfitFile
from rig.data.version import VERSION
from rig.errors import RigError
from rig.history.again.answer import Answer, RecomputedResult, State, Unsolved
from rig.history.entered.finished import EnteredRecording, recording_of

# Refusals that say nothing of a recording: it has no such setting or estimator, or this computer cannot solve it.
NOT_OF_IT = ("unknown_setting", "wrong_setting", "unknown_estimator")
NOT_HERE = ("missing_extra", "another_script", "no_script", "not_a_script", "script_failed", "temporary_folder_full")


@dataclass(frozen=True, slots=True)
class Task:
    """Recordings to be solved again: by which program, estimator (None: the procedure's own) and settings.

    `key` names the result they are held against; `places` are computer and folder, `recordings` what was entered.
    """

    key: str
    recordings: tuple[EnteredRecording, ...]
    places: tuple[tuple[str, str], ...]
    overrides: tuple[str, ...]
    estimator: str | None
    rig_version: str = VERSION


def solved_again(task: Task) -> Answer:
    """The answer of recordings that are what was entered, to the byte; else why there is none. Writes nothing."""
    if task.rig_version != VERSION:
        return Unsolved("failed", f"the worker has version {VERSION} of the rig, not {task.rig_version}")
    folder = _folder(task)
    return folder if isinstance(folder, Unsolved) else _given(folder, task)


def _folder(task: Task) -> Path | Unsolved:
    """The newest place where every recording is what was entered."""
    if not task.recordings:
        return Unsolved("missing", "the history knows of no recording of it")
    damaged = None
    for _, path in task.places:
        found = [_held(Path(path) / each.name, each) for each in task.recordings]
        if all(each is None for each in found):
            return Path(path)
        damaged = damaged or next((each for each in found if each is not None and each.state == "damaged"), None)
    places = ", ".join(f"{path} ({computer})" for computer, path in task.places)
    where = f"{places or 'any place the history knows'}, as {platform.node()} sees it"
    return damaged or Unsolved("missing", f"its recordings are not in {where}")


def _held(file: Path, entered: EnteredRecording) -> Unsolved | None:
    try:
        found = recording_of(file)
    except (FileNotFoundError, NotADirectoryError):
        return Unsolved("missing", f"{file} does not exist")
    except (UnfitFile, OSError) as error:
        return Unsolved("damaged", f"{file} cannot be read: {getattr(error, 'strerror', None) or error}")
    if found.sha256 == entered.sha256:
        return None
    return Unsolved("damaged", f"{file} has the SHA-256 {found.sha256[:12]}…, not that of its entry")


def _given(folder: Path, task: Task) -> Answer:
    from rig.plans.recorded import judged, left_out, open_run
    from rig.report.document import document_of
    from rig.report.kinds.registry import followed

    try:
        recorded = open_run(folder, only=[each.name for each in task.recordings])
    except (RigError, OSError) as error:
        return Unsolved("failed", f"{folder} cannot be read: {error}")
    try:
        outcome = judged(recorded.judged_by(task.overrides), task.estimator)
    except RigError as error:
        state: State = "unjudged" if error.name in NOT_OF_IT else "failed" if error.name in NOT_HERE else "refused"
        return Unsolved(state, f"{folder}: {error}")
    document = document_of(outcome)
    return RecomputedResult(
        document.verdict,
        tuple(each.name for each in document.checks if not each.passed),
        followed(document),
        left_out(recorded),
    )

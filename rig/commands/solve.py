"""`rig solve`: the result again, from what was recorded."""

from collections.abc import Sequence
from pathlib import Path

from rig.analysis.outcome import Outcome
from rig.data.run_file import RunData, read_run
from rig.data.run_folder import recordings
from rig.errors import Refused
from rig.plans.recorded import procedure_of
from rig.plans.registry import installed
from rig.report.document import document_of
from rig.report.table import print_outcome


def solve(path: Path, estimator: str, overrides: Sequence[str] = (), *, as_json: bool = False) -> int:
    """Recompute the result of a run folder or a run file; prints it, writes nothing. Returns as `run` does.

    `overrides` change what it is judged by, see `RunSettings.with_overrides`.
    """
    outcome = _of_folder(path, estimator, overrides) if path.is_dir() else _of_file(path, estimator, overrides)
    print_outcome(document_of(outcome), as_json=as_json)
    return 0 if outcome.passed else 1


def _of_file(path: Path, estimator: str, overrides: Sequence[str]) -> Outcome:
    """What a recording says by itself."""
    run = read_run(path).judged_by(overrides)
    return procedure_of(run, path.parent).analyse([run], None, estimator)


def _of_folder(folder: Path, estimator: str, overrides: Sequence[str]) -> Outcome:
    """What a run says, phase after phase; one that was to follow and is missing has not passed."""
    runs, corrected = (_recorded(folder, readings, overrides) for readings in ("raw", "calibrated"))
    if not runs and not corrected:
        raise Refused("no_run", f"{folder} holds no run.h5", "Give a run folder or a run file")
    if not runs:
        return procedure_of(corrected[0], folder).analyse(corrected, None, estimator)
    procedure = procedure_of(runs[0], folder)
    outcome = procedure.analyse(runs, None, estimator)
    if corrected:
        return procedure_of(corrected[0], folder).analyse(corrected, outcome, estimator)
    if runs[0].settings.then_verify and procedure.then is not None:
        return installed()[procedure.then].analyse([], outcome, estimator)
    return outcome


def _recorded(folder: Path, readings: str, overrides: Sequence[str]) -> list[RunData]:
    return [read_run(file).judged_by(overrides) for file in recordings(folder, readings)]

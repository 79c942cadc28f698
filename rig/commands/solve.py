"""`rig solve`: the calibration again, from a recording."""

from collections.abc import Sequence
from pathlib import Path

from rig.analysis.outcome import outcome_of
from rig.data.run_file import RunData, read_run
from rig.data.run_folder import CALIBRATION, VERIFICATION, recordings
from rig.errors import Refused
from rig.report.document import document_of
from rig.report.table import print_outcome


def solve(path: Path, estimator: str, overrides: Sequence[str] = (), *, as_json: bool = False) -> int:
    """Recompute the calibration from a run folder or a run file; prints it, writes nothing. Returns as `run` does.

    `overrides` change what it is judged by, see `RunSettings.with_overrides`.
    """
    runs, repeated = _recorded(path, overrides)
    outcome = outcome_of(runs, repeated, estimator)
    print_outcome(document_of(outcome), as_json=as_json)
    return 0 if outcome.passed else 1


def _recorded(path: Path, overrides: Sequence[str]) -> tuple[list[RunData], list[RunData] | None]:
    """The recordings of the calibration, and those of the verification as `outcome_of` takes them."""
    if not path.is_dir():
        run = read_run(path).judged_by(overrides)
        verifies = any(sensor.mode == "calibrated" for sensor in run.sensors.values())
        return ([], [run]) if verifies else ([run], None)
    runs, repeated = (
        [read_run(file).judged_by(overrides) for file in recordings(path, kind)] for kind in (CALIBRATION, VERIFICATION)
    )
    if not runs and not repeated:
        raise Refused("no_run", f"{path} holds no run.h5", "Give a run folder or a run file")
    asked = bool(repeated) or runs[0].settings.then_verify
    return runs, repeated[-1:] if asked else None

"""One run from its configuration to its verdict: the folder, the laboratory, the script, the outcome."""

import importlib
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from rig.analysis.outcome import outcome_of
from rig.commands.laboratory import simulated_laboratory
from rig.config.load import Loaded, load
from rig.data.run_file import RunData, read_run
from rig.data.run_folder import CALIBRATION, VERIFICATION, new_folder, recordings
from rig.errors import Refused
from rig.report.document import document_of
from rig.report.table import print_outcome
from rig.runner.phases import Script, Session, agreed
from rig.station.confirm import ask_operator
from rig.station.view import view


def run(
    config_path: Path,
    overrides: Sequence[str] = (),
    out: Path | None = None,
    *,
    script: Script | None = None,
    assume_yes: bool = False,
    as_json: bool = False,
) -> int:
    """Run the procedure a configuration names, or `script`, in a new run folder. Returns 0 passed, 1 verdict failed."""
    loaded = load(config_path, overrides)
    folder = new_folder(out, loaded)
    return _carry_out(folder, loaded, script, assume_yes=assume_yes, as_json=as_json)


def resume(folder: Path, *, assume_yes: bool = False, as_json: bool = False) -> int:
    """Go on with an interrupted run: sweeps it has finished count, the others are done now. Returns as `run` does."""
    if not (folder / "config.yaml").exists():
        raise Refused("no_run", f"{folder} holds no config.yaml", "Give the folder of an interrupted run")
    if (folder / "result.json").exists():
        raise Refused("already_finished", f"{folder} has its result.json", "Start a new run with `rig run`")
    loaded = load(folder / "config.yaml")
    return _carry_out(folder, loaded, None, assume_yes=assume_yes, as_json=as_json)


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


def _named_script(name: str) -> Script:
    script: Script = getattr(importlib.import_module(f"procedures.{name}"), name)
    return script


def _carry_out(folder: Path, loaded: Loaded, script: Script | None, *, assume_yes: bool, as_json: bool) -> int:
    name = loaded.config.procedure.name
    carried_out = script or _named_script(name)
    # Nobody stands beside a laboratory that this process starts itself, so there nobody need be asked.
    confirm = agreed if assume_yes or loaded.simulated else ask_operator
    with view(folder / "log.txt") as shown, ExitStack() as laboratory:
        session = Session(folder, loaded, shown, confirm, _named_script("verify"))
        if loaded.simulated:
            with session.reported(""):
                laboratory.enter_context(simulated_laboratory(folder / "config.yaml"))
        outcome = session.verify(carried_out) if name == "verify" else session.calibrate(carried_out)
        shown.line(f"written: {folder}")
    print_outcome(document_of(outcome), as_json=as_json)
    return 0 if outcome.passed else 1

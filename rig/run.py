"""One run from its configuration to its verdict: the folder, the laboratory, the script, the outcome."""

import importlib
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from datetime import UTC, datetime
from pathlib import Path

from firmware_host.errors import BoardError
from rig.config.load import Loaded, load
from rig.errors import Fault, Refused, RigError
from rig.launch import simulated_laboratory
from rig.opening import open_rig
from rig.procedure import Rig
from rig.progress import View, view
from rig.recording import make_plain, read_run
from rig.report.outcome import print_outcome, solved_document, write_outcome

Script = Callable[[Rig], None]


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
    folder = _new_folder(out, loaded)
    (folder / "config.yaml").write_text(loaded.text, encoding="utf-8")
    return _carry_out(folder, loaded, script or _named_script(loaded), assume_yes=assume_yes, as_json=as_json)


def resume(folder: Path, *, assume_yes: bool = False, as_json: bool = False) -> int:
    """Go on with an interrupted run: sweeps it has finished count, the others are done now. Returns as `run` does."""
    if not _recordings(folder):
        raise Refused("no_run", f"{folder} holds no run.h5", "Give the folder of an interrupted run")
    if (folder / "result.json").exists():
        raise Refused("already_finished", f"{folder} has its result.json", "Start a new run with `rig run`")
    loaded = load(folder / "config.yaml")
    for file in _recordings(folder):
        make_plain(file)  # if the run was killed, only readers that know about it could open its file
    return _carry_out(folder, loaded, _named_script(loaded), assume_yes=assume_yes, as_json=as_json)


def solve(path: Path, estimator: str, *, as_json: bool = False) -> int:
    """Recompute the calibration from a run folder or a run file; prints it, writes nothing. Returns as `run` does."""
    files = _recordings(path) if path.is_dir() else [path]
    if not files:
        raise Refused("no_run", f"{path} holds no run.h5", "Give a run folder or a run file")
    document = solved_document([read_run(file) for file in files], estimator)
    print_outcome(document, as_json=as_json)
    return 0 if document["verdict"] == "pass" else 1


def _recordings(folder: Path) -> list[Path]:
    """The recordings of a run folder in the order they were made: run.h5, run-2.h5, …"""
    return sorted(folder.glob("run*.h5"), key=lambda path: (len(path.name), path.name))


def _finished_sweeps(files: Sequence[Path]) -> frozenset[int]:
    """The indices of the sweeps the recordings hold from start to end."""
    events = (event for file in files for event in read_run(file).events)
    return frozenset(event.detail["sweep"]["index"] for event in events if event.name == "sweep_finished")


def _named_script(loaded: Loaded) -> Script:
    name = loaded.config.procedure.name
    script: Script = getattr(importlib.import_module(f"procedures.{name}"), name)
    return script


def _new_folder(out: Path | None, loaded: Loaded) -> Path:
    stamp = datetime.now(UTC).strftime("%Y-%m-%dT%H-%M-%SZ")
    folder = out or Path(loaded.config.output.folder) / f"{stamp}-{loaded.config.procedure.name}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        empty = not any(folder.iterdir())
    except OSError as error:
        raise Refused("run_folder", f"{folder} cannot be made: {error}", "Choose another with --out") from error
    if not empty:
        raise Refused("run_folder", f"{folder} is not empty", f"Choose another with --out, or `rig resume {folder}`")
    return folder


def _carry_out(folder: Path, loaded: Loaded, script: Script, *, assume_yes: bool, as_json: bool) -> int:
    before = _recordings(folder)
    recording = folder / (f"run-{len(before) + 1}.h5" if before else "run.h5")
    # Nobody stands beside a laboratory that this process starts itself, so there nobody need be asked.
    confirm = _agree if assume_yes or loaded.world else _ask_operator
    with view(folder / "log.txt") as shown, _reported(shown, folder):
        with (
            simulated_laboratory(folder / "config.yaml") if loaded.world else nullcontext(),
            open_rig(loaded, recording, shown, confirm, _finished_sweeps(before)) as rig,
        ):
            script(rig)
        document = solved_document([read_run(file) for file in _recordings(folder)])
        write_outcome(folder, document)
        shown.line(f"written: {folder}")
    print_outcome(document, as_json=as_json)
    return 0 if document["verdict"] == "pass" else 1


@contextmanager
def _reported(shown: View, folder: Path) -> Iterator[None]:
    """Whatever ends a run early also goes into its log; an interruption says how to go on."""
    try:
        yield
    except (RigError, BoardError) as error:
        fault = error if isinstance(error, RigError) else Fault(error.name, error.what, error.remedy)
        shown.log(str(fault))
        if fault.exit_status == Fault.exit_status:
            shown.line(f"the data are kept in {folder}; when it is mended, go on with: rig resume {folder}")
        raise fault from error
    except KeyboardInterrupt:
        text = f"interrupted: the arm is stopped, the data are kept in {folder}. Go on with: rig resume {folder}"
        shown.log(text)
        raise KeyboardInterrupt(text) from None


def _agree(announcement: Sequence[str]) -> bool:
    return True


def _ask_operator(announcement: Sequence[str]) -> bool:
    """Show what will move and wait for a yes; where there is no terminal, there is nobody to say it."""
    for line in announcement:
        print(line, file=sys.stderr)
    if not sys.stdin.isatty():
        return False
    print("Type yes to start: ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() == "yes"

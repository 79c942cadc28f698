"""One run from its configuration to its verdict: the folder, the laboratory, the script, the outcome."""

import importlib
import shlex
import sys
import traceback
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
    return _carry_out(folder, loaded, script or _named_script(loaded), assume_yes=assume_yes, as_json=as_json)


def resume(folder: Path, *, assume_yes: bool = False, as_json: bool = False) -> int:
    """Go on with an interrupted run: sweeps it has finished count, the others are done now. Returns as `run` does."""
    if not (folder / "config.yaml").exists():
        raise Refused("no_run", f"{folder} holds no config.yaml", "Give the folder of an interrupted run")
    if (folder / "result.json").exists():
        raise Refused("already_finished", f"{folder} has its result.json", "Start a new run with `rig run`")
    loaded = load(folder / "config.yaml")
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


def _named_script(loaded: Loaded) -> Script:
    name = loaded.config.procedure.name
    script: Script = getattr(importlib.import_module(f"procedures.{name}"), name)
    return script


def _new_folder(out: Path | None, loaded: Loaded) -> Path:
    """A run folder that holds nothing but the configuration as used."""
    stamp = datetime.now(UTC).strftime("%Y-%m-%dT%H-%M-%SZ")
    folder = out or Path(loaded.config.output.folder) / f"{stamp}-{loaded.config.procedure.name}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        empty = not any(folder.iterdir())
        if empty:
            (folder / "config.yaml").write_text(loaded.text, encoding="utf-8")
    except OSError as error:
        raise Refused("run_folder", f"{folder} cannot be written: {error}", "Choose another with --out") from error
    if not empty:
        raise Refused(
            "run_folder", f"{folder} is not empty", f"Choose another with --out, or go on with: {_resuming(folder)}"
        )
    return folder


def _carry_out(folder: Path, loaded: Loaded, script: Script, *, assume_yes: bool, as_json: bool) -> int:
    earlier = _recordings(folder)
    recording = folder / (f"run-{len(earlier) + 1}.h5" if earlier else "run.h5")
    # Nobody stands beside a laboratory that this process starts itself, so there nobody need be asked.
    confirm = _agree if assume_yes or loaded.world else _ask_operator
    with view(folder / "log.txt") as shown:
        with (
            _reported(
                shown, folder, f"the data are kept in {folder}; when it is mended, go on with: {_resuming(folder)}"
            ),
            simulated_laboratory(folder / "config.yaml") if loaded.world else nullcontext(),
            open_rig(loaded, recording, shown, confirm, [read_run(file) for file in earlier]) as rig,
        ):
            script(rig)
            shown.line(rig.summary())
        repeating = f"the data are kept in {folder}; to repeat refused sweeps: {_resuming(folder)}"
        with _reported(shown, folder, repeating):
            for file in earlier:
                make_plain(file)  # if the run was killed, only readers that know about it could open its file
            document = solved_document([read_run(file) for file in _recordings(folder)])
            write_outcome(folder, document)
        shown.line(f"written: {folder}")
    print_outcome(document, as_json=as_json)
    return 0 if document["verdict"] == "pass" else 1


@contextmanager
def _reported(shown: View, folder: Path, advice: str) -> Iterator[None]:
    """Whatever ends a run early also goes into its log; a fault is followed by `advice`, an interruption by its own."""
    try:
        yield
    except (RigError, BoardError) as error:
        if isinstance(error, Refused):
            shown.log(str(error))
            raise
        fault = Fault(error.name, _with_notes(error.what, error), error.remedy)
        shown.log(str(fault))
        shown.line(advice)
        raise fault from error
    except OSError as error:
        fault = Fault(
            "system", f"{folder} cannot be used ({error})", f"Mend that, then go on with: {_resuming(folder)}"
        )
        shown.log(str(fault))
        raise fault from error
    except KeyboardInterrupt as interrupt:
        stopped = _with_notes("interrupted", interrupt)
        text = f"{stopped}; the data are kept in {folder}. Go on with: {_resuming(folder)}"
        shown.log(text)
        raise KeyboardInterrupt(text) from None
    except Exception:
        shown.log(traceback.format_exc())
        raise


def _with_notes(what: str, error: BaseException) -> str:
    """What happened, and what the arm added on its way out about its stop."""
    return "; ".join([what, *getattr(error, "__notes__", ())])


def _resuming(folder: Path) -> str:
    return f"rig resume {shlex.quote(str(folder))}"


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

"""Whether what a history knows is still what lies on the disk."""

import platform
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rig.history.finished import content_sha256, recording_of
from rig.history.store import Kept

State = Literal["ok", "changed", "missing", "elsewhere"]


@dataclass(frozen=True, slots=True)
class Found:
    """What became of one thing: a recording's `what` is its path, an entry's its number."""

    run_id: int
    what: str
    state: State
    why: str = ""

    @property
    def wrong(self) -> bool:
        """Whether something is lost or not what it was."""
        return self.state in ("changed", "missing")


def examined(runs: Iterable[Kept], computer: str | None = None) -> Iterator[Found]:
    """Every entry against its hash, every recording against its own, wherever its folder was seen last.

    What was entered on another computer and is not to be seen from here is `elsewhere`.
    """
    here = computer or platform.node()
    for run in runs:
        if content_sha256(run.result) != run.content_sha256:
            yield Found(run.run_id, f"run {run.run_id}", "changed", "the result in the history is not what was entered")
        else:
            yield Found(run.run_id, f"run {run.run_id}", "ok")
        yield from _recordings(run, here)
        yield from _certificates(run)


def _recordings(run: Kept, here: str) -> Iterator[Found]:
    folders = [Path(path) for _, path in run.places]
    folder = next((path for path in folders if path.is_dir()), None)
    if folder is None:
        elsewhere = [name for name, _ in run.places if name != here]
        state: State = "elsewhere" if elsewhere else "missing"
        why = f"on {elsewhere[0]}" if elsewhere else "the folder is not there any more"
        if run.recordings:
            yield Found(run.run_id, str(folders[0]), state, why)
        return
    for recording in run.recordings:
        file = folder / recording.name
        try:
            now = recording_of(file)
        except OSError as error:
            yield Found(run.run_id, str(file), "missing", error.strerror or str(error))
            continue
        if now == recording:
            yield Found(run.run_id, str(file), "ok")
        else:
            yield Found(run.run_id, str(file), "changed", f"SHA-256 {now.sha256[:12]}…, was {recording.sha256[:12]}…")


def _certificates(run: Kept) -> Iterator[Found]:
    """Of those in the folder; one that was written elsewhere is not looked for."""
    folder = next((Path(path) for _, path in run.places if Path(path).is_dir()), None)
    if folder is None:
        return
    entered = {file for certificate in run.certificates for file in certificate.files}
    for name in sorted({name for name, _ in entered}):
        file = folder / name
        if not file.is_file():
            continue
        now = recording_of(file).sha256
        if (name, now) in entered:
            yield Found(run.run_id, str(file), "ok")
        else:
            yield Found(run.run_id, str(file), "changed", f"SHA-256 {now[:12]}…, which no certificate of this run had")

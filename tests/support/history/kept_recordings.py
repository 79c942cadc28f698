"""A history whose recordings exist: copies of frozen ones, each entered as a run of its own."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

from rig.data.result_file import ResultDocument
from rig.history.entered.finished_run import FinishedRun, compact, read_finished_run
from rig.history.entered.issued_certificate import IssuedCertificate
from rig.history.store import History
from support.paths import RECORDINGS

CALIBRATION = RECORDINGS / "six_observation"  # the quickest to solve: a twentieth of a second
Change = Callable[[ResultDocument], ResultDocument]


def keep(history: History, folder: Path, source: Path = CALIBRATION, change: Change | None = None) -> FinishedRun:
    """Copy recordings to `folder` and enter their result, with any `change`, dated a day after the last entry."""
    shutil.copytree(source, folder)
    run = read_finished_run(folder)
    document = _later(run.document, len(list(history.kept())))
    document = document if change is None else change(document)
    run = replace(run, document=document, text=compact(json.loads(document.text())), certificate=None)
    history.enter(run)
    return run


def certify(history: History, run: FinishedRun, number: str, *, marks: str = "", replaces: str | None = None) -> None:
    """Enter a certificate of a run, by default without a mark, so that it can be relied on."""
    issued = IssuedCertificate(number, "Calibration certificate", "2026-01-02", replaces, marks)
    assert history.certify(run.content_sha256, issued)


def _later(document: ResultDocument, days: int) -> ResultDocument:
    started = datetime.fromisoformat(document.provenance.started_utc) + timedelta(days=days)
    provenance = document.provenance.model_copy(update={"started_utc": started.isoformat()})
    return document.model_copy(update={"provenance": provenance})

"""What a finished run leaves in its folder. A new document is a file with its writer, and its line in `WRITERS`."""

import importlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Protocol

from rig.analysis.outcome import Outcome
from rig.config.files.written_file import replace_together
from rig.data.result_file import ResultDocument, write_result
from rig.data.run_folder import RESULT
from rig.report.document import document_of
from rig.report.findings.kind import Without
from rig.report.kinds.registry import kinds
from rig.station.events import DocumentWritten, RunEvent

# `module:function`, imported when a run has ended.
WRITERS: Sequence[str] = (
    "rig.report.header:write_header",
    "rig.report.certificate.writer:write_certificate",
)


class Writer(Protocol):
    """Writes files of its own into the run folder, by `rig.config.files.written_file`; returns what to tell of it.

    `outcome` has everything the analysis found, curves too; `document` is what `result.json` will say of it.
    """

    def __call__(self, outcome: Outcome, document: ResultDocument, folder: Path, /) -> Iterable[RunEvent]: ...


def write_outcome(folder: Path, outcome: Outcome) -> Iterator[RunEvent]:
    """All documents and `result.json`, which ends the run; yields what to tell of them when they are there.

    No document lies there without the result: on a full disk none of them takes its place, and the run can be resumed.
    """
    document = document_of(outcome)
    pictures = dict.fromkeys(kind.figures for kind in kinds() if not isinstance(kind.figures, Without))
    told: list[RunEvent] = []
    with replace_together():
        for name in (*pictures, *WRITERS):
            told += _writer(name)(outcome, document, folder)
        write_result(document, folder)
    yield from told
    yield DocumentWritten(folder / RESULT)


def _writer(name: str) -> Writer:
    module, function = name.split(":")
    writer: Writer = getattr(importlib.import_module(module), function)
    return writer

"""Writes the documents of a finished run. A new document is a file with its writer, and its line in `WRITERS`."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import Protocol

from rig.analysis.outcome import Outcome
from rig.config.files.safe_writing import replace_together
from rig.data.result_file import ResultDocument, write_result
from rig.data.run_folder import RESULT
from rig.report.document import document_of
from rig.report.findings.result_kind import NoOutlet
from rig.report.kinds.kind_registry import kinds
from rig.station.events import DocumentWritten, RunEvent

# `module:function`, imported when a run has ended.
WRITERS: Sequence[str] = (
    "rig.report.header:write_header",
    "rig.report.certificate.certificate_page:write_certificate",
)


class Writer(Protocol):
    """A function that writes files of its own into the run folder, by `rig.config.files.safe_writing`.

    `outcome` has everything that the analysis computed, curves too; `document` is the content of `result.json`. The
    returned events are passed on to the operator.
    """

    def __call__(self, outcome: Outcome, document: ResultDocument, folder: Path, /) -> Iterable[RunEvent]: ...


def write_outcome(folder: Path, outcome: Outcome) -> Iterator[RunEvent]:
    """Write all documents, then `result.json`, which ends the run; yield the events once all are in place.

    On a full disk no document is put in place, and the run can be resumed.
    """
    document = document_of(outcome)
    pictures = dict.fromkeys(kind.figures for kind in kinds() if not isinstance(kind.figures, NoOutlet))
    events: list[RunEvent] = []
    with replace_together():
        for name in (*pictures, *WRITERS):
            write: Writer = resolve_name(name)
            events += write(outcome, document, folder)
        write_result(document, folder)
    yield from events
    yield DocumentWritten(folder / RESULT)

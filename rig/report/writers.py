"""What a finished run leaves in its folder. A new document is a file with its writer, and its line in `WRITERS`."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Protocol

from rig.analysis.outcome import Outcome
from rig.data.result_file import ResultDocument, write_result
from rig.report.document import document_of
from rig.report.figures import write_figures
from rig.report.header import write_header


class Writer(Protocol):
    """Writes files of its own into the run folder; returns what to tell the operator.

    `outcome` has everything the analysis found, curves too; `document` is what `result.json` will say of it.
    """

    def __call__(self, outcome: Outcome, document: ResultDocument, folder: Path, /) -> Iterable[str]: ...


WRITERS: Sequence[Writer] = (
    write_figures,
    write_header,
)


def write_outcome(folder: Path, outcome: Outcome) -> Iterator[str]:
    """All documents, then `result.json`, which ends the run; yields what to tell the operator."""
    document = document_of(outcome)
    for write in WRITERS:
        yield from write(outcome, document, folder)
    write_result(document, folder)

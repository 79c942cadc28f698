"""Writes `certificate.html` into each run folder."""

from pathlib import Path

from rig.analysis.outcome import Outcome
from rig.config.files.safe_writing import write_new
from rig.data.result_file import ResultDocument
from rig.data.run_folder import CERTIFICATE
from rig.report.certificate.certificate_page import certificate_page
from rig.report.certificate.content import certificate_of
from rig.report.certificate.statements import folder_statements
from rig.station.events import DocumentWritten, RunEvent


def write_certificate(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """Write the certificate for any verdict. If the measurement is unfit, every page names the failed checks."""
    path = folder / CERTIFICATE
    write_new(path, certificate_page(certificate_of(document, folder_statements(folder))))
    return (DocumentWritten(path),)

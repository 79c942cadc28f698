"""A finished run in its folder, ready to be entered into a history."""

import hashlib
import json
import os
import platform
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.config.files.regular_file import RECORDING_MAX_BYTES, UnfitFile, open_regular_file, read_regular_file
from rig.data.run_folder import CONFIG, RESULT, SCRIPT, SCRIPT_IDENTITY, recordings
from rig.data.validation import refuse_duplicate_keys
from rig.errors import Refused
from rig.history.entered.issued_certificate import IssuedCertificate, issue_certificate

if TYPE_CHECKING:
    from rig.config.load import Loaded
    from rig.data.result_file import ResultDocument
    from rig.report.certificate.statements import StatedFacts

PAGE, HEADER = "certificate.html", "calibration.h"
DOCUMENTS = (RESULT, CONFIG, SCRIPT, SCRIPT_IDENTITY, HEADER)
CERTIFICATES = (PAGE, "certificate.pdf", "certificate.xml")
CHUNK_BYTES = 1 << 20
MAX_PAGE_BYTES = 64_000_000  # six sweeps have 30,000


@dataclass(frozen=True, slots=True)
class EnteredRecording:
    """A recording's name in the run folder, its size, and its SHA-256 in hexadecimal."""

    name: str
    size: int
    sha256: str


@dataclass(frozen=True, slots=True)
class FinishedRun:
    """A finished run.

    - text: result.json in compact form.
    - document: the content of result.json.
    - rig: the rig's name.
    - check_standards: serial numbers of the sensors that monitor the rig.
    - simulated: whether the laboratory is simulated.
    - computer, path: location of the folder.
    - recordings: the recordings in the folder.
    - operator, note: statements of the configuration.
    - certificate: the certificate in the folder, if any.
    - documents: name and checksum of each document, as `document_sha256` returns it.
    """

    text: str
    document: "ResultDocument"
    rig: str
    check_standards: tuple[str, ...]
    simulated: bool
    computer: str
    path: str
    recordings: tuple[EnteredRecording, ...]
    operator: str | None = None
    note: str | None = None
    certificate: IssuedCertificate | None = None
    documents: tuple[tuple[str, str], ...] = ()

    @property
    def content_sha256(self) -> str:
        """The checksum of the result without its time of computation, so that equal numbers have equal checksums."""
        return content_sha256(self.text)


def read_finished_run(folder: Path, document: "ResultDocument | None" = None) -> FinishedRun:
    """Return the run in `folder` with its result.json, or with the `document` computed from its recordings.

    Raise the errors of `read_result`; OSError if a recording cannot be read.
    """
    from rig.config.judging.judging_sections import HistorySection
    from rig.data.recording.provenance import calls_itself_simulated
    from rig.data.result_file import SIZE_MAX_BYTES, read_result
    from rig.report.certificate.statements import StatedFacts, configuration_statements

    if document is None:
        document = read_result(folder)
        text = read_regular_file(folder / RESULT, SIZE_MAX_BYTES)
    else:
        text = document.text().encode()
    loaded = read_configuration(folder)
    section = HistorySection() if loaded is None else loaded.config.history
    simulated = loaded is not None and loaded.simulated
    provenance = document.provenance
    certificate = _certificate(folder, document, StatedFacts() if loaded is None else configuration_statements(loaded))
    return FinishedRun(
        text=compact(json.loads(text)),
        document=document,
        rig=section.rig or provenance.arm_serial_number,
        check_standards=section.check_standards,
        simulated=simulated or calls_itself_simulated(provenance.arm_software),
        computer=platform.node(),
        path=os.fsencode(folder.resolve()).decode("utf-8", "backslashreplace"),  # databases accept no other bytes
        recordings=tuple(
            recording_of(file) for readings in ("raw", "calibrated") for file in recordings(folder, readings)
        ),
        operator=section.operator,
        note=section.note,
        certificate=certificate,
        documents=(
            *((name, sha256) for name in DOCUMENTS if (sha256 := document_sha256(folder, name)) is not None),
            *(() if certificate is None else certificate.files),
        ),
    )


def document_sha256(folder: Path, name: str) -> str | None:
    """Return the checksum of a file in a run folder, for result.json its `content_sha256`; None without the file.

    Raise OSError, and UnfitFile for a file that cannot belong to a run.
    """
    try:
        content = read_regular_file(folder / name, MAX_PAGE_BYTES)
    except FileNotFoundError:
        return None
    if name == RESULT:
        try:
            return content_sha256(content.decode())
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise UnfitFile("it is not a result") from error
    return hashlib.sha256(content).hexdigest()


def recording_of(file: Path) -> EnteredRecording:
    """Return a recording with its hash. Raise OSError, and UnfitFile for a file that cannot belong to a run."""
    digest, size = hashlib.sha256(), 0
    with open_regular_file(file, RECORDING_MAX_BYTES) as stream:
        while chunk := stream.read(CHUNK_BYTES):
            digest.update(chunk)
            size += len(chunk)
    return EnteredRecording(file.name, size, digest.hexdigest())


def compact(document: Any) -> str:
    """Return JSON text without white space."""
    return json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def content_sha256(text: str) -> str:
    """Return the hash of a result.json's content, with sorted keys and without `solved_utc`.

    Raise ValueError for a text that is not JSON or has a duplicate key, and other errors for a result of another form.
    """
    document = json.loads(text, object_pairs_hook=refuse_duplicate_keys)
    document["provenance"].pop("solved_utc", None)
    canonical = json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(canonical.encode()).hexdigest()


def read_configuration(folder: Path) -> "Loaded | None":
    """Return the folder's configuration; None if there is none, or if this program refuses the configuration.

    A configuration is refused, for example, for an unknown key; the result is entered nevertheless.
    """
    if not (folder / CONFIG).exists():
        return None
    from rig.config.load import load

    try:
        return load(folder / CONFIG, sections=None)
    except Refused:
        return None


def _certificate(folder: Path, document: "ResultDocument", stated: "StatedFacts") -> IssuedCertificate | None:
    """Return the certificate in the folder if its content, not only its number, matches this result.

    An amended certificate is entered when it is made, not here.
    """
    try:
        page = read_regular_file(folder / PAGE, MAX_PAGE_BYTES)
    except (UnfitFile, OSError):
        return None
    from rig.report.certificate.certificate_page import certificate_page
    from rig.report.certificate.content import certificate_of

    certificate = certificate_of(document, stated)
    return issue_certificate(certificate, {PAGE: page}) if certificate_page(certificate).encode() == page else None

"""A finished run as its folder has it: what is entered into a history."""

import hashlib
import json
import os
import platform
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.config.files.regular_file import RECORDING_MAX_BYTES, UnfitFile, open_regular_file, read_regular_file
from rig.data.checked import refuse_duplicate_keys
from rig.data.run_folder import CONFIG, RESULT, SCRIPT, SCRIPT_IDENTITY, recordings
from rig.errors import Refused
from rig.history.entered.issued import Issued, issued_certificate

if TYPE_CHECKING:
    from rig.config.load import Loaded
    from rig.data.result_file import ResultDocument
    from rig.report.certificate.statements import Stated

PAGE, HEADER = "certificate.html", "calibration.h"
DOCUMENTS = (RESULT, CONFIG, SCRIPT, SCRIPT_IDENTITY, HEADER)
CERTIFICATES = (PAGE, "certificate.pdf", "certificate.xml")
CHUNK_BYTES = 1 << 20
PAGE_MAX_BYTES = 64_000_000  # of a run of six sweeps it has 30,000


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording's name in the run folder, its size, and its SHA-256 in hexadecimal."""

    name: str
    size: int
    sha256: str


@dataclass(frozen=True, slots=True)
class Finished:
    """`text` is all of result.json, compact; `rig` what the rig is called; `computer` and `path` where it lies.

    `check_standards` are the serial numbers of sensors that are there to watch the rig; `operator` and `note` what the
    configuration says of them; `certificate` is that in the folder, and `documents` what else a run leaves there: name
    and SHA-256, of result.json that of what it says.
    """

    text: str
    document: "ResultDocument"
    rig: str
    check_standards: tuple[str, ...]
    simulated: bool
    computer: str
    path: str
    recordings: tuple[Recording, ...]
    operator: str | None = None
    note: str | None = None
    certificate: Issued | None = None
    documents: tuple[tuple[str, str], ...] = ()

    @property
    def content_sha256(self) -> str:
        """Checksum of the result without the time it was computed: the same numbers again are no other result."""
        return content_sha256(self.text)


def finished_run(folder: Path, document: "ResultDocument | None" = None) -> Finished:
    """The run in `folder`, with its result.json or, in place of it, the `document` that was computed from it.

    Raises Refused as `read_result`; OSError when a recording cannot be read.
    """
    from rig.config.judging.judging_sections import HistorySection
    from rig.data.recording.provenance import calls_itself_simulated
    from rig.data.result_file import SIZE_MAX_BYTES, read_result
    from rig.report.certificate.statements import Stated, of_configuration

    if document is None:
        document = read_result(folder)
        text = read_regular_file(folder / RESULT, SIZE_MAX_BYTES)
    else:
        text = document.text().encode()
    loaded = configured_in(folder)
    section = HistorySection() if loaded is None else loaded.config.history
    simulated = loaded is not None and loaded.simulated
    provenance = document.provenance
    certificate = _certificate(folder, document, Stated() if loaded is None else of_configuration(loaded))
    return Finished(
        text=compact(json.loads(text)),
        document=document,
        rig=section.rig or provenance.arm_serial_number,
        check_standards=section.check_standards,
        simulated=simulated or calls_itself_simulated(provenance.arm_software),
        computer=platform.node(),
        path=os.fsencode(folder.resolve()).decode("utf-8", "backslashreplace"),  # no database takes other bytes
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
    """Checksum of a file that a run leaves beside its recordings, of result.json that of what it says; None without it.

    Raises OSError, and UnfitFile for what is no file of a run.
    """
    try:
        content = read_regular_file(folder / name, PAGE_MAX_BYTES)
    except FileNotFoundError:
        return None
    if name == RESULT:
        try:
            return content_sha256(content.decode())
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise UnfitFile("it is no result") from error
    return hashlib.sha256(content).hexdigest()


def recording_of(file: Path) -> Recording:
    """A recording with its hash. Raises OSError, and UnfitFile for what is no file of a run."""
    digest, size = hashlib.sha256(), 0
    with open_regular_file(file, RECORDING_MAX_BYTES) as stream:
        while chunk := stream.read(CHUNK_BYTES):
            digest.update(chunk)
            size += len(chunk)
    return Recording(file.name, size, digest.hexdigest())


def compact(document: Any) -> str:
    """JSON with nothing between its words."""
    return json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def content_sha256(text: str) -> str:
    """The hash of a result.json that tells it from others; in the order of the alphabet, without `solved_utc`.

    Raises ValueError if it is no JSON or a key stands twice, and what else a result of another form leads to.
    """
    document = json.loads(text, object_pairs_hook=refuse_duplicate_keys)
    document["provenance"].pop("solved_utc", None)
    said = json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(said.encode()).hexdigest()


def configured_in(folder: Path) -> "Loaded | None":
    """Return the folder's configuration.

    None if there is none, or if this program refuses it, by a key that it does not know: a result is entered all the
    same.
    """
    if not (folder / CONFIG).exists():
        return None
    from rig.config.load import load

    try:
        return load(folder / CONFIG, sections=None)
    except Refused:
        return None


def _certificate(folder: Path, document: "ResultDocument", stated: "Stated") -> Issued | None:
    """The page in the folder, if it is to the letter the certificate of this result: its number alone proves nothing.

    An amended one was entered when it was made.
    """
    try:
        page = read_regular_file(folder / PAGE, PAGE_MAX_BYTES)
    except (UnfitFile, OSError):
        return None
    from rig.report.certificate.content import certificate_of
    from rig.report.certificate.page import certificate_page

    certificate = certificate_of(document, stated)
    return issued_certificate(certificate, {PAGE: page}) if certificate_page(certificate).encode() == page else None

"""Inspection of a large signed file in a process of its own, because a crafted one takes 150 times its length."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Any, cast

import numpy as np

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.data.processes.reading_parts import Part
from rig.data.processes.reading_process import ReadingLimits, UnreadableFile, read_apart
from rig.errors import Refused
from rig.report.signatures.findings import FileInspection, SignatureReport, not_as_signed
from rig.report.signatures.inspection import inspect_file, may_be_signed
from rig.report.signatures.reason import Reason
from rig.report.signatures.trust import Trust

# A certificate with two of the largest revocation lists takes 300 MB, and three seconds of a slow processor.
LIMITS = ReadingLimits(memory_bytes=380 << 20, processor_s=15.0, idle_s=20.0, written_bytes=64 << 20)
LARGE_BYTES = 1_000_000  # ten times what a certificate of one sensor takes without revocation lists
READER = f"{__name__}:read_inspection"


def inspect_within_limits(file: Path, content: bytes, trust: Trust, limits: ReadingLimits = LIMITS) -> FileInspection:
    """Return the inspection of a file with this `content`: its signatures and its problems.

    A PDF or an XML of more than `LARGE_BYTES` is parsed in a process of its own, with these `limits` of time and
    memory. A file whose parsing exceeds them has the problem `not_as_signed`. Raise Refused `missing_extra`,
    `temporary_folder_full`.
    """
    if len(content) <= LARGE_BYTES or not may_be_signed(content):
        return inspect_file(file.name, content, trust)
    arguments = {
        "content_sha256": sha256(content).hexdigest(),
        "certificates": [certificate.hex() for certificate in trust.certificates],
        "signer": trust.signer,
    }
    try:
        return _decode(read_apart(READER, file, arguments, limits))
    except UnreadableFile as error:
        return FileInspection(problems=(not_as_signed(file.name, str(error)),))


def read_inspection(file: Path, content_sha256: str, certificates: Sequence[str], signer: str | None) -> Iterator[Part]:
    """Yield the inspection of a file as one dict, then the content of each attached file as bytes.

    `certificates` are those of `Trust`, in hexadecimal digits. Raise `UnfitFile` if the file is not as it was when the
    caller read it, whose SHA-256 is `content_sha256`; Refused `missing_extra`.
    """
    content = read_regular_file(file, file.stat().st_size)
    if sha256(content).hexdigest() != content_sha256:
        raise UnfitFile("it changed while it was read")
    inspection = inspect_file(file.name, content, Trust(tuple(map(bytes.fromhex, certificates)), signer))
    yield {
        "signatures": [_encode(signature) for signature in inspection.signatures],
        "problems": [problem.problem for problem in inspection.problems],
        "attached": list(inspection.attached),
    }
    for attachment in inspection.attached.values():
        yield np.frombuffer(attachment, dtype=np.uint8)


def _encode(signature: SignatureReport) -> dict[str, Any]:
    when = None if signature.when is None else signature.when.isoformat()
    return {**asdict(signature), "when": when}


def _decode(parts: Sequence[Part]) -> FileInspection:
    """Return the inspection whose `parts` `read_inspection` yields."""
    head = cast("dict[str, Any]", parts[0])
    contents = (cast("np.ndarray[Any, Any]", part).tobytes() for part in parts[1:])
    return FileInspection(
        tuple(map(_decode_signature, head["signatures"])),
        dict(zip(head["attached"], contents, strict=True)),
        tuple(Refused(*problem) for problem in head["problems"]),
    )


def _decode_signature(entry: Mapping[str, Any]) -> SignatureReport:
    when = None if entry["when"] is None else datetime.fromisoformat(entry["when"])
    fields: dict[str, Any] = {**entry, "when": when, "reason": Reason(**entry["reason"])}
    return SignatureReport(**fields)

"""The signatures of a PDF: every byte of it must be signed, but for the signature itself."""

import io
import logging
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from hashlib import sha256
from typing import Any

from asn1crypto import parser
from asn1crypto.crl import CertificateList
from asn1crypto.x509 import Certificate
from cryptography.x509 import load_der_x509_certificate
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.diff_analysis import ModificationLevel
from pyhanko.sign.validation import validate_pdf_signature
from pyhanko.sign.validation.status import SignatureCoverageLevel
from pyhanko_certvalidator import ValidationContext

from rig.errors import Refused
from rig.report.signatures.findings import Looked, Seen, not_as_signed, not_signed, signer_not_trusted, untrusted
from rig.report.signatures.reason import Reason


def seen_pdf(name: str, content: bytes, trust: Sequence[bytes]) -> Looked:
    """A PDF's signatures. Raises whatever its reader does of a damaged one."""
    for library in ("pyhanko", "pyhanko_certvalidator"):
        logging.getLogger(library).setLevel(logging.CRITICAL)  # whom they do not trust is said here, by name
    reader = PdfFileReader(io.BytesIO(content), strict=True)
    signatures = reader.embedded_regular_signatures
    if not signatures:
        return Looked(problems=(not_signed(name),))
    found: list[Seen] = []
    problems: list[Refused] = []
    for each in signatures:
        status = _status(each, trust)
        problems += [not_as_signed(name, why) for why in _wrong(each, status, content, last=each is signatures[-1])]
        seen, why = _seen(each, status, trust, _lists(reader))
        found.append(seen)
        if why:
            problems.append(signer_not_trusted(name, seen.signer, why))
    return Looked(tuple(found), {} if problems else dict(_attached(reader)), tuple(problems))


def _status(signature: Any, trust: Sequence[bytes]) -> Any:
    """pyHanko's, which trusts no signer here, and time servers as `trust` says."""
    nobody = ValidationContext(trust_roots=[], allow_fetching=False)
    servers = ValidationContext(trust_roots=list(map(Certificate.load, trust)), allow_fetching=False)
    return validate_pdf_signature(signature, nobody, servers)


def _wrong(signature: Any, status: Any, content: bytes, *, last: bool) -> Iterator[str]:
    if not status.intact:
        yield "bytes that are signed have changed"
    elif not status.valid:
        yield "its signature is not by the key of its certificate"
    stamp = status.timestamp_validity
    if stamp is not None and not (stamp.intact and stamp.valid):
        yield "its time stamp is of something else"
    if last and status.coverage != SignatureCoverageLevel.ENTIRE_FILE:
        yield "something was added after the signature"
    elif not last and (status.docmdp_ok is False or status.modification_level == ModificationLevel.OTHER):
        yield "something was changed after a signature"
    start, length, end, _ = map(int, signature.byte_range)
    held = content[start + length : end]
    written = signature.pkcs7_content.hex()
    if held not in (f"<{written}>".encode(), f"<{written.upper()}>".encode()):
        yield "beside its signature there is something else"
    elif signature.pkcs7_content[parser.peek(signature.pkcs7_content) :].strip(b"\0"):
        yield "behind its signature there is something else"


def _seen(signature: Any, status: Any, trust: Sequence[bytes], lists: Sequence[CertificateList]) -> tuple[Seen, str]:
    """The signature, and why its signer is not trusted, or nothing."""
    stamp = status.timestamp_validity
    stamped = stamp is not None and stamp.intact and stamp.valid and stamp.trusted
    chain = [each.dump() for each in (signature.signer_cert, *signature.other_embedded_certs)]
    lists = lists if stamped else ()  # without a time that is certain they clear nothing
    why = untrusted(chain, trust, stamp.timestamp if stamped else datetime.now(UTC), lists) if trust else ""
    seen = Seen(
        signer=_name(chain[0]),
        certificate_sha256=sha256(chain[0]).hexdigest(),
        when=stamp.timestamp if stamped else signature.self_reported_timestamp,
        time_server=_name(stamp.signing_cert.dump()) if stamped else None,
        reason=Reason(str(signature.sig_object.get("/Reason", ""))),
        trusted=not why if trust else None,
        long_term=bool(lists and trust) and not why and chain[0] not in trust,  # who is trusted himself is not asked
    )
    return seen, why


def _name(certificate: bytes) -> str:
    return load_der_x509_certificate(certificate).subject.rfc4514_string()


def _lists(reader: PdfFileReader) -> list[CertificateList]:
    """The authorities' lists of revoked certificates in the document, which its signature covers as all else."""
    try:
        found = reader.root["/DSS"]["/CRLs"]
    except KeyError:
        return []
    return [CertificateList.load(found[number].data) for number in range(len(found))]


def _attached(reader: PdfFileReader) -> Iterator[tuple[str, bytes]]:
    """The files attached to the document."""
    try:
        names = reader.root["/Names"]["/EmbeddedFiles"]["/Names"]
    except KeyError:
        return
    for number in range(1, len(names), 2):
        yield str(names[number]["/UF"]), names[number]["/EF"]["/F"].data

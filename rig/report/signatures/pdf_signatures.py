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
from pyhanko.sign.fields import SigSeedSubFilter
from pyhanko.sign.validation import validate_pdf_signature
from pyhanko_certvalidator import ValidationContext

from rig.errors import Refused
from rig.report.signatures.cms_coverage import certificates_with, uncovered_in_container
from rig.report.signatures.findings import (
    Looked,
    Seen,
    authority_not_trusted,
    not_as_signed,
    not_signed,
    signer_not_trusted,
    signer_unknown,
    stamp_not_trusted,
)
from rig.report.signatures.reason import Reason
from rig.report.signatures.trust import Trust, unvouched, why_untrusted


def seen_pdf(name: str, content: bytes, trust: Trust) -> Looked:
    """Return what a PDF's signature shows. Raises whatever its reader does of a damaged one."""
    for library in ("pyhanko", "pyhanko_certvalidator"):
        logging.getLogger(library).setLevel(logging.CRITICAL)  # whom they do not trust is said here, by name
    reader = PdfFileReader(io.BytesIO(content), strict=True)
    if not reader.embedded_regular_signatures:
        return Looked(problems=(not_signed(name),))
    if len(reader.embedded_signatures) > 1:
        return Looked(problems=(not_as_signed(name, "it has several signatures"),))
    (signature,) = reader.embedded_signatures
    status = _status(signature, trust)
    attached = list(_attached(reader))
    altered = [not_as_signed(name, why) for why in _altered(signature, status, content, attached)]
    seen, unsure = _seen(name, signature, status, trust, _lists(reader))
    if altered:
        return Looked((seen,), {}, (*altered, *unsure))
    return Looked((seen,), dict(attached), (*unsure, *_of_authorities(name, signature, trust)))


def _status(signature: Any, trust: Trust) -> Any:
    """pyHanko's, which trusts no signer here, and time servers as `trust` says."""
    nobody = ValidationContext(trust_roots=[], allow_fetching=False)
    roots = list(map(Certificate.load, trust.certificates))
    servers = ValidationContext(trust_roots=roots, allow_fetching=False)
    return validate_pdf_signature(signature, nobody, servers)


def _altered(signature: Any, status: Any, content: bytes, attached: Sequence[tuple[str, bytes]]) -> Iterator[str]:
    """Why the file is not what was signed: every byte of it must be signed, but for the signature itself."""
    if not status.intact:
        yield "bytes that are signed have changed"
    elif not status.valid:
        yield "its signature is not by the key of its certificate"
    stamp = status.timestamp_validity
    if stamp is not None and not (stamp.intact and stamp.valid):
        yield "its time stamp is of something else"
    written = signature.pkcs7_content
    begin = int(signature.byte_range[1])
    end = begin + 2 * len(written) + 2
    if list(map(int, signature.byte_range)) != [0, begin, end, len(content) - end]:
        yield "its signature is not over all of it"
    elif content[begin:end] not in (f"<{written.hex()}>".encode(), f"<{written.hex().upper()}>".encode()):
        yield "beside its signature there is something else"
    container = written[: parser.peek(written)]
    if written[len(container) :].strip(b"\0"):
        yield "behind its signature there is something else"
    if signature.sig_object.get("/SubFilter") != SigSeedSubFilter.PADES.value:
        yield "its signature is of another kind than PAdES"
    yield from uncovered_in_container(container)
    if len(dict(attached)) < len(attached):
        yield "two files of one name are attached to it"


def _seen(
    name: str, signature: Any, status: Any, trust: Trust, lists: Sequence[CertificateList]
) -> tuple[Seen, list[Refused]]:
    """The signature, and why its signer, or who stamped it, is not to be relied on, or nothing."""
    stamp = status.timestamp_validity
    whole = stamp is not None and stamp.intact and stamp.valid
    stamped = whole and stamp.trusted
    chain = [one.dump() for one in (signature.signer_cert, *signature.other_embedded_certs)]
    lists = lists if stamped else ()  # without a time that is certain they clear nothing
    moment = stamp.timestamp if stamped else datetime.now(UTC)
    why = why_untrusted(chain, trust, moment, lists) if trust.certificates else ""
    seen = Seen(
        signer=_name(chain[0]),
        certificate_sha256=sha256(chain[0]).hexdigest(),
        when=stamp.timestamp if stamped else signature.self_reported_timestamp,
        time_server=_name(stamp.signing_cert.dump()) if stamped else None,
        reason=Reason(str(signature.sig_object.get("/Reason", ""))),
        trusted=not why if trust.certificates else None,
        # who is trusted himself is not asked
        long_term=bool(lists and trust.certificates) and not why and chain[0] not in trust.certificates,
    )
    if not trust.certificates:
        return seen, [signer_unknown(name, seen.signer)]
    unsure = [signer_not_trusted(name, seen.signer, why)] if why else []
    if whole and not stamped:
        unsure.append(stamp_not_trusted(name, _name(stamp.signing_cert.dump())))
    return seen, unsure


def _of_authorities(name: str, signature: Any, trust: Trust) -> Iterator[Refused]:
    """The problems of the authorities' certificates that come with the signature, which it does not cover."""
    for certificates in certificates_with(signature.pkcs7_content) if trust.certificates else ():
        for authority in unvouched(certificates, trust):
            yield authority_not_trusted(name, authority.subject.rfc4514_string())


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

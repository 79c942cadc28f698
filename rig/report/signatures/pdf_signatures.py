"""The signatures of a PDF, which must cover every byte except the signature itself."""

import io
import logging
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from hashlib import sha256
from typing import Any

from asn1crypto import parser
from asn1crypto.crl import CertificateList
from cryptography.x509 import load_der_x509_certificate
from pyhanko.pdf_utils.reader import PdfFileReader
from pyhanko.sign.fields import SigSeedSubFilter
from pyhanko.sign.validation import validate_pdf_signature
from pyhanko_certvalidator import ValidationContext

from rig.errors import Refused
from rig.report.signatures.cms_coverage import certificates_with, find_uncovered_in_container
from rig.report.signatures.findings import (
    FileInspection,
    SignatureReport,
    authority_not_trusted,
    list_signer_doubts,
    not_as_signed,
    not_signed,
    stamp_not_trusted,
)
from rig.report.signatures.reason import Reason
from rig.report.signatures.trust import Trust, find_unvouched, trust_anchors, unfit_for_stamps, why_untrusted


def inspect_pdf(name: str, content: bytes, trust: Trust) -> FileInspection:
    """Return the inspection of a PDF's signature. Raise the errors of its reader for a damaged file."""
    for library in ("pyhanko", "pyhanko_certvalidator"):
        logging.getLogger(library).setLevel(logging.CRITICAL)  # problems are named here
    reader = PdfFileReader(io.BytesIO(content), strict=True)
    if not reader.embedded_regular_signatures:
        return FileInspection(problems=(not_signed(name),))
    if len(reader.embedded_signatures) > 1:
        return FileInspection(problems=(not_as_signed(name, "it has several signatures"),))
    (signature,) = reader.embedded_signatures
    status = _status(signature, trust)
    attachments = list(_attachments(reader))
    alterations = [not_as_signed(name, why) for why in _alterations(signature, status, content, attachments)]
    report, doubts = _inspect_signature(name, signature, status, trust, _lists(reader))
    if alterations:
        return FileInspection((report,), {}, (*alterations, *doubts))
    return FileInspection((report,), dict(attachments), (*doubts, *_check_authorities(name, signature, trust)))


def _status(signature: Any, trust: Trust) -> Any:
    """Return pyHanko's status of a signature: time servers of `trust` are trusted, and the signer is not judged."""
    no_signers = ValidationContext(trust_roots=[], allow_fetching=False)
    servers = ValidationContext(trust_roots=trust_anchors(trust), allow_fetching=False)
    return validate_pdf_signature(signature, no_signers, servers)


def _alterations(signature: Any, status: Any, content: bytes, attached: Sequence[tuple[str, bytes]]) -> Iterator[str]:
    """Yield the file's alterations since it was signed: the signature must cover every byte except itself."""
    if not status.intact:
        yield "signed bytes have changed"
    elif not status.valid:
        yield "its signature is not by the key of its certificate"
    stamp = status.timestamp_validity
    if stamp is not None and not (stamp.intact and stamp.valid):
        yield "its time stamp belongs to other content"
    written = signature.pkcs7_content
    begin = int(signature.byte_range[1])
    end = begin + 2 * len(written) + 2
    if list(map(int, signature.byte_range)) != [0, begin, end, len(content) - end]:
        yield "its signature does not cover the whole file"
    elif content[begin:end] not in (f"<{written.hex()}>".encode(), f"<{written.hex().upper()}>".encode()):
        yield "the gap for its signature has other content"
    container = written[: parser.peek(written)]
    if written[len(container) :].strip(b"\0"):
        yield "other content follows its signature"
    if signature.sig_object.get("/SubFilter") != SigSeedSubFilter.PADES.value:
        yield "its signature is of another kind than PAdES"
    yield from find_uncovered_in_container(container)
    if len(dict(attached)) < len(attached):
        yield "two attached files have the same name"


def _inspect_signature(
    name: str, signature: Any, status: Any, trust: Trust, lists: Sequence[CertificateList]
) -> tuple[SignatureReport, list[Refused]]:
    """Return the signature's report, and the problems of its signer and of its time stamp."""
    stamp = status.timestamp_validity
    is_intact = stamp is not None and stamp.intact and stamp.valid
    now = datetime.now(UTC)
    server = load_der_x509_certificate(stamp.signing_cert.dump()) if is_intact else None
    unfit = "" if server is None else next(unfit_for_stamps(server, stamp.timestamp, now), "")
    stamped = is_intact and stamp.trusted and not unfit
    chain = [one.dump() for one in (signature.signer_cert, *signature.other_embedded_certs)]
    lists = lists if stamped else ()  # without a trusted time the lists prove nothing
    moment = stamp.timestamp if stamped else now
    why = why_untrusted(chain, trust, moment, lists) if trust.certificates else ""
    report = SignatureReport(
        signer=_name(chain[0]),
        certificate_sha256=sha256(chain[0]).hexdigest(),
        when=stamp.timestamp if stamped else signature.self_reported_timestamp,
        time_server=_name(stamp.signing_cert.dump()) if stamped else None,
        reason=Reason(str(signature.sig_object.get("/Reason", ""))),
        trusted=not why if trust.certificates else None,
        # A certificate that is itself trusted is not looked up in lists.
        long_term=bool(lists and trust.certificates) and not why and chain[0] not in trust.certificates,
    )
    doubts = list_signer_doubts(name, report, why)
    if trust.certificates and is_intact and not stamped:
        doubts.append(stamp_not_trusted(name, _name(stamp.signing_cert.dump()), unfit))
    return report, doubts


def _check_authorities(name: str, signature: Any, trust: Trust) -> Iterator[Refused]:
    """Yield problems of the authorities' certificates, because the signature does not cover these certificates."""
    for certificates in certificates_with(signature.pkcs7_content) if trust.certificates else ():
        for authority in find_unvouched(certificates, trust):
            yield authority_not_trusted(name, authority.subject.rfc4514_string())


def _name(certificate: bytes) -> str:
    return load_der_x509_certificate(certificate).subject.rfc4514_string()


def _lists(reader: PdfFileReader) -> list[CertificateList]:
    """Return the revocation lists in the document; the document's signature covers these lists."""
    try:
        streams = reader.root["/DSS"]["/CRLs"]
    except KeyError:
        return []
    return [CertificateList.load(streams[number].data) for number in range(len(streams))]


def _attachments(reader: PdfFileReader) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each file attached to the document."""
    try:
        names = reader.root["/Names"]["/EmbeddedFiles"]["/Names"]
    except KeyError:
        return
    for number in range(1, len(names), 2):
        yield str(names[number]["/UF"]), names[number]["/EF"]["/F"].data

"""Inspection of a file's signatures: signer, time, reason, and problems; nothing is signed here."""

import warnings
from collections.abc import Sequence
from pathlib import Path

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.errors import Refused
from rig.errors.extras import requiring
from rig.report.signatures.findings import FileInspection, not_as_signed, not_signed
from rig.report.signatures.long_term import LIST_MAX_BYTES
from rig.report.signatures.signatory import EXTRA, SIZE_MAX_BYTES
from rig.report.signatures.trust import Trust

XML_MAX_BYTES = 2_000_000  # a sensor takes 35 kB; a crafted document takes 150 times its length of memory
PDF_MAX_BYTES = 2 * LIST_MAX_BYTES + 4_000_000  # with two revocation lists; without them a sensor takes 105 kB
HEAD_BYTES = 200  # enough to detect the type of a file


def inspect_file(name: str, content: bytes, trust: Trust) -> FileInspection:
    """Return the inspection of a file as PDF, XML or unsigned, by its content. Raise Refused `missing_extra`."""
    is_pdf = _is_pdf(content)
    if not may_be_signed(content):
        return FileInspection(problems=(not_signed(name),))
    if len(content) > (limit := PDF_MAX_BYTES if is_pdf else XML_MAX_BYTES):
        return FileInspection(problems=(not_as_signed(name, f"it is longer than {limit} bytes, as no certificate is"),))
    with requiring(EXTRA):
        if is_pdf:
            from rig.report.signatures.pdf_signatures import inspect_pdf as inspect
        else:
            from rig.report.signatures.xml_signature import inspect_xml as inspect
    try:
        with warnings.catch_warnings(action="ignore"):  # warnings of the libraries about the file's content
            return inspect(name, content, trust)
    except MemoryError:
        raise
    except Exception as error:  # the libraries raise any error for a crafted file
        why = str(error).strip().splitlines()
        return FileInspection(
            problems=(not_as_signed(name, f"it cannot be read: {why[0] if why else type(error).__name__}"),)
        )


def may_be_signed(content: bytes) -> bool:
    """Return whether a file is of a type that can hold a signature, PDF or XML, by how its content begins."""
    return _is_pdf(content) or _is_xml(content)


def _is_pdf(content: bytes) -> bool:
    return content.startswith(b"%PDF-")


def _is_xml(content: bytes) -> bool:
    """Return whether the file begins as XML, with one or two bytes per character, and is not HTML."""
    head = content[:HEAD_BYTES].lstrip(b"\xef\xbb\xbf\xfe\xff").replace(b"\0", b"").lstrip().lower()
    return head.startswith(b"<") and not head.startswith(b"<!doctype html")


def read_trusted_certificates(files: Sequence[Path]) -> tuple[bytes, ...]:
    """Return the certificates in these files, PEM or DER, as DER. Raise Refused `trust_file`, `missing_extra`."""
    if not files:
        return ()
    with requiring(EXTRA):
        from cryptography.hazmat.primitives.serialization import Encoding
        from cryptography.x509 import load_der_x509_certificate, load_pem_x509_certificates
    certificates = []
    for file in files:
        try:
            content = read_regular_file(file, SIZE_MAX_BYTES)
            pem = b"-----BEGIN" in content
            certificates.extend(load_pem_x509_certificates(content) if pem else [load_der_x509_certificate(content)])
        except (UnfitFile, OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            raise Refused("trust_file", f"{file} is not a certificate: {why}", "Give it as PEM or DER") from None
    return tuple(certificate.public_bytes(Encoding.DER) for certificate in certificates)

"""What is seen of a file's signatures: who, when, why, and what is wrong; nothing is signed here."""

from collections.abc import Sequence
from pathlib import Path

from rig.config.regular_file import UnfitFile, read_regular_file
from rig.errors import Refused
from rig.errors.extras import missing_extra
from rig.report.signatures.findings import Looked, not_as_signed, not_signed
from rig.report.signatures.signatory import EXTRA, SIZE_MAX_BYTES


def looked_at(name: str, content: bytes, trust: Sequence[bytes]) -> Looked:
    """A file by its content: PDF, XML, or one that has no signature of its own. `trust` are certificates in DER.

    Raises Refused `missing_extra`.
    """
    try:
        from rig.report.signatures.pdf_signatures import seen_pdf
        from rig.report.signatures.xml_signature import seen_xml
    except ImportError as error:
        raise missing_extra(error, EXTRA) from error
    if content.startswith(b"%PDF-"):
        look = seen_pdf
    elif content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<?xml"):
        look = seen_xml
    else:
        return Looked(problems=(not_signed(name),))
    try:
        return look(name, content, trust)
    except Exception as error:  # of a file that anybody may have made the libraries raise whatever they meet
        why = str(error).strip().splitlines()
        return Looked(problems=(not_as_signed(name, f"it cannot be read: {why[0] if why else type(error).__name__}"),))


def trusted_in(files: Sequence[Path]) -> list[bytes]:
    """The certificates in these files, PEM or DER, as DER. Raises Refused `trust_file`, `missing_extra`."""
    try:
        from cryptography.hazmat.primitives.serialization import Encoding
        from cryptography.x509 import load_der_x509_certificate, load_pem_x509_certificates
    except ImportError as error:
        raise missing_extra(error, EXTRA) from error
    found = []
    for file in files:
        try:
            content = read_regular_file(file, SIZE_MAX_BYTES)
            pem = b"-----BEGIN" in content
            found += load_pem_x509_certificates(content) if pem else [load_der_x509_certificate(content)]
        except (UnfitFile, OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            raise Refused("trust_file", f"{file} is no certificate: {why}", "Give it as PEM or DER") from None
    return [each.public_bytes(Encoding.DER) for each in found]

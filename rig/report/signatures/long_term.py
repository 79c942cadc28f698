"""Long-term validation of signatures (PAdES B-LT): the authorities' lists of revoked certificates."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.errors import Refused
from rig.report.signatures.signatory import SIZE_MAX_BYTES, Signatory

if TYPE_CHECKING:
    from pyhanko_certvalidator import ValidationContext

LIST_MAX_BYTES = 5 * SIZE_MAX_BYTES  # a hundred thousand revoked certificates
_LIST = re.compile(rb"-----BEGIN X509 CRL-----.*?-----END X509 CRL-----", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Authorities:
    """Certificates of authorities, and their revocation lists (CRL, RFC 5280), in DER."""

    roots: tuple[bytes, ...]
    lists: tuple[bytes, ...]

    def context(self, by: Signatory) -> "ValidationContext":
        """Return the context of a validation that trusts only these authorities and requires all revocation lists."""
        from asn1crypto.crl import CertificateList
        from asn1crypto.x509 import Certificate
        from cryptography.hazmat.primitives.serialization import Encoding
        from pyhanko_certvalidator import ValidationContext

        return ValidationContext(
            trust_roots=list(map(Certificate.load, self.roots)),
            other_certs=[Certificate.load(one.public_bytes(Encoding.DER)) for one in by.certificates],
            crls=list(map(CertificateList.load, self.lists)),
            revocation_mode="require",
            allow_fetching=False,
        )


def read_authorities(files: Sequence[Path]) -> Authorities:
    """Return the certificates and revocation lists in these files. Raise Refused `revocation_list`.

    A file is PEM, or DER if it contains a single revocation list.
    """
    from cryptography.hazmat.primitives.serialization import Encoding
    from cryptography.x509 import load_der_x509_crl, load_pem_x509_certificates, load_pem_x509_crl

    roots, lists = list[bytes](), list[bytes]()
    for file in files:
        try:
            content = read_regular_file(file, LIST_MAX_BYTES)
            pem = b"-----BEGIN" in content
            certificates = load_pem_x509_certificates(content) if b"-----BEGIN CERTIFICATE" in content else []
            file_lists = list(map(load_pem_x509_crl, _LIST.findall(content))) if pem else [load_der_x509_crl(content)]
        except (UnfitFile, OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or str(error)
            raise unfit(f"{file} cannot be read as one: {why}") from None
        roots += [certificate.public_bytes(Encoding.DER) for certificate in certificates]
        lists += [revoked.public_bytes(Encoding.DER) for revoked in file_lists]
    return Authorities(tuple(roots), tuple(lists))


def unfit(why: str) -> Refused:
    """Return the refusal to make a signature whose certificates could not be checked later."""
    return Refused(
        "revocation_list",
        f"the revocation lists are not sufficient: {why}",
        "Give with --long-term the newest list and the certificate of each authority, of the key and of the time "
        "server, or leave it out",
    )

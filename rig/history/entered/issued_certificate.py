"""A certificate in a history: its number, its day, its marks, and the hashes of its files. Pure."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.report.certificate.content import Certificate


@dataclass(frozen=True, slots=True)
class IssuedCertificate:
    """An issued certificate.

    `issued`: the day of issue; `replaces`: the number of the certificate that this one amends, if any; `marks`: the
    text printed across its pages, empty if there is none; `files`: the names and SHA-256 of its files.
    """

    number: str
    title: str
    issued: str
    replaces: str | None
    marks: str
    files: tuple[tuple[str, str], ...] = ()


def issue_certificate(certificate: "Certificate", files: Mapping[str, bytes]) -> IssuedCertificate:
    """Return the certificate for a history, with the checksums of its files."""
    return IssuedCertificate(
        certificate.number,
        certificate.title,
        certificate.issued.isoformat(),
        certificate.stated.certificate.replaces,
        ". ".join(certificate.marks),
        tuple((name, hashlib.sha256(content).hexdigest()) for name, content in files.items()),
    )

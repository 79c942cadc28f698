"""A certificate as a history keeps it: its number, what it says of itself, and the hashes of its files. Pure."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.report.certificate.content import Certificate


@dataclass(frozen=True, slots=True)
class Issued:
    """`issued` is a day; `replaces` the number it amends; `marks` what stands across its pages, empty if nothing does.

    `files` are what it was written to: name and SHA-256 of each.
    """

    number: str
    title: str
    issued: str
    replaces: str | None
    marks: str
    files: tuple[tuple[str, str], ...] = ()


def issued_certificate(certificate: "Certificate", files: Mapping[str, bytes]) -> Issued:
    """The certificate as it is entered: with the checksums of its files, by name."""
    return Issued(
        certificate.number,
        certificate.title,
        certificate.issued.isoformat(),
        certificate.stated.certificate.replaces,
        ". ".join(certificate.marks),
        tuple((name, hashlib.sha256(content).hexdigest()) for name, content in files.items()),
    )

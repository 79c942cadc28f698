"""What a look at a signed file found: its signatures, and the names of what is wrong with it."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING

from rig.errors import Refused
from rig.report.signatures.reason import Reason

if TYPE_CHECKING:
    from asn1crypto.crl import CertificateList


@dataclass(frozen=True, slots=True)
class Seen:
    """One signature: `signer` the name in its certificate, and `certificate_sha256` what tells that from others.

    `when` is by the clock of `time_server` or, where that is None, what the signer's own says. `trusted` is None where
    nobody said whom to trust. `long_term`: its certificate was not revoked then, by the authorities' lists inside.
    """

    signer: str
    certificate_sha256: str
    when: datetime | None
    time_server: str | None
    reason: Reason
    trusted: bool | None
    long_term: bool = False


@dataclass(frozen=True, slots=True)
class Looked:
    """All of a file: its signatures, the files attached to what is signed, and what is wrong, by the errors' names."""

    signatures: tuple[Seen, ...] = ()
    attached: Mapping[str, bytes] = field(default_factory=dict)
    problems: tuple[Refused, ...] = ()


def not_signed(name: str) -> Refused:
    """The problem of a file without a signature."""
    return Refused(
        "not_signed",
        f"{name} has no signature",
        "Give the signed certificate.pdf that it is attached to beside it, or a history that knows it: --history",
    )


def not_as_signed(name: str, why: str) -> Refused:
    """The problem of a file that was altered, or never was what is signed."""
    return Refused(
        "not_as_signed", f"{name} is not what was signed: {why}", "Do not rely on it; ask the laboratory for it"
    )


def untrusted(
    chain: Sequence[bytes], trust: Sequence[bytes], moment: datetime, lists: "Sequence[CertificateList]" = ()
) -> str:
    """Why the first of a `chain` of certificates (DER) leads to none of those trusted then; empty if it does.

    Where there are `lists` of revoked certificates, they have to clear all of the way.
    """
    from asn1crypto.x509 import Certificate
    from pyhanko_certvalidator import CertificateValidator, ValidationContext
    from pyhanko_certvalidator.errors import PathError, ValidationError

    own, *others = map(Certificate.load, chain)
    begin, end = own.not_valid_before, own.not_valid_after
    if not begin <= moment <= end:  # one that is trusted itself is not asked this below
        return f"the certificate is valid from {begin:%Y-%m-%d} to {end:%Y-%m-%d}, and not on {moment:%Y-%m-%d}"
    context = ValidationContext(
        trust_roots=list(map(Certificate.load, trust)),
        other_certs=others,
        moment=moment,
        crls=list(lists),
        revocation_mode="require" if lists else "soft-fail",
        allow_fetching=False,
    )
    try:
        asyncio.run(CertificateValidator(own, validation_context=context).async_validate_usage(set()))
    except (PathError, ValidationError) as error:
        return " ".join(str(error).split())
    return ""


def signer_not_trusted(name: str, signer: str, why: str) -> Refused:
    """The problem of a file that is whole, and signed by somebody else than was expected."""
    return Refused(
        "signer_not_trusted",
        f"{name} is signed by {signer}, who is not trusted: {why}",
        "Compare the SHA-256 of the certificate with what the laboratory says, and give the right one with --trust",
    )

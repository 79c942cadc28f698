"""What a look at a signed file found: its signatures, and the names of what is wrong with it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime

from rig.errors import Refused
from rig.report.signatures.reason import Reason


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


def signer_not_trusted(name: str, signer: str, why: str) -> Refused:
    """Return the problem of a file that is unaltered, and signed by somebody else than was expected."""
    return Refused(
        "signer_not_trusted",
        f"{name} is signed by {signer}, who is not trusted: {why}",
        "Compare the SHA-256 of the certificate with what the laboratory says, and give the right one with --trust",
    )


def stamp_not_trusted(name: str, server: str) -> Refused:
    """Return the problem of a file whose time stamp anybody may have made."""
    return Refused(
        "signer_not_trusted",
        f"{name} has a time stamp by {server}, who is not trusted",
        "Give the certificate of the time server, or of the authority that issued it, with --trust too",
    )


def authority_not_trusted(name: str, authority: str) -> Refused:
    """Return the problem of a file with an authority's certificate that may have been altered."""
    return Refused(
        "signer_not_trusted",
        f"{name} brings a certificate of {authority} that nobody who is trusted has issued",
        "Give the certificate of this authority, or of the one above it, with --trust too",
    )


def signer_unknown(name: str, signer: str) -> Refused:
    """Return the problem of a file that is unaltered, by a verifier who trusts nobody."""
    return Refused(
        "signer_unknown",
        f"{name} is signed by {signer}, and anybody may have made a key of that name",
        "Give the certificate of the laboratory's key, or of the authority that issued it, with --trust",
    )

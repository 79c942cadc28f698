"""Results of the inspection of a signed file: its signatures and its problems."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime

from rig.errors import Refused
from rig.errors.quoting import shorten
from rig.report.signatures.reason import Reason


@dataclass(frozen=True, slots=True)
class SignatureReport:
    """One signature: `signer` is the name in its certificate, `certificate_sha256` the certificate's fingerprint.

    `when` is the time by the clock of `time_server` or, without a time server, by the signer's clock. `trusted` is None
    if no trusted certificate was given. `long_term`: whether revocation lists in the file show that the certificate was
    not revoked at that time.
    """

    signer: str
    certificate_sha256: str
    when: datetime | None
    time_server: str | None
    reason: Reason
    trusted: bool | None
    long_term: bool = False


@dataclass(frozen=True, slots=True)
class FileInspection:
    """The inspection of a file: its signatures, the contents of the files attached to it by name, and its problems."""

    signatures: tuple[SignatureReport, ...] = ()
    attached: Mapping[str, bytes] = field(default_factory=dict)
    problems: tuple[Refused, ...] = ()


def not_signed(name: str) -> Refused:
    """Return the problem of a file without a signature."""
    return Refused(
        "not_signed",
        f"{name} has no signature of its own, and no file that might contain it is given",
        "Give the signed certificate.pdf to which it is attached as well, or a history that has it: --history",
    )


def not_attached(name: str, searched: Mapping[str, Sequence[str]]) -> Refused:
    """Return the problem of a file without a signature whose bytes are attached to none of the `searched` files.

    `searched` has the names of the files attached to each signed file.
    """
    places = "; ".join(
        f"{signed} ({', '.join(map(shorten, attachments)) or 'nothing is attached'})"
        for signed, attachments in searched.items()
    )
    return Refused(
        "not_signed",
        f"{name} has no signature of its own, and its bytes are those of no file attached to {places}",
        "Give the file as the laboratory sent it and the certificate.pdf that belongs to it, or a history that has it: "
        "--history",
    )


def not_as_signed(name: str, why: str) -> Refused:
    """Return the problem of a file that was altered, or that is not the signed file."""
    return Refused(
        "not_as_signed", f"{name} is not as it was signed: {why}", "Do not rely on it; ask the laboratory for it"
    )


def list_signer_doubts(name: str, report: SignatureReport, why: str) -> list[Refused]:
    """Return the problem of an unaltered file whose signer is unknown or not trusted, in a list; empty if trusted.

    `why`: the reason of the distrust, empty if the signer is trusted.
    """
    if report.trusted is None:
        return [
            Refused(
                "signer_unknown",
                f"{name} is signed by {report.signer}, but anyone can create a key with that name",
                "Give the certificate of the laboratory's key, or of the authority that issued it, with --trust",
            )
        ]
    what = f"{name} is signed by {report.signer}, who is not trusted: {why}"
    remedy = (
        "Compare the certificate's SHA-256 with the one that the laboratory publishes; give the right one by --trust"
    )
    return [Refused("signer_not_trusted", what, remedy)] if why else []


def stamp_not_trusted(name: str, server: str, why: str) -> Refused:
    """Return the problem of a file whose time stamp by `server` is not trusted; `why` is the reason, or empty."""
    return Refused(
        "signer_not_trusted",
        f"{name} has a time stamp by {server}, which is not trusted{why and f': {why}'}",
        "Give the certificate of the time server, or of the authority that issued it, with --trust too",
    )


def authority_not_trusted(name: str, authority: str) -> Refused:
    """Return the problem of a file with a certificate of `authority` that no trusted authority has issued."""
    return Refused(
        "signer_not_trusted",
        f"{name} contains a certificate of {authority} that no trusted authority has issued",
        "Give the certificate of this authority, or of the one above it, with --trust too",
    )

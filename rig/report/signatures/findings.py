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

"""The reason in a certificate's signatures, with the marks of a certificate that is not valid. Pure."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.report.certificate.content import Certificate

_ANCHOR = re.compile(r"journal entry (\d+), SHA-256 ([0-9a-f]{64})$")


@dataclass(frozen=True, slots=True)
class Reason:
    """The reason that a signature states. The reason may contain the last entry of the history's journal (`anchor`)."""

    text: str

    @property
    def anchor(self) -> tuple[int, str] | None:
        """The number and SHA-256 of the journal's last entry in the history; None without a history."""
        match = _ANCHOR.search(self.text)
        return None if match is None else (int(match[1]), match[2])


def reason_of(certificate: "Certificate", anchor: tuple[int, str] | None) -> Reason:
    """Return the reason to sign a certificate: its marks (such as "Simulated laboratory …"), number, and `anchor`."""
    sentences = [*certificate.marks, f"{certificate.title} {certificate.number}"]
    if anchor is not None:
        sentences.append(f"Signed after the history's journal entry {anchor[0]}, SHA-256 {anchor[1]}")
    return Reason(". ".join(sentences))

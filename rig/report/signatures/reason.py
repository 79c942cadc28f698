"""Why a certificate is signed, in the words that its signatures carry: what is not valid says so there, too. Pure."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.report.certificate.content import Certificate

_ANCHOR = re.compile(r"journal entry (\d+), SHA-256 ([0-9a-f]{64})$")


@dataclass(frozen=True, slots=True)
class Reason:
    """What a signature says; `anchor` is the end of the history's journal when it was made, number and SHA-256."""

    text: str

    @property
    def anchor(self) -> tuple[int, str] | None:
        """The entry that the text names, None where no history was at hand."""
        found = _ANCHOR.search(self.text)
        return None if found is None else (int(found[1]), found[2])


def reason_of(certificate: "Certificate", anchor: tuple[int, str] | None) -> Reason:
    """The reason to sign a certificate: what stands across its pages, as "Simulated laboratory …", and its number."""
    said = [*certificate.marks, f"{certificate.title} {certificate.number}"]
    if anchor is not None:
        said.append(f"Signed after the history's journal entry {anchor[0]}, SHA-256 {anchor[1]}")
    return Reason(". ".join(said))

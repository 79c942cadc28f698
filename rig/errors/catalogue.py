"""The table of all errors, catalogue.txt: the source of `rig explain` and docs/errors.md."""

from dataclasses import dataclass
from pathlib import Path

TABLE = Path(__file__).with_name("catalogue.txt")
KINDS = (
    "refused",
    "fault",
    "either",
    "unprinted",
    "simulated",
)  # how the source raises an error; catalogue.txt explains them


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """An error's name, one of `KINDS`, a clause on when it occurs, and one on what to do."""

    name: str
    kind: str
    when: str
    remedy: str


def catalogue() -> tuple[CatalogueEntry, ...]:
    """Return the table in its order. Raise ValueError for a line not of the form `name | kind | when | remedy`."""
    entries = []
    for number, line in enumerate(TABLE.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("#"):
            continue
        cells = line.split(" | ")
        if len(cells) != 4 or cells[1] not in KINDS:
            raise ValueError(f"{TABLE.name}, line {number}: not `name | {' or '.join(KINDS)} | when | what to do`")
        entries.append(CatalogueEntry(*cells))
    return tuple(entries)

"""The table of all errors, catalogue.txt: the source of `rig explain` and docs/errors.md."""

from dataclasses import dataclass
from pathlib import Path

from rig.errors.table_rows import read_rows

TABLE = Path(__file__).with_name("catalogue.txt")
KINDS = (
    "refused",
    "fault",
    "either",
    "unprinted",
    "simulated",
)  # how the source raises an error; catalogue.txt explains the errors


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """An error's name, one of `KINDS`, a clause about when it occurs, and a clause about what to do."""

    name: str
    kind: str
    when: str
    remedy: str


def catalogue() -> tuple[CatalogueEntry, ...]:
    """Return the catalogue in the file's order. Raise ValueError unless lines are `name | kind | when | remedy`."""
    form = f"name | {' or '.join(KINDS)} | when | what to do"
    return tuple(CatalogueEntry(*cells) for cells in read_rows(TABLE, form, 1, KINDS))

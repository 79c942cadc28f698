"""The table of every error's name, catalogue.txt: what a name is looked up in, and what docs/errors.md is made from."""

from dataclasses import dataclass
from pathlib import Path

TABLE = Path(__file__).with_name("catalogue.txt")
KINDS = (
    "refused",
    "fault",
    "either",
    "unprinted",
    "simulated",
)  # how the source raises an error; catalogue.txt says what they mean


@dataclass(frozen=True, slots=True)
class Entry:
    """An error's name, one of `KINDS`, one clause saying when it occurs, and one saying what to do."""

    name: str
    kind: str
    when: str
    remedy: str


def catalogue() -> tuple[Entry, ...]:
    """The table, in its order. Raises ValueError for a line of another form than `name | kind | when | remedy`."""
    entries = []
    for number, line in enumerate(TABLE.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("#"):
            continue
        cells = line.split(" | ")
        if len(cells) != 4 or cells[1] not in KINDS:
            raise ValueError(f"{TABLE.name}, line {number}: not `name | {' or '.join(KINDS)} | when | what to do`")
        entries.append(Entry(*cells))
    return tuple(entries)

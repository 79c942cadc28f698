"""The words of the field and of this project: the table glossary.txt."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

WHOSE = ("field", "machine", "project")
TABLE = Path(__file__).with_name("glossary.txt")
LINK = re.compile(r"\[([^]]+)\]\(([^)#]+)[^)]*\)")


@dataclass(frozen=True, slots=True)
class Word:
    """Names that mean one thing, whose they are (one of `WHOSE`), and what they mean, in Markdown of docs/."""

    whose: str
    names: str
    means: str

    @property
    def each(self) -> tuple[str, ...]:
        """Every name alone: of `coverage factor, k = 2` too the letter."""
        return tuple(name.partition(" = ")[0] for name in self.names.split(", "))

    @property
    def plain(self) -> str:
        """What it means, for a terminal."""
        return LINK.sub(r"\1: docs/\2", self.means).replace("`", "")


@cache
def glossary() -> tuple[Word, ...]:
    """Every word, as the table has them. Raises ValueError for a line of another form than `whose | names | means`."""
    found = []
    for number, line in enumerate(TABLE.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("#"):
            continue
        cells = line.split(" | ")
        if len(cells) != 3 or cells[0] not in WHOSE:
            raise ValueError(f"{TABLE.name}, line {number}: not `whose | names | what it means`")
        found.append(Word(*cells))
    return tuple(found)


def words_called(name: str) -> Iterator[Word]:
    """The words of that name; U and u are two, and only where there is none are capitals no matter."""
    same = [word for word in glossary() if name in word.each]
    yield from same or [word for word in glossary() if name.casefold() in map(str.casefold, word.each)]

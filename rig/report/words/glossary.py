"""Words of the field (glossary.txt) and of this project (`house` in words.toml), for `rig explain` and the glossary."""

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from rig.errors.table_rows import read_rows

OWNERS = ("field", "machine", "project")
TABLE = Path(__file__).with_name("glossary.txt")
HOUSE_WORDS = Path(__file__).with_name("words.toml")
LINK = re.compile(r"\[([^]]+)\]\(([^)#]+)[^)]*\)")


@dataclass(frozen=True, slots=True)
class Word:
    """Names with one meaning, their owner (one of `OWNERS`), and the meaning, in Markdown of docs/."""

    owner: str
    names: str
    meaning: str

    @property
    def synonyms(self) -> tuple[str, ...]:
        """The separate names: `coverage factor, k = 2` also gives `k`."""
        return tuple(name.partition(" = ")[0] for name in self.names.split(", "))

    def plain_meaning(self, *, with_pages: bool) -> str:
        """Return the meaning without Markdown, for terminals; `with_pages` adds the paths of linked pages."""
        return LINK.sub(r"\1: docs/\2" if with_pages else r"\1", self.meaning).replace("`", "")


@cache
def glossary() -> tuple[Word, ...]:
    """Return all words. Raise ValueError for a line of another form than `owner | names | meaning`."""
    words = (Word(*cells) for cells in read_rows(TABLE, "owner | names | meaning", 0, OWNERS))
    house = tomllib.loads(HOUSE_WORDS.read_text(encoding="utf-8"))["house"]
    return (*words, *(Word("project", names, meaning) for names, meaning in house.items()))


def find_words(name: str) -> Iterator[Word]:
    """Yield the words that are called `name`. Capitals matter (U is not u), unless no word has exactly that name."""
    matches = [word for word in glossary() if name in word.synonyms]
    yield from matches or [word for word in glossary() if name.casefold() in map(str.casefold, word.synonyms)]

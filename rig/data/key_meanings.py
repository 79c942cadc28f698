"""The table of meanings of the keys of `result.json`, for its JSON schema and the page of public names."""

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

_TABLE = Path(__file__).with_name("key_meanings.txt")
_STD = re.compile(r"(.+)_std((?:_[a-z0-9_]+)?)")
_DEGREES_OF_FREEDOM = re.compile(r"(.+)_degrees_of_freedom")


@cache
def meanings() -> Mapping[str, str]:
    """Return the meanings by key of `result.json`. A key with another meaning in one entry is listed as `Entry.key`."""
    lines = _TABLE.read_text(encoding="utf-8").splitlines()
    rows = (line.partition(" | ") for line in lines if line and not line.startswith("#"))
    return {key: meaning for key, _, meaning in rows}


def meaning_of(entry: str, key: str) -> str:
    """Return the meaning of a key in an entry; `entry` is the class' name without the ending `Entry`.

    The meaning of a standard uncertainty or of degrees of freedom follows from the key. Raise KeyError if unknown.
    """
    table = meanings()
    if (meaning := table.get(f"{entry}.{key}", table.get(key))) is not None:
        return meaning
    if (match := _DEGREES_OF_FREEDOM.fullmatch(key)) is not None:
        return f"degrees of freedom of the standard uncertainty of `{match[1]}`; null if infinite"
    if (match := _STD.fullmatch(key)) is not None:
        return f"standard uncertainty of `{match[1]}{match[2]}`"
    raise KeyError(f"{entry}.{key}")

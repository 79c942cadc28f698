"""What the lines of an unknown device have in common: what stands around their numbers, and the numbers. Pure."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import xor

import numpy as np

from rig.estimation.arrays import Array

ENOUGH = 0.6  # share of the lines that have to be alike
FEWEST = 30
_NUMBER = re.compile(r"(?<![A-Za-z0-9_.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![A-Za-z0-9_])")
_SUM = re.compile(r"\*([0-9A-Fa-f]{2})$")
_SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", "": "space"}
_AROUND = " \t,;{}[]()|&"


@dataclass(frozen=True, slots=True)
class Line:
    """A line and when it arrived."""

    arrived_s: float
    text: str


@dataclass(frozen=True, slots=True)
class Shape:
    """What stands around the numbers of a sample: as the keys of a section `lines` say it; `names` as a header does.

    `values` (n, columns) are the numbers, which arrived at `arrived_s` (n,); `decimals` (columns,) the digits behind
    the point that all of a column have, -1 where they differ.
    """

    separator: str
    prefix: str
    keys: tuple[str, ...]
    checksum: bool
    names: tuple[str, ...]
    values: Array
    arrived_s: Array
    decimals: tuple[int, ...]
    others: int


def shape_of(lines: Sequence[Line]) -> Shape | str:
    """The shape that most lines have; a sentence saying why there is none."""
    told = [(line, *_without_sum(line.text.strip())) for line in lines if line.text.strip()]
    if len(told) < FEWEST:
        return f"only {len(told)} lines came, which is too few to see what they have in common"
    pieces = Counter(tuple(piece.strip(" ") for piece in _NUMBER.split(text)) for _, text, _ in told)
    common, count = pieces.most_common(1)[0]
    if count < ENOUGH * len(told):
        return f"only {count} of {len(told)} lines look alike: its lines are not one sample each, or of several kinds"
    if len(common) < 4:
        return f"a line holds {len(common) - 1} numbers, and three axes of a gyroscope are three"
    alike = [
        (line, text, summed) for line, text, summed in told
        if tuple(piece.strip(" ") for piece in _NUMBER.split(text)) == common
    ]  # fmt: skip
    if any(not ok for _, _, ok in alike) and any(_SUM.search(line.text.strip()) for line, _, _ in alike):
        return "its lines end as if with a sum, which is another one than NMEA's"
    between = _between(common)
    if isinstance(between, str):
        return between
    separator, prefix, keys = between
    numbers = [_NUMBER.findall(text) for _, text, _ in alike]
    others = [text for _, text, _ in told if tuple(piece.strip(" ") for piece in _NUMBER.split(text)) != common]
    checksum = _SUM.search(alike[0][0].text.strip()) is not None
    return Shape(
        separator,
        prefix,
        keys,
        checksum,
        tuple(key.strip(_AROUND + "\"':= ") for key in keys) or _header(others, separator, len(common) - 1),
        np.array(numbers, dtype=np.float64),
        np.array([line.arrived_s for line, _, _ in alike]),
        tuple(_decimals(column) for column in zip(*numbers, strict=True)),
        len(others),
    )


def _without_sum(text: str) -> tuple[str, bool]:
    """The line without a sum at its end, and whether what stands there is the sum."""
    found = _SUM.search(text)
    if found is None:
        return text, False
    body = text[: found.start()]
    right = reduce(xor, body.lstrip("$!").encode(), 0) == int(found.group(1), 16)
    return body, right


def _between(common: tuple[str, ...]) -> tuple[str, str, tuple[str, ...]] | str:
    """Separator, prefix and keys of what stands before, between and after the numbers; or why it can be none."""
    before, *inside, after = common
    if len({*inside}) == 1 and inside[0] in _SEPARATORS and not after.strip(_AROUND):
        if not after.strip() and before.strip(_AROUND):
            return _SEPARATORS[inside[0]], before, ()
        if not (before + after).strip():
            return _SEPARATORS[inside[0]], "", ()
    keys = tuple(piece.strip(_AROUND) for piece in (before, *inside))
    if all(keys) and len(set(keys)) == len(keys) and not after.strip(_AROUND):
        return "comma", "", keys
    return f"between its numbers stands {' … '.join(repr(piece) for piece in (before, *inside[:3], after))}"


def _header(others: Sequence[str], separator: str, count: int) -> tuple[str, ...]:
    """The names that a line of the others gives to so many columns."""
    sign = {name: sign for sign, name in _SEPARATORS.items()}[separator]
    for text in others:
        names = [name.strip(" \"'") for name in text.lstrip("#%/ ").split(sign or None)]
        if len(names) == count and all(name and not _NUMBER.fullmatch(name) for name in names):
            return tuple(names)
    return ()


def _decimals(numbers: Sequence[str]) -> int:
    if any("e" in each.lower() for each in numbers):
        return -1
    found = {len(each.partition(".")[2]) for each in numbers}
    return found.pop() if len(found) == 1 else -1

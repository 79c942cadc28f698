"""What the lines of an unknown device have in common: what stands around their numbers, and the numbers. Pure."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import xor

import numpy as np
from numpy.typing import NDArray

from rig.errors.quoting import quote, shorten
from rig.estimation.arrays import Array
from rig.sensors.lines.decoding import LONGEST_LINE
from rig.sensors.lines.fields import NUMBER, WORDS

MOST_NUMBERS = 40  # in a line, as a section has room for
LARGEST = 1e30  # what is beyond was not measured, and its square overflows
ENOUGH = 0.6  # share of the lines that have to be alike
FEWEST = 30
_NUMBER = re.compile(r"(?<![A-Za-z0-9_.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![A-Za-z0-9_])")
_SUM = re.compile(r"\*([0-9A-Fa-f]{2})$")
_SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", "": "space"}
_Told = tuple["Line", str, bool]  # a line, its text without a sum at its end, and whether that is the sum
_AROUND = " \t,;{}[]()|&"
_COLOURS = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
_BEFORE_A_NUMBER = re.compile(r"(.*[^0-9.+\-])([-+]?[0-9.]+(?:[eE][-+]?\d+)?)")
MOSTLY = 0.9  # share of a column's fields that are numbers, or none, in one that holds numbers


@dataclass(frozen=True, slots=True)
class Line:
    """A line and when it arrived."""

    arrived_s: float
    text: str


@dataclass(frozen=True, slots=True)
class Shape:
    """What stands around the numbers of a sample: as the keys of a section `lines` say it; `names` as a header does.

    `values` (n, columns) are the numbers, which arrived at `arrived_s` (n,), NaN where a column holds none or a text;
    `decimals` (columns,) the digits behind the point that all of a column have, -1 where they differ.
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


class NoShape(Exception):
    """Why lines have nothing in common, in a sentence."""


def shape_of(lines: Sequence[Line]) -> Shape:
    """The shape that most lines have. Raises NoShape."""
    plain = [Line(line.arrived_s, _COLOURS.sub("", line.text).strip()) for line in lines]
    told = _short_ones([(line, *_without_sum(line.text)) for line in plain if line.text])
    try:
        shape = _of_numbers(told)
    except NoShape:
        divided = _of_fields(told)
        if divided is None:
            raise
        shape = divided
    if not shape.arrived_s[-1] > shape.arrived_s[0]:
        raise NoShape("all its lines came at the same moment")
    return shape


def _of_numbers(told: Sequence[_Told]) -> Shape:
    """The shape of lines that hold numbers alone. Raises NoShape."""
    pieces = [tuple(piece.strip(" ") for piece in _NUMBER.split(text)) for _, text, _ in told]
    common = _common(pieces)
    alike = [each for each, its in zip(told, pieces, strict=True) if its == common]
    if any(not ok for _, _, ok in alike) and any(_SUM.search(line.text) for line, _, _ in alike):
        raise NoShape("its lines end as if with a sum, which is another one than NMEA's")
    separator, prefix, keys = _between(common)
    numbers = [_NUMBER.findall(text) for _, text, _ in alike]
    values = np.array(numbers, dtype=np.float64)
    measured: NDArray[np.bool_] = np.all(np.abs(values) < LARGEST, axis=1)
    if np.count_nonzero(measured) < ENOUGH * len(told):
        raise NoShape(f"it prints numbers that nothing measures: {_one_beyond(numbers, values)}")
    arrived_s = np.array([line.arrived_s for line, _, _ in alike])[measured]
    others = [text for (_, text, _), its in zip(told, pieces, strict=True) if its != common]
    checksum = _SUM.search(alike[0][0].text) is not None
    columns = zip(*(row for row, is_measured in zip(numbers, measured, strict=True) if is_measured), strict=True)
    return Shape(
        separator,
        prefix,
        keys,
        checksum,
        tuple(key.strip(_AROUND + "\"':= ") for key in keys) or _header(others, separator, len(common) - 1),
        values[measured],
        arrived_s,
        tuple(map(_decimals, columns)),
        len(others) + int(np.count_nonzero(~measured)),
    )


def _short_ones(told: list[_Told]) -> list[_Told]:
    """The lines that are not too long to be one sample each. Raises NoShape where they are too few."""
    if len(told) < FEWEST:
        raise NoShape(f"only {len(told)} lines came, which is too few to see what they have in common")
    short = [each for each in told if len(each[1]) <= LONGEST_LINE]
    if len(short) < ENOUGH * len(told):
        raise NoShape(f"its lines are longer than {LONGEST_LINE} characters")
    return short


def _common(pieces: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """What stands around the numbers of most lines. Raises NoShape."""
    common, count = Counter(pieces).most_common(1)[0]
    numbers = len(common) - 1
    if count < ENOUGH * len(pieces):
        raise NoShape(
            f"only {count} of {len(pieces)} lines look alike: its lines are not one sample each, or of several kinds"
        )
    if numbers < 3:
        raise NoShape(f"a line holds {numbers} numbers, and three axes of a gyroscope are three")
    if numbers > MOST_NUMBERS:
        raise NoShape(f"a line holds {numbers} numbers, and a section has room for {MOST_NUMBERS}")
    return common


def _one_beyond(numbers: Sequence[Sequence[str]], values: Array) -> str:
    row, column = np.argwhere(~(np.abs(values) < LARGEST))[0]
    return shorten(numbers[row][column])


def _of_fields(told: Sequence[_Told]) -> Shape | None:
    """The shape of lines whose fields a separator divides: some hold a text, or nothing, such as behind the last."""
    for sign, name in sorted(_SEPARATORS.items(), reverse=True):
        rows = [[field.strip() for field in text.split(sign or None)] for _, text, _ in told]
        count, often = Counter(map(len, rows)).most_common(1)[0]
        alike = [place for place, row in enumerate(rows) if len(row) == count]
        if not 3 <= count <= MOST_NUMBERS or often < ENOUGH * len(told):
            continue
        fields = [rows[place] for place in alike]
        if not any(row[-1] for row in fields):
            fields, count = [row[:-1] for row in fields], count - 1
        prefix, fields = _without_prefix(fields)
        columns = [_column(column) for column in zip(*fields, strict=True)]
        numbers = [column for column in columns if column is not None]
        if len(numbers) < 3 or not all(told[place][2] for place in alike if _SUM.search(told[place][0].text)):
            continue
        return Shape(
            name,
            prefix,
            (),
            all(_SUM.search(told[place][0].text) for place in alike),
            _header([text for place, (_, text, _) in enumerate(told) if place not in set(alike)], name, count),
            np.column_stack([np.full(len(fields), np.nan) if column is None else column for column in columns]),
            np.array([told[place][0].arrived_s for place in alike]),
            tuple(_decimals(column) for column in zip(*fields, strict=True)),
            len(told) - len(alike),
        )
    return None


def _without_prefix(fields: list[list[str]]) -> tuple[str, list[list[str]]]:
    """What stands before the number in the first field of all rows, `*` for digits that change, and what is left."""
    split = [_BEFORE_A_NUMBER.fullmatch(row[0]) for row in fields]
    texts = {found.group(1) for found in split if found is not None}
    same = {re.sub(r"\d+", "*", text) for text in texts}
    if len(same) != 1 or any(found is None for found in split):
        return "", fields
    (prefix,) = texts if len(texts) == 1 else same
    return prefix, [[found.group(2), *row[1:]] for found, row in zip(split, fields, strict=True) if found is not None]


def _column(fields: Sequence[str]) -> Array | None:
    """(n,) the numbers of a column, NaN for none; None if it holds a text."""
    numbers = np.array([float(field) if NUMBER.fullmatch(field) else np.nan for field in fields])
    numbers[np.abs(numbers) >= LARGEST] = np.nan
    none = sum(field.lower() in WORDS for field in fields)
    if np.count_nonzero(np.isfinite(numbers)) + none < MOSTLY * len(fields) or none == len(fields):
        return None
    return numbers


def _without_sum(text: str) -> tuple[str, bool]:
    """The line without a sum at its end, and whether what stands there is the sum."""
    found = _SUM.search(text)
    if found is None:
        return text, False
    body = text[: found.start()]
    right = reduce(xor, body.lstrip("$!").encode(), 0) == int(found.group(1), 16)
    return body, right


def _between(common: tuple[str, ...]) -> tuple[str, str, tuple[str, ...]]:
    """Separator, prefix and keys of what stands before, between and after the numbers. Raises NoShape."""
    before, *inside, after = common
    if len({*inside}) == 1 and inside[0] in _SEPARATORS and not after.strip(_AROUND):
        if not after.strip() and before.strip(_AROUND):
            return _SEPARATORS[inside[0]], before, ()
        if not (before + after).strip():
            return _SEPARATORS[inside[0]], "", ()
    keys = tuple(piece.strip(_AROUND) for piece in (before, *inside))
    if all(keys) and len(set(keys)) == len(keys) and not after.strip(_AROUND):
        return "comma", "", keys
    raise NoShape(f"between its numbers stands {' … '.join(quote(piece) for piece in (before, *inside[:3], after))}")


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

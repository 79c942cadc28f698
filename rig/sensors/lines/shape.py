"""The common pattern of an unknown device's lines: the text around their numbers, and the numbers. Pure."""

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
from rig.sensors.lines.decoding import MAX_LINE_BYTES
from rig.sensors.lines.fields import MISSING, NUMBER

MAX_NUMBERS = 40  # in a line: the limit of a section
MAX_NUMBER = 1e30  # a larger one is no measurement, and its square overflows
MIN_ALIKE_FRACTION = 0.6  # of the lines
MIN_LINES = 30
_NUMBER = re.compile(r"(?<![A-Za-z0-9_.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![A-Za-z0-9_])")
_SUM = re.compile(r"\*([0-9A-Fa-f]{2})$")
_SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", "": "space"}
_CheckedLine = tuple["TimedLine", str, bool]  # a line, its text without checksum, and whether the checksum is right
_AROUND = " \t,;{}[]()|&"
_COLOURS = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
_BEFORE_A_NUMBER = re.compile(r"(.*[^0-9.+\-])([-+]?[0-9.]+(?:[eE][-+]?\d+)?)")
MIN_NUMERIC_FRACTION = 0.9  # of a numeric column's fields that are numbers or missing


@dataclass(frozen=True, slots=True)
class TimedLine:
    """A line and its time of arrival."""

    arrived_s: float
    text: str


@dataclass(frozen=True, slots=True)
class Shape:
    """The pattern of a sample's line, and the samples.

    - separator, prefix, keys, checksum: as in a section `lines`.
    - names: the columns' names in a header.
    - values (n, columns): the numbers, NaN if missing or text.
    - arrived_s (n,): the samples' times of arrival.
    - decimals (columns,): the decimals of a column, -1 if they vary.
    - others: the number of lines that do not have the pattern.
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
    """The reason why lines have no common pattern, in a sentence."""


def find_shape(lines: Sequence[TimedLine]) -> Shape:
    """Return the pattern of most lines. Raise NoShape."""
    plain = [TimedLine(line.arrived_s, _COLOURS.sub("", line.text).strip()) for line in lines]
    checked = _select_short([(line, *_split_sum(line.text)) for line in plain if line.text])
    try:
        shape = _find_number_shape(checked)
    except NoShape:
        field_shape = _find_field_shape(checked)
        if field_shape is None:
            raise
        shape = field_shape
    if not shape.arrived_s[-1] > shape.arrived_s[0]:
        raise NoShape("all its lines came at the same moment")
    return shape


def _find_number_shape(checked: Sequence[_CheckedLine]) -> Shape:
    """Return the shape of lines that hold only numbers. Raise NoShape."""
    texts = [tuple(part.strip(" ") for part in _NUMBER.split(text)) for _, text, _ in checked]
    common = _find_common(texts)
    alike = [line for line, line_texts in zip(checked, texts, strict=True) if line_texts == common]
    if any(not sum_ok for _, _, sum_ok in alike) and any(_SUM.search(line.text) for line, _, _ in alike):
        raise NoShape("its lines seem to end with a check sum, but not with NMEA's")
    separator, prefix, keys = _interpret_texts(common)
    numbers = [_NUMBER.findall(text) for _, text, _ in alike]
    values = np.array(numbers, dtype=np.float64)
    measured: NDArray[np.bool_] = np.all(np.abs(values) < MAX_NUMBER, axis=1)
    if np.count_nonzero(measured) < MIN_ALIKE_FRACTION * len(checked):
        raise NoShape(f"it prints numbers that no sensor measures: {_find_impossible(numbers, values)}")
    arrived_s = np.array([line.arrived_s for line, _, _ in alike])[measured]
    others = [text for (_, text, _), line_texts in zip(checked, texts, strict=True) if line_texts != common]
    checksum = _SUM.search(alike[0][0].text) is not None
    columns = zip(*(row for row, is_measured in zip(numbers, measured, strict=True) if is_measured), strict=True)
    return Shape(
        separator,
        prefix,
        keys,
        checksum,
        tuple(key.strip(_AROUND + "\"':= ") for key in keys) or _find_header(others, separator, len(common) - 1),
        values[measured],
        arrived_s,
        tuple(map(_common_decimals, columns)),
        len(others) + int(np.count_nonzero(~measured)),
    )


def _select_short(checked: list[_CheckedLine]) -> list[_CheckedLine]:
    """Return the lines that are short enough to hold a single sample. Raise NoShape if too few remain."""
    if len(checked) < MIN_LINES:
        raise NoShape(f"only {len(checked)} lines came, which is too few to see what they have in common")
    short = [line for line in checked if len(line[1]) <= MAX_LINE_BYTES]
    if len(short) < MIN_ALIKE_FRACTION * len(checked):
        raise NoShape(f"its lines are longer than {MAX_LINE_BYTES} characters")
    return short


def _find_common(texts: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Return the texts around the numbers of most lines. Raise NoShape."""
    common, count = Counter(texts).most_common(1)[0]
    numbers = len(common) - 1
    if count < MIN_ALIKE_FRACTION * len(texts):
        raise NoShape(
            f"only {count} of {len(texts)} lines look alike: its lines do not hold one sample each, or are of several "
            "kinds"
        )
    if numbers < 3:
        raise NoShape(f"a line holds {numbers} numbers, but a gyroscope needs three")
    if numbers > MAX_NUMBERS:
        raise NoShape(f"a line holds {numbers} numbers, but a section has room for {MAX_NUMBERS}")
    return common


def _find_impossible(numbers: Sequence[Sequence[str]], values: Array) -> str:
    row, column = np.argwhere(~(np.abs(values) < MAX_NUMBER))[0]
    return shorten(numbers[row][column])


def _find_field_shape(checked: Sequence[_CheckedLine]) -> Shape | None:
    """Return the shape of lines with a separator between fields; some fields hold text or nothing."""
    shapes = (_split_by(sign, name, checked) for sign, name in sorted(_SEPARATORS.items(), reverse=True))
    return next((shape for shape in shapes if shape is not None), None)


def _split_by(sign: str, name: str, checked: Sequence[_CheckedLine]) -> Shape | None:
    """Return the shape of lines with the separator `sign`, called `name`; None if most lines do not have it."""
    rows = [[field.strip() for field in text.split(sign or None)] for _, text, _ in checked]
    count, frequency = Counter(map(len, rows)).most_common(1)[0]
    if not 3 <= count <= MAX_NUMBERS or frequency < MIN_ALIKE_FRACTION * len(checked):
        return None
    alike = [line for line, row in zip(checked, rows, strict=True) if len(row) == count]
    others = [text for (_, text, _), row in zip(checked, rows, strict=True) if len(row) != count]
    return _find_columns(name, alike, [row for row in rows if len(row) == count], others)


def _find_columns(
    name: str, alike: Sequence[_CheckedLine], fields: list[list[str]], others: Sequence[str]
) -> Shape | None:
    """Return the shape of the lines `alike`, whose header is sought in the lines `others`.

    Return None if fewer than three columns hold numbers.
    """
    if not any(row[-1] for row in fields):
        fields = [row[:-1] for row in fields]
    count = len(fields[0])
    prefix, fields = _split_prefix(fields)
    columns = [_parse_column(column) for column in zip(*fields, strict=True)]
    has_sum = [_SUM.search(line.text) is not None for line, _, _ in alike]
    if sum(column is not None for column in columns) < 3 or any(
        np.greater(has_sum, [sum_ok for _, _, sum_ok in alike])
    ):
        return None
    return Shape(
        name,
        prefix,
        (),
        all(has_sum),
        _find_header(others, name, count),
        np.column_stack([np.full(len(fields), np.nan) if column is None else column for column in columns]),
        np.array([line.arrived_s for line, _, _ in alike]),
        tuple(_common_decimals(column) for column in zip(*fields, strict=True)),
        len(others),
    )


def _split_prefix(fields: list[list[str]]) -> tuple[str, list[list[str]]]:
    """Return the common text before the first number, with `*` for changing digits, and the rows without this text."""
    split = [_BEFORE_A_NUMBER.fullmatch(row[0]) for row in fields]
    texts = {match.group(1) for match in split if match is not None}
    patterns = {re.sub(r"\d+", "*", text) for text in texts}
    if len(patterns) != 1 or any(match is None for match in split):
        return "", fields
    (prefix,) = texts if len(texts) == 1 else patterns
    return prefix, [[match.group(2), *row[1:]] for match, row in zip(split, fields, strict=True) if match is not None]


def _parse_column(fields: Sequence[str]) -> Array | None:
    """Return the numbers (n,) of a column, NaN if missing; None if it holds a text."""
    numbers = np.array([float(field) if NUMBER.fullmatch(field) else np.nan for field in fields])
    numbers[np.abs(numbers) >= MAX_NUMBER] = np.nan
    missing = sum(field.lower() in MISSING for field in fields)
    if np.count_nonzero(np.isfinite(numbers)) + missing < MIN_NUMERIC_FRACTION * len(fields) or missing == len(fields):
        return None
    return numbers


def _split_sum(text: str) -> tuple[str, bool]:
    """Return a line without the checksum at its end, and whether the checksum is correct."""
    match = _SUM.search(text)
    if match is None:
        return text, False
    body = text[: match.start()]
    sum_ok = reduce(xor, body.lstrip("$!").encode(), 0) == int(match.group(1), 16)
    return body, sum_ok


def _interpret_texts(common: tuple[str, ...]) -> tuple[str, str, tuple[str, ...]]:
    """Return separator, prefix and keys from the texts before, between and after the numbers. Raise NoShape."""
    before, *inside, after = common
    if len({*inside}) == 1 and inside[0] in _SEPARATORS and not after.strip(_AROUND):
        if not after.strip() and before.strip(_AROUND):
            return _SEPARATORS[inside[0]], before, ()
        if not (before + after).strip():
            return _SEPARATORS[inside[0]], "", ()
    keys = tuple(part.strip(_AROUND) for part in (before, *inside))
    if all(keys) and len(set(keys)) == len(keys) and not after.strip(_AROUND):
        return "comma", "", keys
    raise NoShape(f"between its numbers is {' … '.join(quote(part) for part in (before, *inside[:3], after))}")


def _find_header(others: Sequence[str], separator: str, count: int) -> tuple[str, ...]:
    """Return the `count` column names that one of the other lines has; empty if none has them."""
    sign = {name: sign for sign, name in _SEPARATORS.items()}[separator]
    for text in others:
        names = [name.strip(" \"'") for name in text.lstrip("#%/ ").split(sign or None)]
        if len(names) == count and all(name and not _NUMBER.fullmatch(name) for name in names):
            return tuple(names)
    return ()


def _common_decimals(numbers: Sequence[str]) -> int:
    if any("e" in number.lower() for number in numbers):
        return -1
    counts = {len(number.partition(".")[2]) for number in numbers}
    return counts.pop() if len(counts) == 1 else -1

"""Lines of text decoded to arrays of numbers, in blocks of bytes as they arrive. Pure.

A line is a sample if it contains a number for each column, with the right separators and checksum, if any. Allowed are
a trailing separator, colour codes around the line, any text in an unused column, and in other columns an empty field or
a word for "none" (`rig.sensors.lines.fields`). All other lines are comments, or are rejected; both kinds are counted.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rig.config.sensors.lines_section import SEPARATORS, LinesSection
from rig.estimation.arrays import Array
from rig.sensors.lines.decimal_numbers import parse_numbers
from rig.sensors.lines.fields import TextFieldReader

MAX_LINE_BYTES = 2000  # longer input without a line end is no line
QUOTED = 120  # characters of a rejected line, in a message

# Classes of bytes.
_OTHER, _NUMBER, _SEPARATOR, _SPACE, _END, _KEY = range(6)
_KEYS = 0x80  # bytes from here on replace the keys during parsing; no key contains one
_NEWLINE, _STAR, _BLANK = (ord(character) for character in "\n* ")
_AROUND_KEYS = b",;{}[]()\"'|&"
COLOURS = re.compile(rb"\x1b\[[0-9;]*[A-Za-z]")  # ECMA-48 control sequences, which terminals use for colours
_HEX = np.full(256, 255, np.uint8)
for _value, _digit in enumerate("0123456789abcdef"):
    _HEX[[ord(_digit), ord(_digit.upper())]] = _value


@dataclass(frozen=True, slots=True)
class LineBatch:
    """Decoded lines: `values` (n, columns) of the samples, as printed, and counts of all other lines.

    A value that the device does not provide is NaN, as is text in an unused column. `samples_before` (m,): for each of
    the m rejected lines, which are neither samples nor comments, the number of this block's samples before it.
    `first_rejected`: the beginning of the first rejected line.
    """

    values: Array
    samples_before: NDArray[np.int64]
    comments: int
    first_rejected: bytes


class LineReader:
    """The parser of a byte stream in blocks of any size, which skips the first line, because it may be incomplete."""

    def __init__(self, section: LinesSection) -> None:
        self._columns = len(section.columns)
        # Digits that change from line to line, marked by *, are replaced by a constant.
        self._changing = section.prefix_pattern
        self._prefix, self._comment = section.prefix.replace("*", "0").encode(), section.comment.encode()
        self._keys = _markers(section.keys)
        self._has_checksum = section.checksum == "nmea"
        self._separator = b"" if section.keys else SEPARATORS[section.separator].strip(b" ")
        self._classes = _classes(self._separator, keyed=bool(section.keys))
        self._fields = TextFieldReader(section)
        self._rest = b""
        self._is_aligned = False
        self._has_time = "time" in section.columns
        self.time_decimals = 0  # most decimals of the time so far
        self.unprintable = 0  # bytes that are not text
        self.byte_count = 0

    def feed(self, data: bytes) -> LineBatch:
        """Add received bytes; return the lines that are now complete."""
        self.byte_count += len(data)
        data = (self._rest + data).replace(b"\r", b"\n")
        end = data.rfind(b"\n") + 1
        self._rest = data[end:]
        if len(self._rest) > MAX_LINE_BYTES:  # the rest of it becomes a rejected line
            data, end, self._rest = self._rest + b"\n", len(self._rest) + 1, b""
        data = COLOURS.sub(b"", data[:end])
        end = len(data)
        if self._changing is not None:
            data = self._changing.sub(self._prefix, data)
            end = len(data)
        if not self._is_aligned and end:
            self._is_aligned, data = True, data[data.find(b"\n") + 1 :]
        if not data:
            return self._make_empty(0)
        return self._decode(data)

    def _make_empty(self, comments: int) -> LineBatch:
        return LineBatch(np.zeros((0, self._columns)), np.zeros(0, np.int64), comments, b"")

    def _decode(self, data: bytes) -> LineBatch:
        """Return the samples of whole lines, and the counts of other lines.

        All lines are parsed at once. Lines with a right prefix and checksum that this fails to parse, usually because a
        field holds no number, are then read one by one, which is slower.

        `raw` has the bytes as received. In the copy `bare`, prefixes and checksums are blank; in `text`, keys are also
        replaced by markers. All three have equal length, so positions in one are valid in the others.
        """
        raw = np.frombuffer(data, np.uint8)
        self.unprintable += int(np.count_nonzero((raw >= 0x7F) | (raw < 9)))
        line_ends = np.flatnonzero(raw == _NEWLINE)
        line_starts = np.concatenate([[0], line_ends[:-1] + 1])
        filled = line_ends > line_starts
        line_starts, line_ends = line_starts[filled], line_ends[filled]
        is_comment = self._match(raw, line_starts, self._comment) if self._comment else np.zeros(len(filled), bool)
        if self._comment:
            line_starts, line_ends = line_starts[~is_comment], line_ends[~is_comment]
        comments = int(np.count_nonzero(is_comment))
        if not len(line_starts):
            return self._make_empty(comments)
        text = raw.copy()
        good = np.ones(len(line_starts), np.bool_)
        if self._prefix:
            good &= self._match(raw, line_starts, self._prefix)
            positions = line_starts[good][:, None] + np.arange(len(self._prefix))
            text[positions] = _BLANK
        sum_ok = self._match_checksums(raw, text, line_starts, line_ends) if self._has_checksum else np.ones_like(good)
        is_framed, bare = good & sum_ok, text  # right prefix and checksum; copied before `good` is changed in place
        if self._keys:
            text = self._mark_keys(text)
        classes = self._classes[text]
        good &= _have_valid_bytes(classes, line_starts, line_ends)
        numbers = self._parse_values(text, classes, (line_starts, line_ends), good, sum_ok)  # also changes `good`
        is_sample = good & sum_ok
        values = np.full((len(is_sample), self._columns), np.nan)
        values[is_sample] = numbers
        for line in np.flatnonzero(is_framed & ~is_sample).tolist():  # these need the slower reader
            line_values = self._fields.read(bare[line_starts[line] : line_ends[line]].tobytes())
            if line_values is not None:
                values[line], is_sample[line] = line_values, True
        values = values[is_sample]
        if self._has_time and len(values):
            line = int(np.argmax(is_sample))
            digits = self._fields.decimals(bare[line_starts[line] : line_ends[line]].tobytes(), "time")
            self.time_decimals = max(self.time_decimals, digits)
        samples_before = np.cumsum(is_sample, dtype=np.int64)[~is_sample]
        first_rejected = b""
        if len(samples_before):
            index = int(np.argmin(is_sample))
            first_rejected = bytes(data[line_starts[index] : min(line_ends[index], line_starts[index] + QUOTED)])
        return LineBatch(values, samples_before, comments, first_rejected)

    @staticmethod
    def _match(raw: NDArray[np.uint8], starts: NDArray[np.intp], text: bytes) -> NDArray[np.bool_]:
        """Return a mask of the lines that begin with `text`, which contains no line end."""
        expected = np.frombuffer(text, np.uint8)
        positions = np.minimum(starts[:, None] + np.arange(len(expected)), len(raw) - 1)
        matches: NDArray[np.bool_] = (raw[positions] == expected).all(axis=1)
        return matches

    @staticmethod
    def _match_checksums(
        raw: NDArray[np.uint8], text: NDArray[np.uint8], starts: NDArray[np.intp], ends: NDArray[np.intp]
    ) -> NDArray[np.bool_]:
        """Return a mask of lines with a correct checksum `*hh` (XOR).

        In `text`, replace these checksums and the `$` or `!` at the start of their lines by blanks.
        """
        star = np.maximum(ends - 3, 0)
        high, low = _HEX[raw[ends - 2]], _HEX[raw[ends - 1]]
        body_starts = starts + np.isin(raw[starts], np.frombuffer(b"$!", np.uint8))
        sum_ok: NDArray[np.bool_] = (ends - starts > 3) & (raw[star] == _STAR) & (high < 16) & (low < 16)
        xor_before = np.concatenate([[0], np.bitwise_xor.accumulate(raw)])  # XOR of all bytes before each position
        sum_ok &= (xor_before[star] ^ xor_before[np.minimum(body_starts, star)]) == (high << 4 | low)
        for offset in (1, 2, 3):
            text[ends[sum_ok] - offset] = _BLANK
        first = starts[sum_ok & (body_starts > starts)]
        text[first] = _BLANK
        return sum_ok

    def _mark_keys(self, text: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the text with keys replaced by their markers, after replacing bytes that look like a marker."""
        data = np.where(text >= _KEYS, np.uint8(0x7F), text).tobytes()
        for key, marker in self._keys.items():
            data = data.replace(key, marker)
        return np.frombuffer(data, np.uint8)

    def _parse_values(
        self,
        text: NDArray[np.uint8],
        classes: NDArray[np.uint8],
        lines: tuple[NDArray[np.intp], NDArray[np.intp]],
        good: NDArray[np.bool_],
        sum_ok: NDArray[np.bool_],
    ) -> Array:
        """Return the numbers (m, columns) of the m lines that are `good`, have a right checksum and have all numbers.

        `lines` are the positions of all starts and all ends of lines; `good` and `sum_ok` are masks of the lines.
        `good` is cleared in place for lines without all numbers.
        """
        line_starts, line_ends = lines
        number = np.concatenate([[False], classes == _NUMBER, [False]])
        edges = np.flatnonzero(number[1:] != number[:-1])
        starts, ends = edges[::2], edges[1::2]  # of each run of number characters
        good &= _count(starts, line_starts, line_ends) == self._columns
        dividers = np.flatnonzero(classes == (_KEY if self._keys else _SEPARATOR))
        has_dividers = bool(self._keys or self._separator)
        divider_count = self._columns if self._keys else self._columns - 1
        if has_dividers:
            good &= _count(dividers, line_starts, line_ends) == divider_count
        # Good lines now have equal numbers of runs and of dividers, so both become arrays with a row for each line.
        in_good_lines = _are_in_lines(starts, line_starts, line_ends, good)
        starts, ends = starts[in_good_lines].reshape(-1, self._columns), ends[in_good_lines].reshape(-1, self._columns)
        if has_dividers:
            marks = dividers[_are_in_lines(dividers, line_starts, line_ends, good)].reshape(-1, divider_count)
            if self._keys:
                keys_match = (text[marks] == _KEYS + np.arange(self._columns)).all(axis=1)
                ordered = (marks < starts).all(axis=1) & (ends[:, :-1] <= marks[:, 1:]).all(axis=1) & keys_match
            else:
                ordered = ((ends[:, :-1] <= marks) & (marks < starts[:, 1:])).all(axis=1)
            good[np.flatnonzero(good)[~ordered]] = False
            starts, ends = starts[ordered], ends[ordered]
        has_right_sum = sum_ok[good]
        starts, ends = starts[has_right_sum], ends[has_right_sum]
        values = parse_numbers(text, starts.ravel(), ends.ravel()).reshape(-1, self._columns)
        numbers = np.isfinite(values).all(axis=1)
        good[np.flatnonzero(good & sum_ok)[~numbers]] = False
        return values[numbers]


def _have_valid_bytes(
    classes: NDArray[np.uint8], line_starts: NDArray[np.intp], line_ends: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Return a mask of the lines in which no byte has the class `_OTHER`; bytes between lines belong to no line."""
    good = np.ones(len(line_starts), np.bool_)
    others = np.flatnonzero(classes == _OTHER)
    if len(others):
        line = np.searchsorted(line_starts, others, side="right") - 1
        inside = (line >= 0) & (others < line_ends[line])
        good[line[inside]] = False
    return good


def _count(positions: NDArray[np.intp], line_starts: NDArray[np.intp], line_ends: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return how many of the increasing `positions` lie in each line."""
    counts: NDArray[np.intp] = np.searchsorted(positions, line_ends) - np.searchsorted(positions, line_starts)
    return counts


def _are_in_lines(
    positions: NDArray[np.intp],
    line_starts: NDArray[np.intp],
    line_ends: NDArray[np.intp],
    selection: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return a mask of the `positions` in the selected lines."""
    first, after = np.searchsorted(positions, line_starts[selection]), np.searchsorted(positions, line_ends[selection])
    if int((after - first).sum()) == len(positions):  # the usual case
        return np.ones(len(positions), np.bool_)
    steps = np.zeros(len(positions) + 1, np.int64)
    np.add.at(steps, first, 1)
    np.add.at(steps, after, -1)
    inside: NDArray[np.bool_] = np.cumsum(steps[:-1]) > 0
    return inside


def _markers(keys: tuple[str, ...]) -> Mapping[bytes, bytes]:
    """Return a marker of equal length for each key. Longer keys come first, because they may contain shorter ones."""
    by_length = sorted(enumerate(keys), key=lambda indexed_key: -len(indexed_key[1]))
    return MappingProxyType({key.encode(): bytes([_KEYS + index]) + b" " * (len(key) - 1) for index, key in by_length})


def _classes(separator: bytes, *, keyed: bool) -> NDArray[np.uint8]:
    """Return a table of the class of each of the 256 bytes: part of a number, space, key, separator, end or other."""
    classes = np.full(256, _OTHER, np.uint8)
    classes[np.frombuffer(b"0123456789+-.eE", np.uint8)] = _NUMBER
    classes[np.frombuffer(b" \t", np.uint8)] = _SPACE
    if keyed:
        classes[_KEYS:] = _KEY
        classes[np.frombuffer(_AROUND_KEYS, np.uint8)] = _SPACE
    if separator:
        classes[separator[0]] = _SEPARATOR
    classes[_NEWLINE] = _END
    return classes

"""Lines of text to arrays of numbers, in blocks of bytes as they come. Pure.

A line is a sample when it holds as many numbers as there are columns, with the right things between them, and its
checksum is right if there is one. A separator may stand behind the last, codes for colours around the line, any text in
a column that is not read, and nothing, or a word that means it, in one that is: see `rig.sensors.lines.fields`.
Everything else is counted as what it is.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from rig.config.sensors.lines_section import SEPARATORS, LinesSection
from rig.estimation.arrays import Array
from rig.sensors.lines.fields import FieldReader
from rig.sensors.lines.numbers import numbers_at

LONGEST_LINE = 2000  # bytes; what has no end for so long is no line
KEPT_TEXT = 120  # of a line that was no sample, for whoever has to see why

# Classes of bytes.
_OTHER, _NUMBER, _SEPARATOR, _SPACE, _END, _KEY = range(6)
_KEYS = 0x80  # bytes from here on stand for the keys while a line is looked at; no key has one
_NEWLINE, _STAR, _BLANK = (ord(each) for each in "\n* ")
_AROUND_KEYS = b",;{}[]()\"'|&"
COLOURS = re.compile(rb"\x1b\[[0-9;]*[A-Za-z]")  # ECMA-48, control sequences, as terminals have them for colours
_HEX = np.full(256, 255, np.uint8)
for _place, _digit in enumerate("0123456789abcdef"):
    _HEX[[ord(_digit), ord(_digit.upper())]] = _place


@dataclass(frozen=True, slots=True)
class Decoded:
    """What bytes held: `values` (n, columns) of the samples, as printed, and how many lines were none.

    A value that the device does not provide is NaN, and so is the text of a column that is not read.
    `before` (m,) says of each line that was no sample, and no comment, how many samples of these stood before it;
    `why` is how the first of them begins.
    """

    values: Array
    before: NDArray[np.int64]
    comments: int
    why: bytes


class LineReader:
    """Finds samples in bytes that come in pieces of any size. The first line is left out: it may be half of one."""

    def __init__(self, section: LinesSection) -> None:
        self._columns = len(section.columns)
        # Digits that change from line to line, for which a * stands, are made the same.
        self._changing = section.prefix_pattern
        self._prefix, self._comment = section.prefix.replace("*", "0").encode(), section.comment.encode()
        self._keys = _markers(section.keys)
        self._summed = section.checksum == "nmea"
        self._separator = b"" if section.keys else SEPARATORS[section.separator].strip(b" ")
        self._classes = _classes(self._separator, keyed=bool(section.keys))
        self._fields = FieldReader(section)
        self._rest = b""
        self._begun = False
        self._timed = "time" in section.columns
        self.time_decimals = 0  # digits behind the point of the time, as far as they were seen
        self.unprintable = 0  # bytes that no text has
        self.bytes_seen = 0

    def feed(self, data: bytes) -> Decoded:
        """What is complete with these bytes."""
        self.bytes_seen += len(data)
        data = (self._rest + data).replace(b"\r", b"\n")
        end = data.rfind(b"\n") + 1
        self._rest = data[end:]
        if len(self._rest) > LONGEST_LINE:  # what is left of it ends as a line that is none
            data, end, self._rest = self._rest + b"\n", len(self._rest) + 1, b""
        data = COLOURS.sub(b"", data[:end])
        end = len(data)
        if self._changing is not None:
            data = self._changing.sub(self._prefix, data)
            end = len(data)
        if not self._begun and end:
            self._begun, data = True, data[data.find(b"\n") + 1 :]
        if not data:
            return self._nothing(0)
        return self._decode(data)

    def _nothing(self, comments: int) -> Decoded:
        return Decoded(np.zeros((0, self._columns)), np.zeros(0, np.int64), comments, b"")

    def _decode(self, data: bytes) -> Decoded:
        raw = np.frombuffer(data, np.uint8)
        self.unprintable += int(np.count_nonzero((raw >= 0x7F) | (raw < 9)))
        line_ends = np.flatnonzero(raw == _NEWLINE)
        line_starts = np.concatenate([[0], line_ends[:-1] + 1])
        some = line_ends > line_starts
        line_starts, line_ends = line_starts[some], line_ends[some]
        commented = self._begin_with(raw, line_starts, self._comment) if self._comment else np.zeros(len(some), bool)
        if self._comment:
            line_starts, line_ends = line_starts[~commented], line_ends[~commented]
        comments = int(np.count_nonzero(commented))
        if not len(line_starts):
            return self._nothing(comments)
        text = raw.copy()
        good = np.ones(len(line_starts), np.bool_)
        if self._prefix:
            good &= self._begin_with(raw, line_starts, self._prefix)
            places = line_starts[good][:, None] + np.arange(len(self._prefix))
            text[places] = _BLANK
        right = self._sums(raw, text, line_starts, line_ends) if self._summed else np.ones_like(good)
        prefixed, bare = good & right, text
        if self._keys:
            text = self._keys_marked(text)
        classes = self._classes[text]
        good &= _hold_nothing_else(classes, line_starts, line_ends)
        numbers = self._values(text, classes, (line_starts, line_ends), good, right)
        taken = good & right
        values = np.full((len(taken), self._columns), np.nan)
        values[taken] = numbers
        for line in np.flatnonzero(prefixed & ~taken).tolist():
            read = self._fields.read(bare[line_starts[line] : line_ends[line]].tobytes())
            if read is not None:
                values[line], taken[line] = read, True
        values = values[taken]
        if self._timed and len(values):
            line = int(np.argmax(taken))
            digits = self._fields.decimals(bare[line_starts[line] : line_ends[line]].tobytes(), "time")
            self.time_decimals = max(self.time_decimals, digits)
        before = np.cumsum(taken, dtype=np.int64)[~taken]
        why = b""
        if len(before):
            place = int(np.argmin(taken))
            why = bytes(data[line_starts[place] : min(line_ends[place], line_starts[place] + KEPT_TEXT)])
        return Decoded(values, before, comments, why)

    @staticmethod
    def _begin_with(raw: NDArray[np.uint8], starts: NDArray[np.intp], text: bytes) -> NDArray[np.bool_]:
        """Which lines begin with `text`; a line's end is no part of it, so no shorter line does."""
        wanted = np.frombuffer(text, np.uint8)
        places = np.minimum(starts[:, None] + np.arange(len(wanted)), len(raw) - 1)
        found: NDArray[np.bool_] = (raw[places] == wanted).all(axis=1)
        return found

    @staticmethod
    def _sums(
        raw: NDArray[np.uint8], text: NDArray[np.uint8], starts: NDArray[np.intp], ends: NDArray[np.intp]
    ) -> NDArray[np.bool_]:
        """Which lines end with `*hh`, the XOR of what stands before; that end is blanked out in `text`."""
        star = np.maximum(ends - 3, 0)
        high, low = _HEX[raw[ends - 2]], _HEX[raw[ends - 1]]
        begun = starts + np.isin(raw[starts], np.frombuffer(b"$!", np.uint8))
        right: NDArray[np.bool_] = (ends - starts > 3) & (raw[star] == _STAR) & (high < 16) & (low < 16)
        up_to = np.concatenate([[0], np.bitwise_xor.accumulate(raw)])  # of all bytes before each
        right &= (up_to[star] ^ up_to[np.minimum(begun, star)]) == (high << 4 | low)
        for back in (1, 2, 3):
            text[ends[right] - back] = _BLANK
        first = starts[right & (begun > starts)]
        text[first] = _BLANK
        return right

    def _keys_marked(self, text: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The text with one byte for each key; a byte that only looks like one is made something else first."""
        data = np.where(text >= _KEYS, np.uint8(0x7F), text).tobytes()
        for key, marker in self._keys.items():
            data = data.replace(key, marker)
        return np.frombuffer(data, np.uint8)

    def _values(
        self,
        text: NDArray[np.uint8],
        classes: NDArray[np.uint8],
        lines: tuple[NDArray[np.intp], NDArray[np.intp]],
        good: NDArray[np.bool_],
        right: NDArray[np.bool_],
    ) -> Array:
        """The numbers of lines that hold as many as there are columns, in order; `good` says afterwards which do."""
        line_starts, line_ends = lines
        number = np.concatenate([[False], classes == _NUMBER, [False]])
        edges = np.flatnonzero(number[1:] != number[:-1])
        starts, ends = edges[::2], edges[1::2]
        good &= _count(starts, line_starts, line_ends) == self._columns
        between = np.flatnonzero(classes == (_KEY if self._keys else _SEPARATOR))
        divided = bool(self._keys or self._separator)
        wanted = self._columns if self._keys else self._columns - 1
        if divided:
            good &= _count(between, line_starts, line_ends) == wanted
        mine = _of_lines(starts, line_starts, line_ends, good)
        starts, ends = starts[mine].reshape(-1, self._columns), ends[mine].reshape(-1, self._columns)
        if divided:
            parts = between[_of_lines(between, line_starts, line_ends, good)].reshape(-1, wanted)
            if self._keys:
                named = (text[parts] == _KEYS + np.arange(self._columns)).all(axis=1)
                ordered = (parts < starts).all(axis=1) & (ends[:, :-1] <= parts[:, 1:]).all(axis=1) & named
            else:
                ordered = ((ends[:, :-1] <= parts) & (parts < starts[:, 1:])).all(axis=1)
            good[np.flatnonzero(good)[~ordered]] = False
            starts, ends = starts[ordered], ends[ordered]
        summed = right[good]
        starts, ends = starts[summed], ends[summed]
        values = numbers_at(text, starts.ravel(), ends.ravel()).reshape(-1, self._columns)
        numbers = np.isfinite(values).all(axis=1)
        good[np.flatnonzero(good & right)[~numbers]] = False
        return values[numbers]


def _hold_nothing_else(
    classes: NDArray[np.uint8], line_starts: NDArray[np.intp], line_ends: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Which lines hold nothing that no sample holds. What stands between lines belongs to none."""
    good = np.ones(len(line_starts), np.bool_)
    others = np.flatnonzero(classes == _OTHER)
    if len(others):
        line = np.searchsorted(line_starts, others, side="right") - 1
        inside = (line >= 0) & (others < line_ends[line])
        good[line[inside]] = False
    return good


def _count(places: NDArray[np.intp], line_starts: NDArray[np.intp], line_ends: NDArray[np.intp]) -> NDArray[np.intp]:
    """How many of `places`, which increase, lie in each line."""
    found: NDArray[np.intp] = np.searchsorted(places, line_ends) - np.searchsorted(places, line_starts)
    return found


def _of_lines(
    places: NDArray[np.intp],
    line_starts: NDArray[np.intp],
    line_ends: NDArray[np.intp],
    which: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Which of `places` lie in those lines."""
    first, after = np.searchsorted(places, line_starts[which]), np.searchsorted(places, line_ends[which])
    if int((after - first).sum()) == len(places):  # as a rule
        return np.ones(len(places), np.bool_)
    steps = np.zeros(len(places) + 1, np.int64)
    np.add.at(steps, first, 1)
    np.add.at(steps, after, -1)
    found: NDArray[np.bool_] = np.cumsum(steps[:-1]) > 0
    return found


def _markers(keys: tuple[str, ...]) -> Mapping[bytes, bytes]:
    """What stands for each key while a line is looked at, of the same length; long keys first, that may hold others."""
    by_length = sorted(enumerate(keys), key=lambda each: -len(each[1]))
    return MappingProxyType({key.encode(): bytes([_KEYS + place]) + b" " * (len(key) - 1) for place, key in by_length})


def _classes(separator: bytes, *, keyed: bool) -> NDArray[np.uint8]:
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

"""The parser of single lines in which some columns hold text that is not used, or no value."""

import re
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from rig.config.sensors.lines_section import GYROSCOPE, SEPARATORS, LinesSection
from rig.data.not_provided import RANGE_C, Absent
from rig.estimation.arrays import Array

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
# Texts that programs print for a missing value: C's and Python's words, Arduino's "ovf", an empty field.
MISSING = frozenset({"", "-", "--", "nan", "-nan", "null", "none", "na", "n/a", "inf", "-inf", "+inf", "ovf", "nil"})
# -127 is DallasTemperature's DEVICE_DISCONNECTED_C; others print 999 or -273.15: all are impossible.
NOT_PROVIDED: Mapping[str, Absent] = MappingProxyType({"temperature": Absent(within=RANGE_C)})
REQUIRED_VALUES = ("time", "sequence", *GYROSCOPE)  # of a sample
_AROUND_KEYS = " \t,;{}[]()\"'|&"


class TextFieldReader:
    """The reader of single lines, in the form of a section `lines`, that `LineReader` cannot parse as numbers."""

    def __init__(self, section: LinesSection) -> None:
        self._columns = section.columns
        self._separator = SEPARATORS[section.separator].decode().strip(" ") or None
        keys = "(.*?)".join(map(re.escape, section.keys))
        self._keyed = re.compile(f".*?{keys}(.*)") if section.keys else None

    def read(self, line: bytes) -> Array | None:
        """Return the values (columns,) of a line without prefix and checksum, NaN if missing; None if not a sample."""
        fields = self._split(line.decode("ascii", "replace"))
        if len(fields) == len(self._columns) + 1 and not fields[-1]:
            fields.pop()
        if len(fields) != len(self._columns):
            return None
        values = np.full(len(fields), np.nan)
        for index, (name, field) in enumerate(zip(self._columns, fields, strict=True)):
            number = float(field) if NUMBER.fullmatch(field) else np.nan
            values[index] = number if np.isfinite(number) else np.nan
            absent = np.isnan(number) and field.lower() in MISSING
            if name != "-" and not np.isfinite(number) and (name in REQUIRED_VALUES or not absent):
                return None
        return values

    def decimals(self, line: bytes, column: str) -> int:
        """Return the number of decimals of a column's number; 0 without a point."""
        fields = self._split(line.decode("ascii", "replace"))
        index = self._columns.index(column)
        return len(fields[index].partition(".")[2]) if index < len(fields) else 0

    def _split(self, text: str) -> list[str]:
        if self._keyed is not None:
            match = self._keyed.fullmatch(text)
            return [] if match is None else [group.strip(_AROUND_KEYS) for group in match.groups()]
        return [text_field.strip() for text_field in text.split(self._separator)]

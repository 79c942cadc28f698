"""The contents of another program's file, read by the functions that also read it for a calibration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rig.config.column_map import STANDARD_NAMES, TIMES, ColumnMap
from rig.config.units import UNITS
from rig.data.quantity import RATE, Quantity
from rig.data.recording.motion_file import MOTIONS, TIME, Columns, Header
from rig.errors import Refused, RigError
from rig.estimation.arrays import Array
from rig.observation.external.attitude_import import read_attitudes, select_reports
from rig.observation.external.csv_samples import SAMPLES_MB, Samples, read_sample_table, samples_in
from rig.observation.external.omission import Omitted
from rig.observation.formats.column_selection import MappedColumns, map_motion, map_samples
from rig.observation.formats.csv_table import read_table
from rig.observation.formats.mat_table import is_mat
from rig.observation.formats.sample_files import is_in_format
from rig.observation.formats.table_layout import TableLayout, find_layout
from rig.observation.log_survey import LogSurvey, survey_log
from rig.sensors.lines.column_units import UNSTATED
from rig.sensors.lines.log_columns import LogColumns, guess_columns


@dataclass(frozen=True, slots=True)
class LookedFile:
    """The contents of a file of another program.

    - layout: how numbers and headings are arranged, if the file is a table whose columns are guessed; else None.
    - guess: the probable content of each column of such a table; else None.
    - columns: the map of the columns, in the form of `--columns`; it is incomplete if it contains "?".
    - samples: the readings, None if they cannot be read.
    - survey: a summary of the readings.
    - others: the number of rows without readings.
    - note: a sentence on what the readings lack.
    - origin_s: the time on the file's clock from which the times of the readings count.
    - attitudes: the reports of a reference, with times on their own clock; None if there are none.
    - omitted_attitudes: the rows left out because they contain no valid attitude.
    - refusals: why readings or attitudes could not be read.
    """

    path: Path
    layout: TableLayout | None
    guess: LogColumns | None
    columns: Mapping[str, Any]
    samples: Samples | None = None
    survey: LogSurvey | None = None
    others: int = 0
    note: str = ""
    origin_s: int = 0
    attitudes: Columns | None = None
    omitted_attitudes: tuple[Omitted, ...] = ()
    refusals: tuple[RigError, ...] = ()

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The quantities of the file's readings."""
        return () if self.samples is None else tuple(self.samples.readings)

    @property
    def has_readings(self) -> bool:
        """Whether the file has readings, even if they could not be read yet."""
        return self.samples is not None or "samples" in self.columns


def look_at(path: Path, stated: ColumnMap | None = None) -> LookedFile:
    """Return the contents of a file, whose columns are those in the map `stated`, or are guessed if it is None.

    Raise Refused `bad_option` for a file of sweeps, and what `find_layout` raises for a file that is not a table.
    """
    if is_in_format(path):
        return _read_contents(LookedFile(path, None, None, {}), STANDARD_NAMES, has_readings=True, has_attitudes=True)
    if stated is not None:
        # A reference whose columns have the rig's own names needs no map.
        looked = _read_contents(LookedFile(path, None, None, {}), stated, has_readings=True, has_attitudes=True)
        return looked if stated.motion else replace(looked, refusals=looked.refusals[:1])
    layout = find_layout(path, SAMPLES_MB)
    if set(layout.headings).issuperset(MOTIONS["sweeps"].needed):
        remedy = f"Give it with its log: rig solve LOG --sweeps {path}"
        raise Refused("bad_option", f"{path} is not a log: it states sweeps, in the rig's own columns", remedy)
    values, time = _read_numbers(path, layout)
    guess = guess_columns(layout, values, time, path.stem)
    columns = _map_of(layout, guess)
    looked = LookedFile(path, layout, guess, columns)
    if is_incomplete(columns):
        return looked
    column_map = ColumnMap.model_validate(columns)
    return _read_contents(looked, column_map, has_readings=len(guess.samples) > 1, has_attitudes=len(guess.motion) > 1)


def find_pair(looks: Sequence[LookedFile]) -> tuple[LookedFile | None, LookedFile | None]:
    """Return the file with readings and the file with attitudes, each None if missing.

    If both exist, the times of the attitudes count from the same origin as those of the readings.
    """
    log = next((looked for looked in looks if looked.samples is not None), None)
    reference = _find_reference(looks)
    return log, reference if log is None or reference is None else _count_from(reference, log.origin_s)


def join_maps(looks: Sequence[LookedFile]) -> dict[str, Any]:
    """Return one map of all files' columns; attitudes in a log are left out if another file is the reference."""
    reference = _find_reference(looks)
    columns: dict[str, Any] = {}
    for looked in reversed(looks):  # if there are two files, the first has the readings
        is_other = reference is not None and looked.has_readings > reference.has_readings
        columns |= {key: value for key, value in looked.columns.items() if not (is_other and key.startswith("motion"))}
    return columns


def _find_reference(looks: Sequence[LookedFile]) -> LookedFile | None:
    """Return the file with the attitudes, preferably one that has no readings; None if no file has attitudes."""
    with_attitudes = [looked for looked in looks if looked.attitudes is not None]
    return min(with_attitudes, key=lambda looked: looked.has_readings, default=None)


def _count_from(looked: LookedFile, origin_s: int) -> LookedFile:
    """Return a reference's file with the attitudes' times counted from `origin_s`, as those of a log's readings are."""
    if looked.attitudes is None or not origin_s:
        return looked
    times = {name: looked.attitudes[name] - origin_s for name in ("start_s", "end_s")}
    return replace(looked, attitudes={**looked.attitudes, **times})


def correct_rate_unit(looked: LookedFile, ratio: float) -> LookedFile:
    """Return a file with the gyroscope's unit corrected, if it was guessed by the size of its readings.

    `ratio`: the rate that the attitudes show, divided by the gyroscope's reading.
    """
    if (
        looked.layout is None
        or looked.guess is None
        or (guess := looked.guess.correct_rate_unit(ratio)) is looked.guess
    ):
        return looked
    columns = _map_of(looked.layout, guess)
    corrected = replace(looked, guess=guess, columns=columns)
    return _read_contents(corrected, ColumnMap.model_validate(columns), has_readings=True, has_attitudes=False)


def is_incomplete(columns: Mapping[str, Any]) -> bool:
    """Return whether a map contains a "?" in place of a number."""
    return UNSTATED in columns.values() or any(
        UNSTATED in entry.values()
        for section in columns.values()
        if isinstance(section, dict)
        for entry in section.values()
    )


def _read_numbers(path: Path, layout: TableLayout) -> tuple[Array, Array | None]:
    """Return all numbers (n, k) of a table, NaN if missing, and the times (n,) in their column's unit, None without."""
    unit_s = 1.0 if layout.time_unit is None else UNITS[layout.time_unit].size
    # A workspace of MATLAB has columns of other tables too: there a column's number is not that in the layout.
    names = layout.headings if is_mat(path) else [str(index + 1) for index in range(len(layout.headings))]
    columns = {f"column_{index}": (names[index], 1.0) for index in layout.numbers if index != layout.time}
    if layout.time is not None:
        columns[TIME] = (names[layout.time], unit_s)
    mapped = MappedColumns(columns, layout.skip_lines, missing=layout.missing, in_any_unit=True)
    table = read_table(path, Header(tuple(columns)), SAMPLES_MB, mapped, None if layout.time_unit is None else 0)
    values = np.full((len(table.lines), len(layout.headings)), np.nan)
    for index in layout.numbers:
        if index != layout.time:
            values[:, index] = table.columns[f"column_{index}"]
    return values, None if layout.time is None else table.columns[TIME] / unit_s


def _map_of(layout: TableLayout, guess: LogColumns) -> dict[str, Any]:
    """Return the map of a table's columns, as guessed; columns with the rig's own names and units need no entry."""
    columns: dict[str, Any] = {}
    sections = {"samples": guess.samples, "motion": guess.motion}
    for section, entries in sections.items():
        if not entries:
            continue
        named = {name: dict(entry) for name, entry in entries.items() if entry["column"] != name}
        if not named and guess.others:  # without a map every column must have one of the rig's names
            named = {name: dict(entry) for name, entry in entries.items()}
        rows = [heading for heading in layout.headings if heading in TIMES]
        if section == "motion" and "start_s" in rows:  # the rig's own file of attitudes has two times
            named.pop(TIME, None)
        if named:
            columns[section] = named
        if layout.skip_lines:
            columns[f"{section}_skip_lines"] = layout.skip_lines
        if layout.missing:
            columns[f"{section}_missing"] = list(layout.missing)
        if TIME not in entries and not set(rows) & {TIME, "start_s"}:
            columns[f"{section}_rate_hz"] = UNSTATED
    return columns


def _read_contents(looked: LookedFile, column_map: ColumnMap, *, has_readings: bool, has_attitudes: bool) -> LookedFile:
    """Return `looked` with the readings and attitudes of its file; `refusals` say why any cannot be read."""
    refusals: list[RigError] = []
    if has_readings:
        try:
            looked = _read_samples(looked, column_map)
        except RigError as error:
            refusals.append(error)
    if has_attitudes:
        try:
            attitudes = read_attitudes(looked.path, map_motion(column_map), inverse=column_map.motion_inverse)
            reported, _, omitted = select_reports(attitudes)
            looked = replace(looked, attitudes=reported, omitted_attitudes=omitted)
        except RigError as error:
            refusals.append(error)
    if looked.layout is None and (looked.samples is not None or looked.attitudes is not None):
        refusals = []  # a bag may lack the samples or the attitudes
    return replace(looked, refusals=tuple(refusals))


def _read_samples(looked: LookedFile, column_map: ColumnMap) -> LookedFile:
    """Return the file with its readings; if sensors have different rows, only with those of the gyroscope."""
    mapped = map_samples(column_map)
    try:
        table = read_sample_table(looked.path, (), mapped)
    except Refused as error:
        if error.name != "blank_cells":
            raise
        table = read_sample_table(looked.path, (), mapped, [RATE.sensor])
    samples = samples_in(table.columns, str(looked.path))
    return replace(
        looked,
        samples=samples,
        survey=survey_log(samples),
        others=table.others,
        note=table.note,
        origin_s=table.origin_s,
    )

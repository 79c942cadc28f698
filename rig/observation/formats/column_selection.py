"""Selection of the required columns in another program's file, by its heading or by the map of `--columns`."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rig.config.column_map import TIMES, ColumnMap, ColumnSection, TableSection
from rig.data.recording.motion_file import TIME, Header
from rig.errors import Refused
from rig.errors.quoting import quote, shorten
from rig.estimation.arrays import Array, unwrap_counter
from rig.observation.formats.csv_cells import DAY_S, is_value


@dataclass(frozen=True, slots=True)
class MappedColumns:
    """The columns of another program's file.

    - columns: for each of the rig's column names, the name in the file, or the number from 1, and the factor to SI.
    - skip_lines: lines before the heading.
    - wraps: for the rig's name of a time, the number at which the counter of this time begins again at 0.
    - rate_hz: rows per second, for a file without times.
    - missing: texts that stand for a blank cell.
    - in_any_unit: the numbers are used as they are, whatever a row of units states.
    """

    columns: Mapping[str, tuple[str, float]]
    skip_lines: int = 0
    wraps: Mapping[str, float] = field(default_factory=dict)
    rate_hz: float | None = None
    missing: Sequence[str] = ()
    in_any_unit: bool = False

    @property
    def is_by_number(self) -> bool:
        """Whether all columns are named by their numbers, so that the file needs no heading."""
        return bool(self.columns) and all(column.isdecimal() for column, _ in self.columns.values())


def map_samples(columns: ColumnMap) -> MappedColumns | None:
    """Return the column map of a file of readings; None if the user gave none, so that unknown columns are refused."""
    return _unless_empty(
        _build_map(columns.samples, columns.samples_skip_lines, columns.samples_rate_hz, columns.samples_missing)
    )


def map_motion(columns: ColumnMap) -> MappedColumns | None:
    """Return the column map of a file of sweeps or attitudes; None if the user gave none."""
    return _unless_empty(
        _build_map(columns.motion, columns.motion_skip_lines, columns.motion_rate_hz, columns.motion_missing)
    )


def map_table_log(table: TableSection, columns: ColumnMap) -> MappedColumns:
    """Return the column map of a rate table's log: `time_s`, and `angle_0`, `rate_0` … for its axes."""
    sections = {TIME: table.time}
    for index, axis in enumerate(table.axes):
        sections[f"angle_{index}"] = axis.angle
        if axis.rate is not None:
            sections[f"rate_{index}"] = axis.rate
    return _build_map(sections, columns.motion_skip_lines, None, columns.motion_missing)


def _unless_empty(mapped: MappedColumns) -> MappedColumns | None:
    is_needed = mapped.columns or mapped.skip_lines or mapped.rate_hz is not None or mapped.missing
    return mapped if is_needed else None


def _build_map(
    sections: Mapping[str, ColumnSection], skip_lines: int, rate_hz: float | None, missing: Sequence[str]
) -> MappedColumns:
    return MappedColumns(
        {name: (section.column, section.to_si) for name, section in sections.items()},
        skip_lines,
        {name: section.wraps_at for name, section in sections.items() if section.wraps_at is not None},
        rate_hz,
        tuple(missing),
    )


def unwrap_times(columns: Mapping[str, Array], mapped: MappedColumns | None, *, by_day: bool) -> dict[str, Array]:
    """Return the columns with continuous times, without the restarts of counters at 0.

    If `by_day`, times are times of day, which restart at midnight.
    """
    unwrapped = dict(columns)
    for name in TIMES:
        period_s: float | None = DAY_S if by_day else None
        if mapped is not None and name in mapped.wraps:
            period_s = mapped.wraps[name] * mapped.columns[name][1]
        if period_s is not None and name in columns:
            unwrapped[name] = unwrap_counter(columns[name], period_s)
    return unwrapped


def select_columns(
    path: Path, headings: Sequence[str], width: int, header: Header, mapped: MappedColumns | None
) -> dict[int, str]:
    """Return the rig's name of each column to read, by the column's index in a table of `width` columns.

    A first column without a name holds the row names of R or pandas, and is not read. Raise Refused `wrong_columns`,
    `wrong_unit`.
    """
    if mapped is None:
        selected = {index: name for index, name in enumerate(headings) if name or index}
    else:
        selected = _select_mapped(path, headings, width, header, mapped)
    _check_columns(path, [*selected.values()], header)
    return selected


def _select_mapped(
    path: Path, headings: Sequence[str], width: int, header: Header, mapped: MappedColumns
) -> dict[int, str]:
    """Return the name of each column by its index, as the column map says."""
    indices = {name: _find_column(path, headings, width, name, column) for name, (column, _) in mapped.columns.items()}
    if len(set(indices.values())) < len(indices):
        names = [name for name, index in indices.items() if [*indices.values()].count(index) > 1]
        raise Refused(
            "wrong_columns",
            f"one column of {path} is to be {' and '.join(names)}",
            "Name another column for each of them",
        )
    own_names = header.names
    unmapped_names = {
        index: name for index, name in enumerate(headings) if name in own_names and name not in mapped.columns
    }
    return {**unmapped_names, **{index: name for name, index in indices.items()}}


def _find_column(path: Path, headings: Sequence[str], width: int, name: str, column: str) -> int:
    """Return the index of a column that the map names by its heading or its number. Raise Refused `wrong_columns`."""
    named = [index for index, heading in enumerate(headings) if heading == column]
    named = named or [index for index, heading in enumerate(headings) if heading.strip() == column.strip(" #%")]
    if not named and column.isdecimal():
        if not 1 <= int(column) <= width:
            what = f"{path} has {width} columns, but column {column} is to be {name}"
            raise Refused("wrong_columns", what, "Count its columns from 1")
        return int(column) - 1
    if len(named) != 1:
        numbers = " and ".join(str(index + 1) for index in named[:5])
        how = f"{len(named)} times, as columns {numbers}" if named else "nowhere"
        remedy = f"Name one of its columns: {shorten(', '.join(headings))}; or state how many lines precede them"
        raise Refused(
            "wrong_columns",
            f"{path} has the column {quote(column)} {how}, which is to be {name}",
            "Give the number of the one that is meant instead of its name" if named else remedy,
        )
    return named[0]


def check_headings(path: Path, headings: Sequence[str]) -> None:
    """Raise Refused `wrong_columns` for a first row that does not consist of names."""
    what = None
    if len(headings) == 1 and len(headings[0].split()) > 1:
        what = f"divides its columns neither by commas nor by semicolons, tabs or spaces: {shorten(headings[0])}"
    elif headings and all(map(is_value, headings)):
        what = f"has numbers in its first row and no names of columns: {shorten(', '.join(headings))}"
    if what is not None:
        raise Refused(
            "wrong_columns",
            f"{path} {what}",
            "Write the columns' names into the first row, divided as all rows are, by commas, semicolons or tabs; "
            "or state with --columns how many lines precede it, or the columns by their numbers; "
            "rig look FILE shows what is in it",
        )


def _check_columns(path: Path, names: Sequence[str], header: Header) -> None:
    """Raise Refused `wrong_unit`, `wrong_columns` for names that no column of a file with this header has."""
    for name in names:
        _check_unit(path, name, names, header)
    problems = [*_list_missing(names, header), *_find_unexpected(names, header)]
    if problems:
        wanted = ", ".join(header.needed) + (f" and one of {', '.join(header.one_of)}" if header.one_of else "")
        more = "; ".join(", ".join(group) for group in header.optional)
        more = f"; allowed too: {more}" if more else ""
        remedy = (
            f"Its first row must name {wanted}{more}; or state with --columns what its columns are: "
            "rig look FILE --write columns.yaml writes it"
        )
        raise Refused("wrong_columns", f"{path} {', '.join(problems)}", remedy)


def _check_unit(path: Path, name: str, names: Sequence[str], header: Header) -> None:
    """Raise Refused `wrong_unit` for an unknown name that differs from a missing column's name only in the unit."""
    own_names = header.names
    if name in own_names or "_" not in name or name.startswith("axis"):
        return
    alike = [column for column in own_names if _quantity(column) == _quantity(name) and column not in names]
    meant = " or ".join([column for column in alike if column in header.needed] or alike)
    if meant:
        raise Refused(
            "wrong_unit",
            f"{path} has a column {shorten(name)} instead of {meant}",
            f"Convert it to the unit in the name {meant}, or state its unit with --columns",
        )


def _list_missing(names: Sequence[str], header: Header) -> list[str]:
    """Return the columns that a file lacks, in words."""
    groups = [group for group in header.optional if set(group) & set(names)]
    needed = [*header.needed, *(name for group in groups for name in group)]
    return [f"lacks {name}" for name in needed if name not in names]


def _find_unexpected(names: Sequence[str], header: Header) -> Iterator[str]:
    """Yield the errors of a file's column names, in words; missing columns are not among them."""
    own_names = header.names
    yield from (f"names {name} twice" for name in own_names if names.count(name) > 1)
    present = [name for name in names if name in header.one_of]
    if header.one_of and len(set(present)) != 1:
        yield f"has {' and '.join(present) or 'none'} of {', '.join(header.one_of)}"
    if "" in names:
        yield "has a column without a name"
    unknown = ", ".join(name for name in names if name and name not in own_names)
    if unknown:
        yield f"has the unknown {shorten(unknown)}"


def _quantity(name: str) -> str:
    """Return the quantity in a column's name: `rate_x` of `rate_x_rad_s`, `x` of `x_rad_s`."""
    words = name.split("_")
    return "_".join(words[:2]) if words[0] == "rate" else words[0]

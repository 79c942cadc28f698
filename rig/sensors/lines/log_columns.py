"""A map of the columns of an unknown log, in the form of `--columns`, guessed from headings and plausible numbers."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.config.units import UNITS
from rig.data.quantity import MAX_TEMPERATURE_C
from rig.data.recording.motion_file import MOTIONS, QUATERNION
from rig.errors.quoting import shorten
from rig.estimation.arrays import Array
from rig.observation.formats.table_layout import TableLayout
from rig.sensors.lines.column_attitudes import describe_unread_attitudes, find_matrices, find_quaternion, list_angles
from rig.sensors.lines.column_exclusions import SENSORS, explain_unread, find_virtual, is_constant, is_counter
from rig.sensors.lines.column_names import AXES, mark_repeated, order_axes, simplify_heading, state_unit
from rig.sensors.lines.column_triads import guess_triads
from rig.sensors.lines.column_units import BY_SIZE, MAX_SCALE_ERROR, SI_UNITS, UNSTATED, choose_unit, compare_stated
from rig.sensors.lines.guessing import Guess

NAMES = {"g": "_rad_s", "a": "_m_s2", "m": "_t"}
ASSUMED_RATE_HZ = 100.0  # of a log without times
# A block is at rest if its scatter is at most this many times that of the quietest tenth.
BLOCK_S, QUIETEST_FRACTION, QUIET_RATIO = 0.25, 0.1, 3.0
MAX_WRAP_STEPS = 20.0  # from the last stamp before a restart to the restart
REFERENCE = {name for group in MOTIONS["attitudes"].optional for name in group} | {"start_s", "end_s"}
TIME_NAME = re.compile(r"time|stamp", re.IGNORECASE)
POSITION_NAME = re.compile(r"(?:(?:p|t|pos|position|trans|translation)_?)?[xyz](?: \[.*\])?")
STATE_UNIT = (
    ". State the unit of the first three in the map, where x_rad_s y_rad_s z_rad_s mean a gyroscope: write x_t y_t z_t "
    "for a magnetometer, x_m_s2 y_m_s2 z_m_s2 for an accelerometer"
)
ADD_TO_MAP = ". They are not read: add a gyroscope to the map as x_rad_s y_rad_s z_rad_s, a magnetometer as x_t y_t z_t"

ColumnEntry = Mapping[str, Any]  # a column's entry: its name or number, and its unit


@dataclass(frozen=True, slots=True)
class LogColumns:
    """The columns of a log: maps of `samples` and `motion`, in the form of the file of `--columns`.

    `gaps`: sentences on unknown properties of the columns; `others`: the columns that are not read; `reasons`:
    sentences on why columns that look like readings are not read.
    """

    samples: Mapping[str, ColumnEntry]
    motion: Mapping[str, ColumnEntry]
    gaps: Sequence[str] = ()
    others: Sequence[str] = ()
    reasons: Sequence[str] = ()

    def correct_rate_unit(self, ratio: float) -> "LogColumns":
        """Return the columns with the gyroscope's unit corrected, if it was guessed by size alone.

        `ratio`: the gyroscope's true rate divided by its readings in the guessed unit.
        """
        gaps = [gap for gap in self.gaps if BY_SIZE not in gap]
        names = [f"{axis}{NAMES['g']}" for axis in AXES]
        if len(gaps) == len(self.gaps) or not all(name in self.samples for name in names):
            return self
        guessed = UNITS[str(self.samples[names[0]]["unit"])].size
        fitting = [unit for unit in ("rad/s", "deg/s") if abs(ratio * guessed / UNITS[unit].size - 1) < MAX_SCALE_ERROR]
        if not fitting:
            return self
        corrected = {name: {**self.samples[name], "unit": fitting[0]} for name in names}
        return replace(self, samples={**self.samples, **corrected}, gaps=gaps)


@dataclass(frozen=True, slots=True)
class _ColumnGroup:
    """Columns with numbers in the same rows: indices and names (k,), values (m, k), and a mask (m,) of rows at rest."""

    indices: Sequence[int]
    names: tuple[str, ...]
    values: Array
    still: NDArray[np.bool_]


def guess_columns(layout: TableLayout, values: Array, time: Array | None, title: str = "") -> LogColumns:
    """Return a guess at the meaning of a log's columns, from their `layout` and their numbers `values` (n, k).

    `title`: the file's name without its extension. `time` (n,) is in the layout's unit, None without times. Values may
    be NaN in rows that belong to other sensors.
    """
    unit_s = 1.0 if layout.time_unit is None else UNITS[layout.time_unit].size
    matrices = find_matrices(layout, values if time is None else _insert_time(layout, values, time))
    if layout.time in matrices:  # an element that rises is no time
        layout, time = replace(layout, time=None, time_unit=None), None
    rate_hz = ASSUMED_RATE_HZ if time is None else _mean_rate_hz(unit_s * time)
    quaternion = find_quaternion(layout, values, matrices)
    virtual, reasons = find_virtual(layout, values, title)
    samples, gaps = _guess_samples(layout, values, {*quaternion.values(), *matrices}, virtual, rate_hz)
    if layout.time is None:
        gaps.append("no column of time: state samples_rate_hz")
    unread = [] if quaternion else describe_unread_attitudes(layout, matrices, list_angles(layout))
    gaps += unread
    timed = {} if layout.time is None else {"time_s": _time_entry(layout, time)}
    motion = {name: {"column": layout.name(index), "unit": "1"} for name, index in quaternion.items()}
    others = _list_others(layout, [*samples.values(), *motion.values(), *timed.values()])
    if not any((samples, quaternion, unread, reasons)):
        which = f"what {shorten(' '.join(others))} are" if others else "which columns are readings"
        gaps.append(
            f"{which}: none look like a sensor's. State them with --columns. If numbers have a decimal comma, divide "
            "the columns by semicolons"
        )
    read = {entry["column"] for entry in [*samples.values(), *timed.values()]}
    reasons += explain_unread(layout, values, {layout.time, *virtual, *matrices, *quaternion.values()}, read)
    samples, motion = ({**timed, **entries} if entries else {} for entries in (samples, motion))
    return LogColumns(samples, motion, gaps, others, reasons)


def _insert_time(layout: TableLayout, values: Array, time: Array) -> Array:
    """Return `values` with `time` entered into the layout's column of time, which so far contains NaN."""
    return np.where(np.arange(values.shape[1]) == layout.time, time[:, None], values)


def _guess_samples(
    layout: TableLayout, values: Array, attitudes: set[int], virtual: set[int], rate_hz: float
) -> tuple[dict[str, ColumnEntry], list[str]]:
    """Return the column map of the readings, and sentences on doubtful columns.

    If there are two sensors of one kind, only the first is mapped.
    """
    samples: dict[str, ColumnEntry] = {}
    gaps: list[str] = []
    undetermined: list[tuple[list[str | int], Array]] = []
    for group in _group_columns(layout, values, attitudes, virtual, rate_hz):
        guessed, triads = guess_triads(group.names, group.indices, group.values, group.still, rate_hz)
        undetermined += [([layout.name(group.indices[i]) for i in triad], group.values[:, triad]) for triad in triads]
        for kind in [kind for kind in NAMES if kind in guessed.units and f"x{NAMES[kind]}" not in samples]:
            triad, reason = _map_triad(layout, group, guessed, kind)
            samples |= triad
            if reason:
                gaps.append(f"the unit of the {SENSORS[kind]}: {reason}")
        if "temperature" in guessed.columns and "temperature_c" not in samples:
            position = guessed.columns.index("temperature")
            column = layout.name(group.indices[position])
            largest = float(np.abs(group.values[:, position]).max())
            if largest <= MAX_TEMPERATURE_C:
                samples["temperature_c"] = {"column": column, "unit": "C"}
            else:
                gaps.append(
                    f"the unit of the temperature {column}, up to {largest:.4g}: convert it to °C; it is not read"
                )
    if undetermined:
        is_first = not any(f"x{suffix}" in samples for suffix in NAMES.values())
        gaps.append(_describe_undetermined(undetermined) + (STATE_UNIT if is_first else ADD_TO_MAP))
        if is_first:
            columns = zip(AXES, undetermined[0][0], strict=True)
            samples |= {axis + NAMES["g"]: {"column": column, "unit": UNSTATED} for axis, column in columns}
    return samples, gaps


def _describe_undetermined(triads: Sequence[tuple[Sequence[str | int], Array]]) -> str:
    """Return a sentence on triads whose meaning is unknown; each is three columns' names and values (n, 3)."""
    columns = " ".join(str(column) for names, _ in triads for column in names)
    sizes = ", ".join(f"{np.median(np.linalg.norm(values, axis=1)):.3g}" for _, values in triads)
    return f"what {columns} are: no heading says it; their size is about {sizes}, and the Earth's field is 25 to 65 uT"


def _map_triad(
    layout: TableLayout, group: _ColumnGroup, guessed: Guess, kind: str
) -> tuple[dict[str, ColumnEntry], str]:
    """Return the map of a triad's three columns, and the reason if its unit is uncertain."""
    positions = [guessed.columns.index(kind + axis) for axis in AXES]
    indices = [group.indices[position] for position in positions]
    values, stated = group.values[:, positions], state_unit(layout, indices[0])
    if stated in UNITS and UNITS[stated].quantity == UNITS[SI_UNITS[kind]].quantity:
        unit, reason = compare_stated(kind, stated, values, group.still)
    else:
        unit, reason = choose_unit(kind, dict(guessed.units[kind]), values, group.still)
    columns = zip(AXES, indices, strict=True)
    return {axis + NAMES[kind]: {"column": layout.name(index), **unit} for axis, index in columns}, reason


def _list_others(layout: TableLayout, entries: Sequence[ColumnEntry]) -> list[str]:
    """Return the columns that no entry of the map reads, if they have a heading or numbers."""
    read = {entry["column"] for entry in entries}
    return [
        heading or f"column {index + 1}"
        for index, heading in enumerate(layout.headings)
        if layout.name(index) not in read and (heading or index in layout.numbers)
    ]


def find_still(values: Array, rate_hz: float) -> NDArray[np.bool_]:
    """Return a mask (n,) of rows at rest. They are marked in blocks of `BLOCK_S`.

    A block is at rest if each column scatters little more in it than in the quietest blocks of the same column.
    """
    width = max(int(BLOCK_S * rate_hz), 5)
    count = len(values) // width
    if count < 2:
        return np.ones(len(values), dtype=np.bool_)
    scatter = values[: count * width].reshape(count, width, -1).std(axis=1)
    still = (scatter <= QUIET_RATIO * np.maximum(np.quantile(scatter, QUIETEST_FRACTION, axis=0), 1e-12)).all(axis=1)
    rows = np.repeat(still, width)
    return np.append(rows, np.full(len(values) - len(rows), rows[-1]))


def _mean_rate_hz(time_s: Array) -> float:
    steps = np.diff(time_s[np.isfinite(time_s)])
    steps = steps[steps > 0]
    return 1 / float(np.mean(steps[steps <= np.quantile(steps, 0.99)])) if len(steps) else ASSUMED_RATE_HZ


def _group_columns(
    layout: TableLayout, values: Array, attitudes: set[int], virtual: set[int], rate_hz: float
) -> Iterator[_ColumnGroup]:
    """Yield the columns that may be readings, in groups whose columns have numbers in the same rows.

    There is one group for each rate of the logger. Columns of a reference are left out, including its positions if the
    log has attitudes, because positions look like readings. Constant columns are left out too, and so are counters,
    such as the numbers of the rows and a second clock, and durations.
    """
    headings = range(len(layout.headings))
    names = mark_repeated(["" if index in virtual else simplify_heading(layout, index) for index in headings])
    used = {layout.time, *attitudes, *virtual, *(i for i, name in enumerate(layout.headings) if name in REFERENCE)}
    used |= {*list_angles(layout), *(i for i, name in enumerate(layout.headings) if TIME_NAME.search(name))}
    if attitudes:
        used |= {index for index, name in enumerate(names) if POSITION_NAME.fullmatch(name)}
    if len(attitudes) == len(QUATERNION):
        used |= {index for index, name in enumerate(names) if not name}
    groups: dict[bytes, list[int]] = {}
    for index in layout.numbers:
        if index not in used and not is_constant(values[:, index]) and not is_counter(values[:, index]):
            groups.setdefault(np.isfinite(values[:, index]).tobytes(), []).append(index)
    for group in groups.values():
        indices = order_axes(group, names)
        part = values[np.isfinite(values[:, indices[0]])][:, indices]
        still = find_still(part, rate_hz * len(part) / max(len(values), 1))
        yield _ColumnGroup(indices, tuple(names[index] for index in indices), part, still)


def _time_entry(layout: TableLayout, time: Array | None) -> dict[str, Any]:
    assert layout.time is not None, "it has a column of time"
    entry: dict[str, Any] = {"column": layout.name(layout.time)}
    if layout.time_unit is not None:
        entry["unit"] = layout.time_unit
    if time is not None and layout.time_unit is not None and (wrap := _find_wrap(time)) is not None:
        entry["wraps_at"] = wrap
    return entry


def _find_wrap(time: Array) -> int | None:
    """Return the power of two, in steps, at which a time counter restarts; None if it does not.

    A counter restarts close below a power of two. A fall by as much from another value, as if a digit were lost, is no
    restart.
    """
    time = time[np.isfinite(time)]
    if len(time) < 2 or time.max() < 100 or time.min() < 0:
        return None
    steps = np.diff(time)
    falls = steps < -0.5 * np.ptp(time)
    if not falls.any():
        return None
    wrap = 2 ** np.ceil(np.log2(time.max() + 1))
    usual = float(np.median(steps[steps >= 0])) if (steps >= 0).any() else 0.0
    is_near = wrap - time[:-1][falls].min() <= MAX_WRAP_STEPS * max(usual, 1.0)
    return int(wrap) if is_near else None

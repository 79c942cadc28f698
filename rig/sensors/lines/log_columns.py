"""A map of the columns of an unknown log, in the form of `--columns`, by headings and plausible numbers."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.config.units import UNITS
from rig.data.quantity import MAX_TEMPERATURE_C
from rig.data.recording.motion_file import MOTIONS, QUATERNION
from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.observation.formats.table_layout import TableLayout
from rig.sensors.lines.guessing import Guess, guess_triads

NAMES = {"g": "_rad_s", "a": "_m_s2", "m": "_t"}
SENSORS = {"g": "gyroscope", "a": "accelerometer", "m": "magnetometer"}
SI_UNITS = {"g": "rad/s", "a": "m/s2", "m": "T"}
UNSTATED = "?"  # where a number is still to be stated
ASSUMED_RATE_HZ = 100.0  # of a log without times
MAX_SCALE_ERROR = 0.3  # of a gyroscope whose readings confirm a unit
BY_SIZE = "by size alone"
MIN_COUNT = 500.0  # larger whole numbers are steps of a converter
# A block is at rest if its scatter is at most this many times that of the quietest tenth.
BLOCK_S, QUIETEST_FRACTION, QUIET_RATIO = 0.25, 0.1, 3.0
MAX_RATE_RAD_S, MAX_SCATTER_RAD_S = 40.0, 0.02  # of a gyroscope; the scatter is that at rest
NORM_TOLERANCE = 2e-3
MAX_WRAP_STEPS = 20.0  # from the last stamp before a restart to the restart
MIN_STEPS, MIN_RISING = 10, 0.9  # of a counter; fraction of steps that rise; none may fall
AXES = ("x", "y", "z")
REFERENCE = {name for group in MOTIONS["attitudes"].optional for name in group} | {"start_s", "end_s"}
QUATERNION_NAME = re.compile(r"(?:.*_)?(?:q|quat|quaternion|orientation|rot|rotation|attitude)_?([wxyz0-3])")
TIME_NAME = re.compile(r"time|stamp", re.IGNORECASE)
POSITION_NAME = re.compile(r"(?:(?:p|t|pos|position|trans|translation)_?)?[xyz](?: \[.*\])?")
KIND_OF = {UNITS["rad/s"].quantity: ("gyro",), UNITS["m/s2"].quantity: ("acc",), UNITS["T"].quantity: ("mag",)}
FIELD_NAME = re.compile(r".*(mag|field|compass)|[bhm]_?[xyz]\b", re.IGNORECASE)
QUATERNION_DIGITS = {"0": "qw", "1": "qx", "2": "qy", "3": "qz"}
GRAVITY_BY_UNIT = {"m/s2": STANDARD_GRAVITY_M_S2, "g": 1.0, "mg": 1000.0}
ANGLE_WORDS = {"yaw", "pitch", "roll", "heading", "azimuth", "phi", "theta", "psi", "euler"}
ROUND_STEPS = (131.0, 65.5, 32.8, 16.4)  # steps per °/s, as data sheets state them

ColumnEntry = Mapping[str, Any]  # a column's entry: its name or number, and its unit


@dataclass(frozen=True, slots=True)
class LogColumns:
    """The columns of a log: maps of `samples` and `motion`, in the form of the file of `--columns`.

    `gaps`: sentences on properties of the columns that are unknown; `others`: the columns that are not read.
    """

    samples: Mapping[str, ColumnEntry]
    motion: Mapping[str, ColumnEntry]
    gaps: Sequence[str] = ()
    others: Sequence[str] = ()

    def correct_rate_unit(self, ratio: float) -> "LogColumns":
        """Return the columns with the gyroscope's unit corrected, if it was guessed by size alone.

        `ratio`: how many times as fast as its readings, in the guessed unit, the gyroscope turned.
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


def guess_columns(layout: TableLayout, values: Array, time: Array | None) -> LogColumns:
    """Return a guess at the meaning of a log's columns, from their `layout` and their numbers `values` (n, k).

    `time` (n,) is in the layout's unit, None without times. Values may be NaN in rows that belong to other sensors.
    """
    unit_s = 1.0 if layout.time_unit is None else UNITS[layout.time_unit].size
    rate_hz = ASSUMED_RATE_HZ if time is None else _mean_rate_hz(unit_s * time)
    quaternion = _find_quaternion(layout, values)
    samples, gaps = _guess_samples(layout, values, quaternion, rate_hz)
    if layout.time is None:
        gaps.append("no column of time: state samples_rate_hz")
    if not quaternion and (angles := _list_angles(layout)):
        names = " ".join(layout.headings[index] for index in angles)
        gaps.append(f"the order of the turns in {names}: attitudes are read as quaternions, qw qx qy qz; convert them")
    elif not samples and not quaternion:
        gaps.append(
            "which columns are readings: none look like a sensor's. State them with --columns. If numbers have a "
            "decimal comma, divide the columns by semicolons"
        )
    timed = {} if layout.time is None else {"time_s": _time_entry(layout, time)}
    motion = {name: {"column": layout.name(index), "unit": "1"} for name, index in quaternion.items()}
    others = _list_others(layout, [*samples.values(), *motion.values(), *timed.values()])
    return LogColumns({**timed, **samples} if samples else {}, {**timed, **motion} if motion else {}, gaps, others)


def _guess_samples(
    layout: TableLayout, values: Array, quaternion: Mapping[str, int], rate_hz: float
) -> tuple[dict[str, ColumnEntry], list[str]]:
    """Return the column map of the readings, and sentences on doubtful columns.

    If there are two sensors of one kind, only the first is mapped.
    """
    samples: dict[str, ColumnEntry] = {}
    gaps: list[str] = []
    for group in _group_columns(layout, values, quaternion, rate_hz):
        guessed = guess_triads(group.names, group.values, group.still, rate_hz)
        if not samples and _is_undetermined(group.names, guessed):
            columns = [layout.name(index) for index in group.indices]
            samples |= {
                axis + NAMES["g"]: {"column": column, "unit": UNSTATED}
                for axis, column in zip(AXES, columns, strict=True)
            }
            gaps.append(_describe_undetermined(columns, group.values))
            continue
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
    return samples, gaps


def _is_undetermined(names: Sequence[str], guessed: Guess) -> bool:
    """Return whether neither headings nor numbers show what three columns are.

    The size of a magnetic field alone does not show it, because other readings may have the same size.
    """
    is_named = any(FIELD_NAME.match(name) for name in names) and bool(guessed.units)
    return not is_named and len(names) == 3 and set(guessed.units) <= {"m"}


def _describe_undetermined(columns: Sequence[str | int], values: Array) -> str:
    """Return a sentence on three unknown columns with `values` (n, 3): what they may be, and how to state it."""
    size = float(np.median(np.linalg.norm(values, axis=1)))
    return (
        f"what {' '.join(map(str, columns))} are: no heading says it; their size is about {size:.3g}, and the Earth's "
        "field is 25 to 65 uT. State their unit in the map, where x_rad_s y_rad_s z_rad_s mean a gyroscope: write "
        "x_t y_t z_t for a magnetometer, x_m_s2 y_m_s2 z_m_s2 for an accelerometer"
    )


def _map_triad(
    layout: TableLayout, group: _ColumnGroup, guessed: Guess, kind: str
) -> tuple[dict[str, ColumnEntry], str]:
    """Return the map of a triad's three columns, and the reason if its unit is uncertain."""
    positions = [guessed.columns.index(kind + axis) for axis in AXES]
    indices = [group.indices[position] for position in positions]
    values, stated = group.values[:, positions], layout.units[indices[0]]
    if stated in UNITS and UNITS[stated].quantity == UNITS[SI_UNITS[kind]].quantity:
        unit, reason = _compare_stated(kind, stated, values, group.still)
    else:
        unit, reason = _unit_of(kind, dict(guessed.units[kind]), values, group.still)
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


def _name_once(names: list[str]) -> list[str]:
    """Return the names with repeated ones blank, so that of two sensors with the same names the first is read."""
    return [name if name not in names[:index] else "" for index, name in enumerate(names)]


def find_still(values: Array, rate_hz: float) -> NDArray[np.bool_]:
    """Return a mask (n,) of rows at rest: each column scatters little more in their block than in the quietest one."""
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


def _plain_name(layout: TableLayout, index: int) -> str:
    """Return a heading in the form of a device's column names: `gyro_x [deg/s]`."""
    name = layout.headings[index].rpartition(".")[2] if "(:" in layout.headings[index] else layout.headings[index]
    if (match := re.fullmatch(r"(.*)\((?::,)?([1-3])(?:,:)?\)", name)) is not None:
        name = f"{match[1]}_{'xyz'[int(match[2]) - 1]}"
    name = re.sub(r"\s*[\[(].*?[\])]", "", name).strip()
    words = [word for word in re.split(r"[\W_]+", re.sub(r"([a-z])([XYZ])\b", r"\1_\2", name).lower()) if word]
    words = _strip_units(words)
    if words and words[-1] not in AXES and words[0] in AXES:
        words = [*words[1:], words[0]]
    if len(words) > 2 and words[-1] in AXES:  # imu_angular_velocity_x, w_RS_S_x
        kind = next((word for word in words[:-1] if word[:3] in KINDS or word in KINDS), None)
        words = [KINDS.get(kind, KINDS.get(kind[:3], "")), words[-1]] if kind is not None else words
    unit = layout.units[index]
    if len(words) == 1 and words[0] in AXES and unit in UNITS:  # x [°/s]
        words = [*KIND_OF.get(UNITS[unit].quantity, ()), *words]
    return "_".join(words) + (f" [{unit}]" if unit else "")


KINDS = {
    "gyr": "gyro",
    "ang": "gyro",
    "omega": "gyro",
    "w": "gyro",
    "rot": "gyro",
    "acc": "acc",
    "lin": "acc",
    "a": "acc",
    "mag": "mag",
}


def _strip_units(words: list[str]) -> list[str]:
    """Return a heading's words up to the axis, without a unit that follows, as in x_rad_s."""
    axes = [position for position, word in enumerate(words) if word in AXES]
    if axes and axes[-1] < len(words) - 1 and all(word in UNIT_WORDS for word in words[axes[-1] + 1 :]):
        kind = {"rad": "gyro", "deg": "gyro", "dps": "gyro", "m": "acc", "t": "mag", "ut": "mag"}.get(
            words[axes[-1] + 1]
        )
        before = words[: axes[-1]] or ([kind] if kind else [])
        return [*before, words[axes[-1]]]
    return words


UNIT_WORDS = {"rad", "s", "deg", "dps", "mdps", "m", "s2", "g", "mg", "t", "ut"}


def _group_columns(
    layout: TableLayout, values: Array, quaternion: Mapping[str, int], rate_hz: float
) -> Iterator[_ColumnGroup]:
    """Yield the columns that may be readings, in groups whose columns have numbers in the same rows.

    There is one group for each rate of the logger. Columns of a reference are left out, including its positions if the
    log has a quaternion, because positions look like readings. Constant columns are left out too, and so are counters,
    such as the numbers of the rows and a second clock, and durations.
    """
    names = _name_once([_plain_name(layout, index) for index in range(len(layout.headings))])
    used = {layout.time, *quaternion.values(), *(i for i, name in enumerate(layout.headings) if name in REFERENCE)}
    used |= {*_list_angles(layout), *(i for i, name in enumerate(layout.headings) if TIME_NAME.search(name))}
    if quaternion:
        used |= {index for index, name in enumerate(names) if not name or POSITION_NAME.fullmatch(name)}
    groups: dict[bytes, list[int]] = {}
    for index in layout.numbers:
        if index not in used and not _is_constant(values[:, index]) and not _is_counter(values[:, index]):
            groups.setdefault(np.isfinite(values[:, index]).tobytes(), []).append(index)
    for group in groups.values():
        indices = _order_axes(group, names)
        part = values[np.isfinite(values[:, indices[0]])][:, indices]
        still = find_still(part, rate_hz * len(part) / max(len(values), 1))
        yield _ColumnGroup(indices, tuple(names[index] for index in indices), part, still)


def _order_axes(indices: Sequence[int], names: Sequence[str]) -> list[int]:
    """Return the columns, in the order x, y, z if these are their names, because some loggers write z first."""
    axes = iter(sorted((index for index in indices if _is_axis(names[index])), key=lambda index: names[index]))
    return [next(axes) if _is_axis(names[index]) else index for index in indices]


def _is_axis(name: str) -> bool:
    return name.partition(" ")[0] in AXES


def _is_constant(column: Array) -> bool:
    return bool(np.nanmin(column) == np.nanmax(column))


def _is_counter(column: Array) -> bool:
    """Return whether a column rises from row to row, as the numbers of the rows or a second clock do."""
    steps = np.diff(column[np.isfinite(column)])
    return len(steps) > MIN_STEPS and bool((steps >= 0).all() and (steps > 0).mean() > MIN_RISING)


def _list_angles(layout: TableLayout) -> list[int]:
    """Return the columns with headings of attitude angles and without a unit of a rate."""
    return [
        index
        for index in layout.numbers
        if ANGLE_WORDS.intersection(re.split(r"[\W_\d]+", layout.headings[index].lower()))
        and "rate" not in layout.headings[index].lower()
        and (layout.units[index] not in UNITS or UNITS[layout.units[index]].quantity != UNITS["rad/s"].quantity)
    ]


def _find_quaternion(layout: TableLayout, values: Array) -> dict[str, int]:
    """Return the columns of a quaternion, qw qx qy qz: by their names, or four adjacent columns whose norm is 1."""
    named: dict[str, int] = {}
    for index in layout.numbers:
        name = re.sub(r"[\W_]+", "_", layout.headings[index].lower()).strip("_")
        if (match := QUATERNION_NAME.fullmatch(name)) is not None:
            named.setdefault(QUATERNION_DIGITS.get(match[1], f"q{match[1]}"), index)
    if set(named) == set(QUATERNION) and _have_length_1(values[:, [*named.values()]]):
        return {name: named[name] for name in QUATERNION}
    for start in layout.numbers:
        indices = [start + offset for offset in range(4)]
        if set(indices) <= set(layout.numbers) and layout.time not in indices and _have_length_1(values[:, indices]):
            return dict(zip(QUATERNION, indices, strict=True))
    return {}


def _have_length_1(values: Array) -> bool:
    whole = values[np.isfinite(values).all(axis=1)]
    return len(whole) > 1 and bool(np.median(np.abs(np.linalg.norm(whole, axis=1) - 1)) < NORM_TOLERANCE)


def _unit_of(kind: str, unit: dict[str, Any], values: Array, still: NDArray[np.bool_]) -> tuple[dict[str, Any], str]:
    """Return unit and factor of a triad in the form of a column map, and the reason if unit or factor is uncertain."""
    if (scale := unit.pop("scale", None)) is not None:
        steps = 1 / float(scale)
        near = min(ROUND_STEPS, key=lambda round_steps: abs(steps / round_steps - 1))
        exact = near if kind == "g" and abs(steps / near - 1) < 1e-3 else round(steps)
        is_whole = kind == "a" or exact == near
        return {"unit": unit["unit"], **({"lsb_per_unit": exact} if is_whole else {"factor": scale})}, ""
    if unit["unit"] != "?":
        return {"unit": unit["unit"]}, ""
    if kind != "g":
        return {"unit": SI_UNITS[kind]}, "the size of its readings fits no unit; check that it is SI"
    if (values == np.rint(values)).all() and np.abs(values).max() > MIN_COUNT:
        return {"unit": "deg/s", "lsb_per_unit": UNSTATED}, "steps of a converter: state lsb_per_unit by its data sheet"
    turned = values - np.median(values[still], axis=0)
    noise = np.median(np.abs(np.diff(values, axis=0)), axis=0).max()  # a steady turn is as quiet as a rest
    if np.abs(turned).max() > MAX_RATE_RAD_S or noise > MAX_SCATTER_RAD_S:
        largest = f"{np.abs(values).max():.4g}"
        reason = f"deg/s {BY_SIZE} (up to {largest}); if these are counts, give factor or lsb_per_unit"
        return {"unit": "deg/s"}, reason
    return {"unit": "rad/s"}, f"rad/s {BY_SIZE} (up to {np.abs(values).max():.3g})"


def _compare_stated(kind: str, stated: str, values: Array, still: NDArray[np.bool_]) -> tuple[dict[str, Any], str]:
    """Return the unit that the heading states, and a sentence if an accelerometer's norm at rest contradicts it."""
    level = float(np.median(np.linalg.norm(values[still] if still.any() else values, axis=1)))
    fitting = [unit for unit, size in GRAVITY_BY_UNIT.items() if abs(level / size - 1) < 0.15]
    if kind == "a" and fitting and stated not in fitting:
        return {"unit": fitting[0]}, f"the heading says {stated}, but at rest it reads {level:.4g}, as in {fitting[0]}"
    return {"unit": stated}, ""


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

    A counter restarts close below a power of two. A stamp that lost a digit falls as far, but from anywhere.
    """
    time = time[np.isfinite(time)]
    steps = np.diff(time)
    falls = steps < -0.5 * np.ptp(time)
    if not falls.any() or time.max() < 100 or time.min() < 0:
        return None
    wrap = 2 ** np.ceil(np.log2(time.max() + 1))
    usual = float(np.median(steps[steps >= 0])) if (steps >= 0).any() else 0.0
    is_near = wrap - time[:-1][falls].min() <= MAX_WRAP_STEPS * max(usual, 1.0)
    return int(wrap) if is_near else None

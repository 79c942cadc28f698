"""A guess at the columns of an unknown device, from ten seconds at rest and then while a hand rotates it. Pure.

Names in a header decide first. Otherwise the readings decide: time and sequence number increase steadily, an
accelerometer's norm is that of gravity, and a gyroscope reads little at rest and much in rotation; the rotation of
gravity determines the gyroscope's unit.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.sensors.lines.shape import NoShape, Shape

Flags = NDArray[np.bool_]
G = 9.80665
MIN_LINES = 10  # at rest, and in motion
TOLERANCE = 0.12  # relative tolerance for an uncalibrated accelerometer and a rotation by hand
COUNTS_PER_G = (1024, 2048, 4096, 8192, 16384, 32768)
# °/s per count: InvenSense (131 … 16.4 counts per °/s), ST (8.75 … 70 m°/s), Bosch (as InvenSense), Analog Devices.
DEG_S_PER_COUNT = (1 / 131, 1 / 65.5, 1 / 32.8, 1 / 16.4, 0.00875, 0.0175, 0.035, 0.07, 0.00625, 0.025, 0.1)
SCALE_TOLERANCE = 0.03
MIN_ROTATION_RATIO = 10.0  # of a gyroscope's scatter in rotation to that at rest
# Quantile of the differences between readings, and its ratio to the noise's standard deviation.
NOISE_QUANTILE, QUANTILE_RATIO = 0.9, 1.645 * 2**0.5
# Interval over which gravity's direction is averaged: in twice this the device rotates by at most a fifth of a radian.
GRAVITY_INTERVAL_S = 0.02
TIMES = {"ns": 1e9, "us": 1e6, "ms": 1e3, "s": 1.0}
_NAMES = {
    "time": r"(time|timestamp|t|ts|ms|us|millis|micros|tick|ticks|uptime)(_?(us|ms|s|ns))?",
    "sequence": r"(seq|sequence|n|no|nr|i|idx|index|count|counter|sample|packet|frame)",
    "temperature": r"(temp|temperature|t_?c|deg_?c)(_?c)?",
    "g": r"(g|gyr|gyro|gyroscope|w|omega|rate|angular_?(rate|velocity)?|r)_?([xyz])",
    "a": r"(a|acc|accel|accelerometer|acceleration|f)_?([xyz])",
    "m": r"(m|mag|magnetometer|magnetic|field|b|h)_?([xyz])",
}
_UNITS = {
    "g": {r"mdps|mdeg": "mdeg/s", r"dps|deg|°": "deg/s", r"mrad": "mrad/s", r"rad": "rad/s"},
    "a": {r"m/?s\^?2|mps2|m_s2|ms2": "m/s2", r"\bmg\b|_mg$": "mg", r"[\[(_]g[\])]?$": "g"},
    "m": {r"ut|µt": "uT", r"nt": "nT", r"mgauss": "mgauss", r"gauss": "gauss"},
}
_SECTIONS = {"g": "rate", "a": "acceleration", "m": "field"}


@dataclass(slots=True)
class Guess:
    """A guess at the columns.

    - `columns`, `rate_hz`: the columns' names, and the sample rate.
    - `time`, `sequence_wrap`, `clock`: the values of these keys for the section `lines`.
    - `units`: unit and scale of each triad, by its letter.
    - `reasons`, `gaps`: sentences about the grounds of the guess, and about facts that the user must look up.
    """

    columns: list[str]
    rate_hz: float = 0.0
    time: dict[str, object] | None = None
    sequence_wrap: int = 0
    clock: str = "device"
    units: dict[str, dict[str, object]] = field(default_factory=dict)
    reasons: list[str] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)


def guess(shape: Shape, still_until_s: float) -> Guess:
    """Return a guess at the columns of a device that rested until `still_until_s` (computer's clock), then rotated.

    Raise NoShape if too few lines came in either part.
    """
    resting = int(np.count_nonzero(shape.arrived_s < still_until_s))
    for number, when in ((resting, "while it lay still"), (len(shape.arrived_s) - resting, "while it was turned")):
        if number < MIN_LINES:
            raise NoShape(f"only {number} of its lines came {when}")
    count = shape.values.shape[1]
    result = Guess(["-"] * count)
    known_columns = match_names(shape.names)
    for index, name in known_columns.items():
        result.columns[index] = name
    text_columns = [index for index in range(count) if np.isnan(shape.values[:, index]).any()]
    result.reasons += [f"column {index + 1} is text, or empty at times: it is not read" for index in text_columns]
    _find_time(shape, result)
    find_triads(shape, result, shape.arrived_s < still_until_s)
    find_temperature(shape, result, shape.arrived_s < still_until_s)
    for index, name in enumerate(result.columns):
        if name == "-" and index not in text_columns:
            about = f"{np.median(shape.values[:, index]):g}"
            result.gaps.append(
                f"what column {index + 1} is, about {about}: name it in lines.columns, or it is not read"
            )
    for name, unit in result.units.items():
        indices = [result.columns.index(name + axis) for axis in "xyz"]
        decimals = {shape.decimals[index] for index in indices}
        if len(decimals) == 1 and min(decimals) >= 0:
            unit["decimals"] = decimals.pop()
    return result


def match_names(names: tuple[str, ...]) -> dict[int, str]:
    """Return the rig's column names for the names in a header, by their index; unknown names have no entry.

    If several names have the same meaning, none of them has an entry.
    """
    names_by_index: dict[int, str] = {}
    for index, name in enumerate(names):
        plain = re.sub(r"\s*[\[(].*?[\])]", "", name).strip().lower()
        plain = re.sub(r"[\s.\-]+", "_", plain)
        plain = re.sub(r"_?(mdps|dps|deg_?s?|mrad_?s?|rad_?s?|m_?s2|mps2|mg|ut|nt|gauss|_g)$", "", plain) or plain
        for column, pattern in _NAMES.items():
            match = re.fullmatch(pattern, plain)
            if match is not None:
                names_by_index[index] = column if len(column) > 1 else column + match.groups()[-1]
                break
    columns = list(names_by_index.values())
    return {index: name for index, name in names_by_index.items() if columns.count(name) == 1}


def _find_time(shape: Shape, guess: Guess) -> None:
    """Enter into the guess the columns that increase steadily: a sequence number, and a time with its unit."""
    duration_s = float(shape.arrived_s[-1] - shape.arrived_s[0])
    guess.rate_hz = (len(shape.values) - 1) / duration_s
    for index in range(shape.values.shape[1]):
        column, name = shape.values[:, index], guess.columns[index]
        if name not in ("-", "time", "sequence") or np.isnan(column).any() or not _increases(column):
            continue
        steps = np.diff(column)
        by_ones = np.mean(steps == 1) > 0.9
        unit = _unit_of_time(steps[steps >= 0], duration_s / (len(column) - 1))
        ambiguous = by_ones and unit is not None
        if name == "-" and ambiguous:
            guess.columns[index] = "time"
            guess.time = {"unit": "?", "wrap": 2**32}
            guess.gaps.append(f"whether column {index + 1} counts samples or {unit}: both go on by one")
        elif name == "sequence" or (name == "-" and by_ones):
            guess.columns[index] = "sequence"
            guess.sequence_wrap = _wrap(column) or 0
        elif unit is not None:
            guess.columns[index] = "time"
            _set_time(guess, index, column, unit)
        elif name == "time":
            guess.time = {"unit": "?", "wrap": 2**32}
            guess.gaps.append(f"the unit of the time in column {index + 1}")
    if "time" not in guess.columns:
        guess.clock = "counted" if "sequence" in guess.columns else "arrival"
        how = "it samples by a timer, and counts" if guess.clock == "counted" else "when its lines arrive"
        guess.gaps.append(f"when it took a sample: no column is a time. Assumed: {how}")


def _set_time(guess: Guess, index: int, column: Array, unit: str) -> None:
    """Enter the column into the guess as the time in `unit`, with the number at which it wraps and the lines' rate."""
    wrap = _wrap(column)
    if wrap is None and (unit in {"s", "ns"} or column.max() >= 2**32):
        wrap = 0
    if wrap is None:
        guess.reasons.append("the time did not wrap while it was observed: 2^32 is assumed, as on an Arduino")
    guess.time = {"unit": unit, "wrap": 2**32 if wrap is None else wrap}
    steps = np.diff(column)
    rate_hz = TIMES[unit] / float(np.mean(steps[steps >= 0]))
    guess.rate_hz = rate_hz
    guess.reasons.append(f"column {index + 1} is the time in {unit}: it advances like the computer's clock")


def _increases(column: Array) -> bool:
    """Return whether a column never decreases, except where a counter restarts; a coarse time may repeat."""
    steps = np.diff(column)
    backwards = int(np.count_nonzero(steps < 0))
    return bool(backwards <= max(2, 0.02 * len(steps)) and steps.max() > 0 and np.all(column >= 0))


def _wrap(column: Array) -> int | None:
    """Return the power of two at which a column restarted; None if it did not."""
    if not (np.diff(column) < 0).any():
        return None
    return int(2 ** np.ceil(np.log2(column.max() + 1)))


def _unit_of_time(steps: Array, interval_s: float) -> str | None:
    for unit, size in TIMES.items():
        if abs(float(np.mean(steps)) / size / interval_s - 1) < TOLERANCE:
            return unit
    return None


def find_triads(shape: Shape, guess: Guess, still: Flags, starts: Iterable[int] | None = None) -> None:
    """Enter into the guess the unnamed triads of adjacent columns, recognized by their norms at rest and in rotation.

    `starts` are the columns with which a triad may begin, all if None.
    """
    named, starts = "gx" in guess.columns, list(range(shape.values.shape[1] - 2) if starts is None else starts)
    for start in starts:
        places = slice(start, start + 3)
        if guess.columns[places] != ["-"] * 3 or np.isnan(shape.values[:, places]).any():
            continue
        kind = _kind(shape.values[:, places], still)
        if kind is not None and kind + "x" not in guess.columns:
            guess.columns[places] = [kind + axis for axis in "xyz"]
    for kind in "gam":
        axes = [kind + axis for axis in "xyz"]
        if not all(axis in guess.columns for axis in axes):
            guess.columns[:] = ["-" if name in axes else name for name in guess.columns]
    if not named:
        _choose_gyroscope(shape, guess, still, starts)
    for kind in "amg":  # the gyroscope's unit comes from gravity
        if kind + "x" in guess.columns:
            guess.units[kind] = _unit(shape, guess, kind, still)
    if "g" not in guess.units:
        guess.gaps.append(
            "which columns are the gyroscope: no three read about zero at rest and much when they are turned"
        )


def _choose_gyroscope(shape: Shape, guess: Guess, still: Flags, starts: Iterable[int]) -> None:
    """Enter into the guess as the gyroscope the triad as which gravity rotates; if there is none, nothing changes.

    Angles, quaternions and a temperature beside a gyroscope's axis also read little at rest, and much when turned.
    """
    others = ["-" if name in ("gx", "gy", "gz") else name for name in guess.columns]
    first = [start for start in starts if guess.columns[start] == "gx"]
    for start in (*first, *starts):
        places = slice(start, start + 3)
        values = shape.values[:, places]
        if others[places] != ["-"] * 3 or np.isnan(values).any() or _kind(values, still) != "g":
            continue
        columns = [*others[:start], "gx", "gy", "gz", *others[start + 3 :]]
        if _rate_unit(shape, replace(guess, columns=columns, gaps=[]), values, still) is not None:
            guess.columns = columns
            return


def _kind(values: Array, still: Flags) -> str | None:
    """Return the kind of a triad (n, 3) as its norms at rest and in rotation show it; None if unclear.

    The kinds are "g" (gyroscope), "a" (accelerometer) and "m" (magnetometer).
    """
    rest, moving = values[still], values[~still]
    sizes = np.linalg.norm(values, axis=1)
    level = float(np.median(sizes[still]))
    if not len(moving):
        return "a" if _gravity(level) is not None else None
    # By differences between readings, because a log may have rests in several attitudes.
    scatter = float(np.linalg.norm(np.quantile(np.abs(np.diff(rest, axis=0)), NOISE_QUANTILE, axis=0))) / QUANTILE_RATIO
    if (
        np.linalg.norm(moving.std(axis=0)) > MIN_ROTATION_RATIO * max(scatter, 1e-9)
        and np.percentile(sizes[~still], 90) > 4 * level
    ):
        return "g"
    if level > 5 * scatter and abs(float(np.median(sizes[~still])) / level - 1) < 0.25:
        return "a" if _gravity(level) is not None else "m" if _field(level) is not None else None
    return None


def _gravity(level: float) -> tuple[str, float] | None:
    """Return a unit, and a factor on the numbers, for which the norm `level` at rest is gravity; None if none fits."""
    for size, unit in ((G, "m/s2"), (1.0, "g"), (1000.0, "mg")):
        if abs(level / size - 1) < TOLERANCE / 2:
            return unit, 1.0
    for counts in COUNTS_PER_G:
        if abs(level / counts - 1) < TOLERANCE / 2:
            return "g", 1 / counts
    return None


def _field(level: float) -> tuple[str, float] | None:
    for low, unit in ((20.0, "uT"), (0.2, "gauss"), (200.0, "mgauss"), (20e3, "nT")):
        if low < level < 3.5 * low:
            return unit, 1.0
    return None


def _unit(shape: Shape, guess: Guess, kind: str, still: Flags) -> dict[str, object]:
    """Return the unit and scale of a triad, from its names or else from its readings."""
    indices = [guess.columns.index(kind + axis) for axis in "xyz"]
    name = shape.names[indices[0]].lower() if shape.names else ""
    for pattern, unit in _UNITS[kind].items():
        if re.search(pattern, name):
            return {"unit": unit}
    values = shape.values[:, indices]
    unit_and_scale = None
    if kind == "g":
        unit_and_scale = _rate_unit(shape, guess, values, still)
    else:
        level = float(np.median(np.linalg.norm(values[still], axis=1)))
        unit_and_scale = _gravity(level) if kind == "a" else _field(level)
    if unit_and_scale is None:
        guess.gaps.append(f"the unit of the columns {kind}x {kind}y {kind}z: lines.{_SECTIONS[kind]}.unit")
        return {"unit": "?"}
    unit, scale = unit_and_scale
    guess.reasons.append(f"{kind}x {kind}y {kind}z are in {unit}" + ("" if scale == 1 else f", {scale:.6g} a count"))
    return {"unit": unit} if scale == 1 else {"unit": unit, "scale": float(f"{scale:.9g}")}


def _rate_unit(shape: Shape, guess: Guess, rates: Array, still: Flags) -> tuple[str, float] | None:
    """Return unit and scale of the gyroscope, by a fit of gravity's rotation to its readings; None if no unit fits.

    In the sensor's axes the direction f of gravity changes with df/dt = −ω × f, so the fitted factor of the readings is
    the size of a printed 1 in rad/s.
    """
    if "ax" not in guess.columns or not guess.rate_hz:
        return None
    forces = shape.values[:, [guess.columns.index("a" + axis) for axis in "xyz"]]
    rates = rates - rates[still].mean(axis=0)
    block_size = max(int(GRAVITY_INTERVAL_S * guess.rate_hz), 1)
    blocks = len(rates) // block_size
    if blocks < 8:
        return None
    forces = forces[: blocks * block_size].reshape(blocks, block_size, 3).mean(axis=1)
    rates = rates[: blocks * block_size].reshape(blocks, block_size, 3).mean(axis=1)
    # Least squares of df/dt, by central differences, against −(printed rate) × f.
    forces /= np.maximum(np.linalg.norm(forces, axis=1, keepdims=True), 1e-12)  # zeros before the first reading
    interval_s = 2 * block_size / guess.rate_hz
    change = (forces[2:] - forces[:-2]) / interval_s
    by_rate = -np.cross(rates[1:-1], forces[1:-1])
    size = float(np.sum(by_rate**2))
    rad_s = float(np.sum(by_rate * change)) / size if size > 0 else 0.0
    residual = float(np.sum((change - rad_s * by_rate) ** 2) / max(np.sum(change**2), 1e-12))
    if residual > 0.3 or rad_s <= 0:
        guess.gaps.append(
            "the orientation of the gyroscope's axes relative to the accelerometer's: gravity did not rotate as it read"
        )
        return None
    for unit, one in (("rad/s", 1.0), ("deg/s", np.pi / 180), ("mdeg/s", np.pi / 180e3), ("mrad/s", 1e-3)):
        if abs(rad_s / one - 1) < TOLERANCE:
            return unit, 1.0
    per_count = np.degrees(rad_s)
    near = sorted(DEG_S_PER_COUNT, key=lambda scale: abs(scale / per_count - 1))
    if abs(near[0] / per_count - 1) < SCALE_TOLERANCE and abs(near[1] / per_count - 1) > 2 * SCALE_TOLERANCE:
        return "deg/s", near[0]
    guess.gaps.append(f"the gyroscope's scale: a printed 1 is about {per_count:.3g} deg/s")
    return None


def find_temperature(shape: Shape, guess: Guess, still: Flags) -> None:
    """Take the first column without a name, with a mean of 10 to 60 and small changes, as the temperature in °C."""
    if "temperature" in guess.columns:
        return
    for index, name in enumerate(guess.columns):
        column = shape.values[:, index]
        is_named = bool(shape.names) and bool(shape.names[index])
        if name == "-" and not is_named and 10 < column.mean() < 60 and 0 < np.ptp(column) < 2:
            guess.columns[index] = "temperature"
            guess.reasons.append(f"column {index + 1} is the temperature in °C, by its size: see that it is")
            return

"""What the columns of an unknown device are, from ten seconds in which it lay still and was then turned. Pure.

Names tell it where there are any. Else time and number go on, what an accelerometer feels is as long as gravity, what a
gyroscope reads is nothing at rest and much while it turns; and by how much gravity went round tells its unit.
"""

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.sensors.lines.shape import NoShape, Shape

Flags = NDArray[np.bool_]
G = 9.80665
FEWEST = 10  # lines at rest, and in motion
ON_HAND = 0.12  # of a size that is known, as far as an accelerometer that nobody calibrated and a hand may be off
COUNTS_PER_G = (1024, 2048, 4096, 8192, 16384, 32768)
# °/s of a count: InvenSense (131 … 16.4 counts a °/s), ST (8.75 … 70 m°/s), Bosch (the same), Analog Devices.
COUNTS = (1 / 131, 1 / 65.5, 1 / 32.8, 1 / 16.4, 0.00875, 0.0175, 0.035, 0.07, 0.00625, 0.025, 0.1)
SAME_SCALE = 0.03
TURNED = 10.0  # times what a gyroscope does at rest it must do while it is turned
FLAT_S = 0.02  # over which gravity's way round is looked at: twice as long it is turned by a fifth of a radian at most
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
    """The columns, and what the sections say of them; `told` in words how each is known, `untold` what is not."""

    columns: list[str]
    rate_hz: float = 0.0
    time: dict[str, object] | None = None
    sequence_wrap: int = 0
    clock: str = "device"
    units: dict[str, dict[str, object]] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)
    untold: list[str] = field(default_factory=list)


def guess(shape: Shape, still_until_s: float) -> Guess:
    """What the columns are; the device lay still until then, by the computer's clock, and was turned afterwards.

    Raises NoShape where too few lines came while it did.
    """
    still = int(np.count_nonzero(shape.arrived_s < still_until_s))
    for lines, when in ((still, "while it lay still"), (len(shape.arrived_s) - still, "while it was turned")):
        if lines < FEWEST:
            raise NoShape(f"only {lines} of its lines came {when}")
    count = shape.values.shape[1]
    found = Guess(["-"] * count)
    named = _named(shape.names)
    for place, name in named.items():
        found.columns[place] = name
    texts = [place for place in range(count) if np.isnan(shape.values[:, place]).any()]
    found.told += [f"column {place + 1} holds no number in every line" for place in texts]
    _find_time(shape, found)
    _find_triads(shape, found, shape.arrived_s < still_until_s)
    _find_temperature(shape, found, shape.arrived_s < still_until_s)
    for place, name in enumerate(found.columns):
        if name == "-" and place not in texts:
            found.untold.append(f"what column {place + 1} is: it is not read")
    for name, unit in found.units.items():
        places = [found.columns.index(name + axis) for axis in "xyz"]
        decimals = {shape.decimals[place] for place in places}
        if len(decimals) == 1 and min(decimals) >= 0:
            unit["decimals"] = decimals.pop()
    return found


def _named(names: tuple[str, ...]) -> dict[int, str]:
    """Columns that a name tells, by their places; none where a name stands for two."""
    found: dict[int, str] = {}
    for place, name in enumerate(names):
        plain = re.sub(r"\s*[\[(].*?[\])]", "", name).strip().lower()
        plain = re.sub(r"[\s.\-]+", "_", plain)
        plain = re.sub(r"_?(mdps|dps|deg_?s?|mrad_?s?|rad_?s?|m_?s2|mps2|mg|ut|nt|gauss|_g)$", "", plain) or plain
        for what, pattern in _NAMES.items():
            match = re.fullmatch(pattern, plain)
            if match is not None:
                found[place] = what if len(what) > 1 else what + match.groups()[-1]
                break
    columns = list(found.values())
    return {place: name for place, name in found.items() if columns.count(name) == 1}


def _find_time(shape: Shape, guess: Guess) -> None:
    """The columns that go on: one that counts by ones, and one that tells time; and by which unit it does."""
    lasted_s = float(shape.arrived_s[-1] - shape.arrived_s[0])
    guess.rate_hz = (len(shape.values) - 1) / lasted_s
    for place in range(shape.values.shape[1]):
        column, name = shape.values[:, place], guess.columns[place]
        if name not in ("-", "time", "sequence") or np.isnan(column).any() or not _goes_on(column):
            continue
        steps = np.diff(column)
        by_ones = np.mean(steps == 1) > 0.9
        unit = _unit_of_time(steps[steps >= 0], lasted_s / (len(column) - 1))
        ambiguous = by_ones and unit is not None
        if name == "-" and ambiguous:
            guess.columns[place], guess.time = "time", {"unit": "?", "wrap": 2**32}
            guess.untold.append(f"whether column {place + 1} counts samples or {unit}: both go on by one")
        elif name == "sequence" or (name == "-" and by_ones):
            guess.columns[place] = "sequence"
            guess.sequence_wrap = _wrap(column) or 0
        elif unit is not None:
            guess.columns[place] = "time"
            _tell_time(guess, place, column, unit)
        elif name == "time":
            guess.time = {"unit": "?", "wrap": 2**32}
            guess.untold.append(f"the unit of the time in column {place + 1}")
    if "time" not in guess.columns:
        guess.clock = "counted" if "sequence" in guess.columns else "arrival"
        word = "it samples by a timer, and counts" if guess.clock == "counted" else "when its lines arrive"
        guess.untold.append(f"when it took a sample: no column is a time. Taken: {word}")


def _tell_time(guess: Guess, place: int, column: Array, unit: str) -> None:
    seen = _wrap(column)
    if seen is None and (unit in {"s", "ns"} or column.max() >= 2**32):
        seen = 0
    if seen is None:
        guess.told.append("the time did not wrap while it was looked at: 2^32 is taken, as of an Arduino")
    guess.time = {"unit": unit, "wrap": 2**32 if seen is None else seen}
    steps = np.diff(column)
    rate_hz = TIMES[unit] / float(np.mean(steps[steps >= 0]))
    guess.rate_hz = rate_hz
    guess.told.append(f"column {place + 1} is the time in {unit}: it goes on as the computer's clock does")


def _goes_on(column: Array) -> bool:
    """Whether it never goes back but where it begins anew; a coarse time may stand for several lines."""
    steps = np.diff(column)
    backwards = int(np.count_nonzero(steps < 0))
    return bool(backwards <= max(2, 0.02 * len(steps)) and steps.max() > 0 and np.all(column >= 0))


def _wrap(column: Array) -> int | None:
    """The power of two at which a column began again; None where it did not."""
    if not (np.diff(column) < 0).any():
        return None
    return int(2 ** np.ceil(np.log2(column.max() + 1)))


def _unit_of_time(steps: Array, apart_s: float) -> str | None:
    for unit, size in TIMES.items():
        if abs(float(np.mean(steps)) / size / apart_s - 1) < ON_HAND:
            return unit
    return None


def _find_triads(shape: Shape, guess: Guess, still: Flags) -> None:
    """Three columns after one another that nobody named: by their sizes at rest and while it is turned."""
    for start in range(shape.values.shape[1] - 2):
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
    for kind in "amg":  # the gyroscope's unit is told by gravity
        if kind + "x" in guess.columns:
            guess.units[kind] = _unit(shape, guess, kind, still)
    if "g" not in guess.units:
        guess.untold.append("which columns are the gyroscope: none reads nothing at rest, and much when it is turned")


def _kind(values: Array, still: Flags) -> str | None:
    rest, turned = values[still], values[~still]
    sizes = np.linalg.norm(values, axis=1)
    level = float(np.median(sizes[still]))
    scatter = float(np.linalg.norm(rest.std(axis=0)))
    if (
        np.linalg.norm(turned.std(axis=0)) > TURNED * max(scatter, 1e-9)
        and np.percentile(sizes[~still], 90) > 4 * level
    ):
        return "g"
    if level > 5 * scatter and abs(float(np.median(sizes[~still])) / level - 1) < 0.25:
        return "a" if _gravity(level) is not None else "m" if _field(level) is not None else None
    return None


def _gravity(level: float) -> tuple[str, float] | None:
    """Unit and scale in which gravity is so large."""
    for size, unit in ((G, "m/s2"), (1.0, "g"), (1000.0, "mg")):
        if abs(level / size - 1) < ON_HAND / 2:
            return unit, 1.0
    for counts in COUNTS_PER_G:
        if abs(level / counts - 1) < ON_HAND / 2:
            return "g", 1 / counts
    return None


def _field(level: float) -> tuple[str, float] | None:
    for low, unit in ((20.0, "uT"), (0.2, "gauss"), (200.0, "mgauss"), (20e3, "nT")):
        if low < level < 3.5 * low:
            return unit, 1.0
    return None


def _unit(shape: Shape, guess: Guess, kind: str, still: Flags) -> dict[str, object]:
    """Unit and scale of a triad: as its names say, else as the readings do."""
    places = [guess.columns.index(kind + axis) for axis in "xyz"]
    name = shape.names[places[0]].lower() if shape.names else ""
    for pattern, unit in _UNITS[kind].items():
        if re.search(pattern, name):
            return {"unit": unit}
    values = shape.values[:, places]
    told = None
    if kind == "g":
        told = _rate_unit(shape, guess, values, still)
    else:
        level = float(np.median(np.linalg.norm(values[still], axis=1)))
        told = _gravity(level) if kind == "a" else _field(level)
    if told is None:
        guess.untold.append(f"the unit of the columns {kind}x {kind}y {kind}z: lines.{_SECTIONS[kind]}.unit")
        return {"unit": "?"}
    unit, scale = told
    guess.told.append(f"{kind}x {kind}y {kind}z are in {unit}" + ("" if scale == 1 else f", {scale:.6g} a count"))
    return {"unit": unit} if scale == 1 else {"unit": unit, "scale": float(f"{scale:.9g}")}


def _rate_unit(shape: Shape, guess: Guess, rates: Array, still: Flags) -> tuple[str, float] | None:
    """Unit and scale of the gyroscope, by how far gravity went round while it read so much."""
    if "ax" not in guess.columns or not guess.rate_hz:
        return None
    forces = shape.values[:, [guess.columns.index("a" + axis) for axis in "xyz"]]
    rates = rates - rates[still].mean(axis=0)
    flat = max(int(FLAT_S * guess.rate_hz), 1)
    blocks = len(rates) // flat
    if blocks < 8:
        return None
    forces = forces[: blocks * flat].reshape(blocks, flat, 3).mean(axis=1)
    rates = rates[: blocks * flat].reshape(blocks, flat, 3).mean(axis=1)
    forces /= np.linalg.norm(forces, axis=1, keepdims=True)
    apart_s = 2 * flat / guess.rate_hz
    change = (forces[2:] - forces[:-2]) / apart_s
    by_rate = -np.cross(rates[1:-1], forces[1:-1])
    size = float(np.sum(by_rate**2))
    rad_s = float(np.sum(by_rate * change)) / size if size > 0 else 0.0
    left = float(np.sum((change - rad_s * by_rate) ** 2) / max(np.sum(change**2), 1e-12))
    if left > 0.3 or rad_s <= 0:
        guess.untold.append("how the gyroscope's axes lie to the accelerometer's: gravity did not go round as it read")
        return None
    for unit, one in (("rad/s", 1.0), ("deg/s", np.pi / 180), ("mdeg/s", np.pi / 180e3), ("mrad/s", 1e-3)):
        if abs(rad_s / one - 1) < ON_HAND:
            return unit, 1.0
    per_count = np.degrees(rad_s)
    near = sorted(COUNTS, key=lambda each: abs(each / per_count - 1))
    if abs(near[0] / per_count - 1) < SAME_SCALE and abs(near[1] / per_count - 1) > 2 * SAME_SCALE:
        return "deg/s", near[0]
    guess.untold.append(f"the gyroscope's scale: a printed 1 is about {per_count:.3g} deg/s")
    return None


def _find_temperature(shape: Shape, guess: Guess, still: Flags) -> None:
    if "temperature" in guess.columns:
        return
    for place, name in enumerate(guess.columns):
        column = shape.values[:, place]
        if name == "-" and 10 < column.mean() < 60 and 0 < np.ptp(column) < 2:
            guess.columns[place] = "temperature"
            guess.told.append(f"column {place + 1} is the temperature in °C, by its size: see that it is")
            return

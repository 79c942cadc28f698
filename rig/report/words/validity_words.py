"""When a value holds, how warm it was, and at what rates, in words: the same at the terminal and on certificates."""

import math
from collections.abc import Sequence
from datetime import datetime

from rig.data.entries.result_types import ConditionsEntry
from rig.data.result_file import GyroscopeEntry

DEG = math.degrees(1)
AS_STATED = ", as stated"
UNKNOWN = "a temperature that is not known"
ALIKE = 0.005  # of a rate: what the arm's timing and a sensor that leans by 5° make of one speed


def when_words(when: ConditionsEntry) -> str:
    """The temperature at which, and the time over which, a value is a mean, in words."""
    began, ended = (datetime.fromisoformat(each) for each in (when.from_utc, when.to_utc))
    day = f"{began:%Y-%m-%d} "
    until = f"{ended:%H:%M:%S}" if ended.date() == began.date() else f"{ended:%Y-%m-%d %H:%M:%S}"
    over = f"mean over {day}{began:%H:%M:%S} to {until} UTC"
    if when.temperature_c is None:
        return f"at {UNKNOWN}, {over}"
    if when.temperature_range_c is None:
        return f"at {when.temperature_c:.1f} °C, as stated, {over}"
    low, high = (f"{each:.2f}" for each in when.temperature_range_c)
    went = f"stayed at {low} °C" if low == high else f"was between {low} and {high} °C"
    return f"at {when.temperature_c:.1f} °C, {over}, in which it {went}"


def warmth_words(when: ConditionsEntry | None) -> str:
    """What tells a temperature, in words; where nobody knows when, the item's thermometer did if anything."""
    if when is not None and when.temperature_c is None:
        return "of which the item provided no temperature, and nobody stated one"
    if when is not None and when.temperature_stated:
        return "as stated, for the item provided no temperature"
    return "by the item's own thermometer, which is not calibrated"


def warmth(when: ConditionsEntry, of: str = "") -> dict[str, float | None]:
    """A temperature, by what was read `of` the sensor then."""
    return {f"{of}{AS_STATED}" if when.temperature_stated else of: when.temperature_c}


def told_by(of: str) -> str:
    """What tells a temperature of `warmth`, behind what it is of."""
    return of if of.endswith(AS_STATED) else f"{of}, by its own thermometer"


def speed_words(sensor: GyroscopeEntry) -> str:
    """The speeds of the sweeps, °/s, either way."""
    return ", ".join(f"±{DEG * speed:.1f}" for speed in sensor.speeds_rad_s)


def load_words(sensor: GyroscopeEntry) -> str | None:
    """The rates with which a gyroscope's own axes were loaded, °/s; None where these are the speeds of the sweeps."""
    loads, speeds = sensor.axis_rate_ranges_rad_s, sensor.speeds_rad_s
    if loads is None or not speeds:
        return None
    if all(_alike(low, speeds[0]) and _alike(high, speeds[-1]) for low, high in loads):
        return None
    return ", ".join(f"{axis} {_between(load)}" for axis, load in zip("xyz", loads, strict=True))


def _between(load: Sequence[float]) -> str:
    low, high = load
    return f"{DEG * high:.1f}" if _alike(low, high) else f"{DEG * low:.1f} to {DEG * high:.1f}"


def _alike(one: float, other: float) -> bool:
    return math.isclose(one, other, rel_tol=ALIKE)

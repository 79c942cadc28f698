"""Time, temperature and rates at which a value is valid, in words for terminal and certificates."""

import math
from collections.abc import Sequence
from datetime import datetime

from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.budget import BudgetEntry
from rig.data.entries.result_types import ConditionsEntry
from rig.data.result_file import GyroscopeEntry

# Statements for every run: a budget covers one temperature, one power-up and one mounting.
EXCLUSIONS = (
    "other temperatures",
    "power cycling",
    "remounting and its stress",
    "vibration that the item rectifies",
    "ageing and transport",
)

# Statement for a motion that a file describes.
FILE_EXCLUSIONS = ("the scale of the file's angles and of its time",)

DEG = math.degrees(1)
STATED_SUFFIX = ", as stated"
UNKNOWN_TEMPERATURE = "a temperature that is not known"
SPEED_TOLERANCE = 0.005  # relative: the effect of the arm's timing, and of a sensor tilted by 5°


def when_words(when: ConditionsEntry) -> str:
    """Return the mean temperature and the time of a value, in words."""
    start, end = (datetime.fromisoformat(time) for time in (when.from_utc, when.to_utc))
    day = f"{start:%Y-%m-%d} "
    until = f"{end:%H:%M:%S}" if end.date() == start.date() else f"{end:%Y-%m-%d %H:%M:%S}"
    over = f"mean over {day}{start:%H:%M:%S} to {until} UTC"
    if when.temperature_c is None:
        return f"at {UNKNOWN_TEMPERATURE}, {over}"
    if when.temperature_range_c is None:
        return f"at {when.temperature_c:.1f} °C, as stated, {over}"
    low, high = (f"{temperature_c:.2f}" for temperature_c in when.temperature_range_c)
    limits = f"constant at {low} °C" if low == high else f"between {low} and {high} °C"
    return f"at {when.temperature_c:.1f} °C, {over}, {limits}"


def warmth_words(when: ConditionsEntry | None) -> str:
    """Return the source of a temperature in words: the thermometer (also without `when`), a statement, or none."""
    if when is not None and when.temperature_c is None:
        return "temperature neither measured by the item nor stated"
    if when is not None and when.temperature_stated:
        return "as stated; the item measured no temperature"
    return "by the item's own thermometer, which is not calibrated"


def warmth(when: ConditionsEntry, use: str = "") -> dict[str, float | None]:
    """Return a temperature with its label, which contains the `use` of the readings, for example " at the biases"."""
    return {f"{use}{STATED_SUFFIX}" if when.temperature_stated else use: when.temperature_c}


def label_source(use: str) -> str:
    """Return a label that `warmth` made, with the source of the temperature added if the label does not name it."""
    return use if use.endswith(STATED_SUFFIX) else f"{use}, by its own thermometer"


def speed_words(sensor: GyroscopeEntry) -> str:
    """Return the speeds of the sweeps, °/s, as text, with ± because each speed has both directions."""
    return ", ".join(f"±{DEG * speed:.1f}" for speed in sensor.speeds_rad_s)


def load_words(sensor: GyroscopeEntry) -> str | None:
    """Return the rates about a gyroscope's own axes, °/s, in words; None if they equal the rates of the sweeps."""
    loads, speeds = sensor.axis_rate_ranges_rad_s, sensor.speeds_rad_s
    if loads is None or not speeds:
        return None
    if all(_is_close(low, speeds[0]) and _is_close(high, speeds[-1]) for low, high in loads):
        return None
    return ", ".join(f"{axis} {_range_words(load)}" for axis, load in zip("xyz", loads, strict=True))


def _range_words(load: Sequence[float]) -> str:
    low, high = load
    return f"{DEG * high:.1f}" if _is_close(low, high) else f"{DEG * low:.1f} to {DEG * high:.1f}"


def _is_close(one: float, other: float) -> bool:
    return math.isclose(one, other, rel_tol=SPEED_TOLERANCE)


def has_contributor(budget: BudgetEntry | None, name: str) -> bool:
    """Return whether the budget has a contributor whose name contains `name`."""
    return budget is not None and any(name in line.name for line in budget.contributors)


def list_omitted_rates(sensor: GyroscopeEntry, *, external: bool = False) -> str:
    """Return the errors that a gyroscope's U omits; with `external`, also those of motion that a file gives."""
    bent = EXCLUSIONS if sensor.nonlinearity is not None else ("nonlinearity at other speeds", *EXCLUSIONS)
    return ", ".join(("the effect of gravity", *FILE_EXCLUSIONS, *bent) if external else bent)


def list_omitted_accelerations(entry: AccelerometerEntry) -> str:
    """Return the effects that an accelerometer's U does not include."""
    bent = "nonlinearity" if entry.second_order_s2_m is None else "nonlinearity beyond the second order"
    bent = "nonlinearity beyond 1 g" if has_contributor(entry.budget, "nonlinearity") else bent
    return ", ".join((bent, *EXCLUSIONS))


def list_omitted_fields() -> str:
    """Return the errors that a magnetometer's U omits, without the arm's field, which is stated with the bias."""
    return ", ".join(("nonlinearity", "iron magnetised since", *EXCLUSIONS))

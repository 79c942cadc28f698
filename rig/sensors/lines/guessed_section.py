"""The section of a sensor that `rig lines` writes: the guessed values, and a gap for each unknown one. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass

from rig.config.sensors.lines_section import UNDETERMINED
from rig.sensors.lines.guessing import Guess
from rig.sensors.lines.shape import Shape

RATE_TOLERANCE = 0.02  # relative tolerance of a round rate
ROUND_DIGITS = (1, 2, 2.5, 4, 5, 8, 10)


@dataclass(frozen=True, slots=True)
class StatedProperties:
    """Properties that lines of text do not show, as the user states them; None if the user has not stated one.

    `by_hand`: whether the section is for a session by hand.
    """

    serial_number: str | None = None
    range_deg_s: str | None = None
    range_g: str | None = None
    by_hand: bool = False


def section(
    shape: Shape, guess: Guess, port: str, baud: int, name: str = "imu", *, user: StatedProperties | None = None
) -> str:
    """Return the YAML of the section `sensors`. An unknown value is written as `?`, which `rig check` then reports."""
    user = user or StatedProperties()
    lines: dict[str, object] = {"columns": _format_list(guess.columns)}
    if shape.keys:
        lines["keys"] = _format_list([_quote(key) for key in shape.keys])
    else:
        lines["separator"] = shape.separator
    if shape.prefix:
        lines["prefix"] = _quote(shape.prefix)
    if shape.checksum:
        lines["checksum"] = "nmea"
    if guess.clock != "device":
        lines["clock"] = guess.clock
    if guess.time is not None:
        lines["time"] = _format_mapping(guess.time)
    if guess.sequence_wrap:
        lines["sequence_wrap"] = guess.sequence_wrap
    for kind, key in (("g", "rate"), ("a", "acceleration"), ("m", "field")):
        if kind in guess.units:
            lines[key] = _format_mapping(guess.units[kind])
    rows = [
        "sensors:",
        f"  {name}:",
        "    part: lines",
        f"    serial_number: {_fill(user.serial_number)}  # of this specimen",
        f"    rate_hz: {_round_rate(guess.rate_hz):g}",
        f"    range_deg_s: {_fill(user.range_deg_s)}  # full scale to which the device's program sets the gyroscope",
    ]
    if "a" in guess.units:
        range_g = _fill(user.range_g)
        rows.append(f"    acceleration: {{range_g: {range_g}}}  # … and the accelerometer; without this it is not read")
    if user.by_hand:
        rows.append("    correction: matrix  # the right angles of the axes are found too")
    rows += ["    serial:", f"      port: {port}", f"      baud: {baud}", "    lines:"]
    rows += [f"      {key}: {value}" for key, value in lines.items()]
    if "temperature" not in guess.columns:
        rows.append("      # temperature: {stated_c: …}  no column is known as one: state how warm it is")
    return "\n".join(rows) + "\n"


def _format_list(values: list[str]) -> str:
    return "[" + ", ".join('"-"' if value == "-" else value for value in values) + "]"


def _format_mapping(values: Mapping[str, object]) -> str:
    return "{" + ", ".join(f"{key}: {_format_value(value)}" for key, value in values.items()) + "}"


def _format_value(value: object) -> str:
    return f'"{UNDETERMINED}"' if value == UNDETERMINED else str(value)


def _fill(value: str | None) -> str:
    return f'"{UNDETERMINED}"' if value is None else value


def _quote(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def _round_rate(rate_hz: float) -> float:
    """Return the nearest round rate, or the rate with three digits if no round one is near."""
    size = 10.0 ** (len(str(int(rate_hz))) - 1)
    for digits in ROUND_DIGITS:
        if abs(rate_hz / (digits * size) - 1) < RATE_TOLERANCE:
            return digits * size
    return float(f"{rate_hz:.3g}")

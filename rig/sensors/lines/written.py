"""The section of a sensor as `rig lines` writes it: what the lines told, and a gap for what they did not. Pure."""

from collections.abc import Mapping

from rig.config.sensors.lines_section import GAP
from rig.sensors.lines.guessing import Guess
from rig.sensors.lines.shape import Shape

NICE = 0.02  # of a rate, within which it is a round one
ROUND = (1, 2, 2.5, 4, 5, 8, 10)


def section(shape: Shape, guess: Guess, port: str, baud: int, name: str = "imu") -> str:
    """The YAML of `sensors`; `?` stands where somebody has to look it up, and `rig check` refuses it by the key."""
    lines: dict[str, object] = {"columns": _listed(guess.columns)}
    if shape.keys:
        lines["keys"] = _listed([_quoted(key) for key in shape.keys])
    else:
        lines["separator"] = shape.separator
    if shape.prefix:
        lines["prefix"] = _quoted(shape.prefix)
    if shape.checksum:
        lines["checksum"] = "nmea"
    if guess.clock != "device":
        lines["clock"] = guess.clock
    if guess.time is not None:
        lines["time"] = _mapped(guess.time)
    if guess.sequence_wrap:
        lines["sequence_wrap"] = guess.sequence_wrap
    for kind, key in (("g", "rate"), ("a", "acceleration"), ("m", "field")):
        if kind in guess.units:
            lines[key] = _mapped(guess.units[kind])
    gap = f'"{GAP}"'
    rows = [
        "sensors:",
        f"  {name}:",
        "    part: lines",
        f"    serial_number: {gap}  # of this specimen",
        f"    rate_hz: {_nice(guess.rate_hz):g}",
        f"    range_deg_s: {gap}  # full scale to which the device's program sets the gyroscope",
    ]
    if "a" in guess.units:
        rows.append(f"    acceleration: {{range_g: {gap}}}  # … and the accelerometer; without this it is not read")
    rows += ["    serial:", f"      port: {port}", f"      baud: {baud}", "    lines:"]
    rows += [f"      {key}: {value}" for key, value in lines.items()]
    if "temperature" not in guess.columns:
        rows.append("      # temperature: {stated_c: …}  it prints none: state how warm it is, or U allows for much")
    return "\n".join(rows) + "\n"


def _listed(values: list[str]) -> str:
    return "[" + ", ".join('"-"' if value == "-" else value for value in values) + "]"


def _mapped(values: Mapping[str, object]) -> str:
    return "{" + ", ".join(f"{key}: {_value(value)}" for key, value in values.items()) + "}"


def _value(value: object) -> str:
    return f'"{GAP}"' if value == GAP else str(value)


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def _nice(rate_hz: float) -> float:
    """A round rate near by, as people set them; else three digits."""
    size = 10.0 ** (len(str(int(rate_hz))) - 1)
    for each in ROUND:
        if abs(rate_hz / (each * size) - 1) < NICE:
            return each * size
    return float(f"{rate_hz:.3g}")

"""`rig lines PORT`: inspect a device that sends lines of text, and write its section or a configuration."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import Refused, raise_as
from rig.errors.quoting import printable_lines
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.sensors.lines.guessed_section import StatedProperties

DURATIONS_S = (4.0, 6.0)


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig lines`."""
    parser.add_argument("port", metavar="PORT", help="its serial port, or socket://host:port")
    parser.add_argument("--baud", type=int, metavar="BD", help="speed of its line (default: the usual ones are tried)")
    parser.add_argument("--name", default="imu", metavar="NAME", help="name of the sensor (default: imu)")
    parser.add_argument(
        "--seconds",
        type=float,
        nargs=2,
        default=DURATIONS_S,
        metavar=("STILL", "TURNED"),
        help="duration at rest, and of the turns that follow (default: 4 6)",
    )
    parser.add_argument(
        "--write", type=Path, metavar="FILE", help="write a complete configuration by hand to a new file"
    )
    add_stated(parser)


def add_stated(parser: ArgumentParser) -> None:
    """Add the arguments for properties that the lines of text do not show: serial number and ranges."""
    parser.add_argument("--serial-number", metavar="NUMBER", help="serial number of this specimen")
    parser.add_argument(
        "--range-deg-s", metavar="DEG_S", help="full scale to which the device's program sets the gyroscope"
    )
    parser.add_argument("--range-g", metavar="G", help="full scale to which it sets the accelerometer")


def run(options: Namespace) -> int:
    """Print the section on stdout, or write the file; report on stderr what the lines show, and what is missing.

    Return 0, or 1 if the file needs more values. Raise what `look_at_device`, `ask_stated` and `write_checked` raise.
    """
    if not all(0.5 <= duration_s <= 600 for duration_s in options.seconds):
        raise Refused("bad_option", "--seconds are two times from 0.5 to 600", "Give for example --seconds 4 6")
    if options.write is None:
        from rig.sensors.lines.guessed_section import StatedProperties

        given_values = StatedProperties(options.serial_number, options.range_deg_s, options.range_g)
        section = look_at_device(options.port, options.baud, options.name, tuple(options.seconds), given_values)
        _tell('replace every "?" by its value; rig check refuses the section until then')
        sys.stdout.write(section)
        return 0
    from rig.commands.devices.configuration_writing import refuse_existing, write_checked
    from rig.config.first_configuration import Answers

    refuse_existing(options.write)
    given_values = ask_stated(options, by_hand=True)
    section = look_at_device(options.port, options.baud, options.name, tuple(options.seconds), given_values)
    return write_checked(options.write, Answers("hand", "lines", options.port, sensors=section))


def ask_stated(options: Namespace, *, by_hand: bool) -> "StatedProperties":
    """Return the stated values, asked for at a terminal if no option states them. Raise Refused `bad_option`."""
    from rig.commands.devices.terminal_questions import ask
    from rig.config.sensors.sensor_sections import check_serial_number
    from rig.sensors.lines.guessed_section import StatedProperties

    questions = {
        "serial_number": ("serial number of this specimen", "--serial-number", check_serial_number),
        "range_deg_s": ("full scale of the gyroscope in its program, °/s", "--range-deg-s", positive_number),
        "range_g": (
            "full scale of the accelerometer in its program, g (Enter: it has none)",
            "--range-g",
            _range_or_none,
        ),
    }
    options_given = {key: getattr(options, key) for key in questions}
    answers = {
        key: ask(question, option, valid, value=options_given[key])
        for key, (question, option, valid) in questions.items()
        if options_given[key] is not None or sys.stdin.isatty()
    }
    return StatedProperties(**{key: answer or None for key, answer in answers.items()}, by_hand=by_hand)


def positive_number(text: str) -> str:
    """Return the text unchanged if it is a number above 0. Raise ValueError otherwise."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e6:
        raise ValueError("must be a number above 0, without a unit")
    return text


def _range_or_none(text: str) -> str:
    return text and positive_number(text)


def look_at_device(
    port: str, baud: int | None, name: str, seconds: tuple[float, float], user: "StatedProperties"
) -> str:
    """Read lines of a device at rest, then in rotation; print what they show, and return the sensor's YAML section.

    `seconds` are the two durations. Raise Refused as `listen` does; `lines_no_pattern` for lines without a common
    pattern; for a session by hand, `lines_not_turned` if no columns look like a gyroscope's.
    """
    import numpy as np

    from rig.commands.laboratory.claims import claim_sensor
    from rig.sensors.lines.guessed_section import section
    from rig.sensors.lines.guessing import guess
    from rig.sensors.lines.listening import listen
    from rig.sensors.lines.shape import NoShape, find_shape

    with raise_as(Refused), claim_sensor(name, port):
        baud, lines, still_s = listen(port, baud, _tell, seconds)
    try:
        shape = find_shape(lines)
        layout = guess(shape, still_s)
    except NoShape as why:
        raise _no_pattern(port, why) from why
    for reason in layout.reasons:
        _tell(reason)
    for gap in layout.gaps:
        _tell(f"UNKNOWN {gap}")
    if user.by_hand and "gx" not in layout.columns:
        if np.isnan(shape.values).any():
            raise _no_pattern(port, "some of its columns are text, so no three of them are a gyroscope")
        still, turned = seconds
        raise Refused(
            "lines_not_turned",
            f"{port}: no three columns read about zero at rest and much when it is turned, so nothing was written",
            "Run it again, and when it says so turn the device about every axis, by half a turn and back; "
            f"--seconds {still:g} {2 * turned:g} gives more time",
        )
    return printable_lines(section(shape, layout, port, baud, name, user=user))


def _no_pattern(port: str, why: object) -> Refused:
    remedy = "Let its program print one sample a line, numbers only: no brackets, no JSON"
    return Refused("lines_no_pattern", f"{port}: {why}", remedy)


def _tell(what: str) -> None:
    say(f"rig lines: {what}", file=sys.stderr)

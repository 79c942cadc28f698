"""`rig lines PORT`: look at a device that prints lines, and write its section, or a whole file that runs by hand."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import Refused, raised_as
from rig.errors.quoting import printable_lines
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.sensors.lines.written import StatedProperties

SECONDS = (4.0, 6.0)


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig lines`."""
    parser.add_argument("port", metavar="PORT", help="its serial port, or socket://host:port")
    parser.add_argument("--baud", type=int, metavar="BD", help="speed of its line (default: the usual ones are tried)")
    parser.add_argument("--name", default="imu", metavar="NAME", help="what the sensor is called (default: imu)")
    parser.add_argument(
        "--seconds",
        type=float,
        nargs=2,
        default=SECONDS,
        metavar=("STILL", "TURNED"),
        help="how long it lies still, and is turned then (default: 4 6)",
    )
    parser.add_argument(
        "--write", type=Path, metavar="FILE", help="write a whole configuration that runs by hand, a new file"
    )
    add_stated(parser)


def add_stated(parser: ArgumentParser) -> None:
    """Add the arguments for what no line shows."""
    parser.add_argument("--serial-number", metavar="NUMBER", help="of this specimen")
    parser.add_argument(
        "--range-deg-s", metavar="DEG_S", help="full scale to which the device's program sets the gyroscope"
    )
    parser.add_argument("--range-g", metavar="G", help="… and the accelerometer")


def run(options: Namespace) -> int:
    """Print the section on stdout, or write the file, and say on stderr what is known and what is not.

    Return 0, or 1 if the file has something to be filled in. Raise Refused as `section_of`, `stated` and `written`.
    """
    if not all(0.5 <= each <= 600 for each in options.seconds):
        raise Refused("bad_option", "--seconds are two times from 0.5 to 600", "Give for example --seconds 4 6")
    if options.write is None:
        from rig.sensors.lines.written import StatedProperties

        known = StatedProperties(options.serial_number, options.range_deg_s, options.range_g)
        section = section_of(options.port, options.baud, options.name, tuple(options.seconds), known)
        _tell('write what is known in place of "?"; rig check refuses the section until then')
        sys.stdout.write(section)
        return 0
    from rig.commands.devices.written import refuse_existing, written
    from rig.config.first_configuration import Answers

    refuse_existing(options.write)
    known = stated(options, by_hand=True)
    section = section_of(options.port, options.baud, options.name, tuple(options.seconds), known)
    return written(options.write, Answers("hand", "lines", options.port, sensors=section))


def stated(options: Namespace, *, by_hand: bool) -> "StatedProperties":
    """Ask what no line shows and no option says; without a terminal it stays open. Raise Refused `bad_option`."""
    from rig.commands.devices.questions import answered
    from rig.config.sensors.sensor_sections import check_serial_number
    from rig.sensors.lines.written import StatedProperties

    asked = {
        "serial_number": ("serial number of this specimen", "--serial-number", check_serial_number),
        "range_deg_s": ("full scale of the gyroscope in its program, °/s", "--range-deg-s", positive_number),
        "range_g": ("full scale of the accelerometer in its program, g", "--range-g", positive_number),
    }
    given = {key: getattr(options, key) for key in asked}
    found = {
        key: answered(question, option, valid, given=given[key])
        for key, (question, option, valid) in asked.items()
        if given[key] is not None or sys.stdin.isatty()
    }
    return StatedProperties(**found, by_hand=by_hand)


def positive_number(text: str) -> str:
    """Return a number as it was written. Raise ValueError if it is none above 0."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e6:
        raise ValueError("must be a number above 0")
    return text


def section_of(port: str, baud: int | None, name: str, seconds: tuple[float, float], known: "StatedProperties") -> str:
    """Look at a device for ten seconds and return its section as YAML; say what the lines show.

    Raise Refused as `listen`, and `lines_no_pattern` if its lines have nothing in common.
    """
    from rig.commands.laboratory.claims import claim_sensor
    from rig.sensors.lines.guessing import guess
    from rig.sensors.lines.listening import listen
    from rig.sensors.lines.shape import NoShape, find_shape
    from rig.sensors.lines.written import section

    with raised_as(Refused), claim_sensor(name, port):
        baud, lines, still_s = listen(port, baud, _tell, seconds)
    try:
        shape = find_shape(lines)
        found = guess(shape, still_s)
    except NoShape as why:
        raise Refused(
            "lines_no_pattern", f"{port}: {why}", "Let its program print one sample a line, numbers only"
        ) from why
    for reason in found.reasons:
        _tell(reason)
    for gap in found.gaps:
        _tell(f"CANNOT TELL {gap}")
    return printable_lines(section(shape, found, port, baud, name, user=known))


def _tell(what: str) -> None:
    say(f"rig lines: {what}", file=sys.stderr)

"""`rig lines PORT`: look at a device that prints lines, and write the section of a configuration for it."""

import sys
from argparse import ArgumentParser, Namespace

from rig.errors import Refused, raised_as
from rig.errors.quoting import printable_lines
from rig.station.plain_text import say


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig lines`."""
    parser.add_argument("port", metavar="PORT", help="its serial port, or socket://host:port")
    parser.add_argument("--baud", type=int, metavar="BD", help="speed of its line (default: the usual ones are tried)")
    parser.add_argument("--name", default="imu", metavar="NAME", help="what the sensor is called (default: imu)")
    parser.add_argument(
        "--seconds",
        type=float,
        nargs=2,
        default=(4.0, 6.0),
        metavar=("STILL", "TURNED"),
        help="how long it lies still, and is turned then (default: 4 6)",
    )


def run(options: Namespace) -> int:
    """Print the section on stdout, and on stderr what is known and what is not; returns 0.

    Raises Refused as `listen`, `bad_option`, and `lines_no_pattern` where its lines have nothing in common.
    """
    from rig.commands.laboratory.claims import claimed_sensor
    from rig.sensors.lines.guessing import guess
    from rig.sensors.lines.listening import listen
    from rig.sensors.lines.shape import NoShape, find_shape
    from rig.sensors.lines.written import section

    if not all(0.5 <= each <= 600 for each in options.seconds):
        raise Refused("bad_option", "--seconds are two times from 0.5 to 600", "Give for example --seconds 4 6")
    with raised_as(Refused), claimed_sensor(options.name, options.port):
        baud, lines, still_s = listen(options.port, options.baud, _tell, tuple(options.seconds))
    try:
        shape = find_shape(lines)
        found = guess(shape, still_s)
    except NoShape as why:
        raise Refused(
            "lines_no_pattern", f"{options.port}: {why}", "Let its program print one sample a line, numbers only"
        ) from why
    for reason in found.reasons:
        _tell(reason)
    for gap in found.gaps:
        _tell(f"CANNOT TELL {gap}")
    _tell('write what is known in place of "?"; rig check refuses the section until then')
    sys.stdout.write(printable_lines(section(shape, found, options.port, baud, options.name)))
    return 0


def _tell(what: str) -> None:
    say(f"rig lines: {what}", file=sys.stderr)

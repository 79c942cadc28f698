"""`rig kvh info`: look at a KVH 1775 at a port or in a configuration. Nothing in its memory is changed."""

import sys
from argparse import ArgumentParser, Namespace
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from rig.commands.config_arguments import add_json, add_set
from rig.commands.laboratory.laboratory import simulated_laboratory
from rig.errors import Refused, raised_as
from rig.station.plain_text import say

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.report.terminal.kvh_info import KvhInfo
    from rig.sensors.kvh1775.messages import Format

LOOK_S = 1.0
LEAST_MESSAGES = 3


def add(parser: ArgumentParser) -> None:
    """The commands of `rig kvh`: one today."""
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    text = "its number, the settings in its memory, its built-in test, what it sends; changes nothing"
    info = commands.add_parser("info", help=text, description=text)
    info.add_argument("target", metavar="PORT_OR_CONFIG", help="its serial port, or a YAML configuration file")
    add_set(info, "change one value of the file")
    info.add_argument("--baud", type=int, metavar="BD", help="speed of its line (default: the file's, or 921600)")
    add_json(info)


def run(options: Namespace) -> int:
    """Print what is at the port, or every KVH 1775 of the configuration, that is given; 2 if one has a problem."""
    from rig.commands.laboratory.own_address import load_at_own_address
    from rig.report.terminal.kvh_info import print_kvh_info

    target, baud = options.target, options.baud
    with ExitStack() as stack:
        places = {target: (target, baud or 921600)}
        if Path(target).is_file():
            loaded = stack.enter_context(load_at_own_address(Path(target), options.overrides))
            places = {
                name: (section.serial.port, baud or section.serial.baud)
                for name, section in loaded.config.sensors.items()
                if section.serial is not None and section.part == "kvh1775"
            }
            if not places:
                raise Refused("no_kvh_section", f"{target} has no KVH 1775", "Give a port, or another configuration")
            if loaded.simulated:
                stack.enter_context(simulated_laboratory(loaded.text))
        problems = []
        for name, (port, speed) in places.items():
            found = _look(name, port, speed)
            print_kvh_info(found, as_json=options.json)
            problems += [found.problem] if found.problem is not None else []
    for problem in problems:
        say(f"rig: {problem}", file=sys.stderr)
    return 2 if problems else 0


def _look(name: str, port: str, baud: int) -> "KvhInfo":
    """Raises Refused where nothing can be asked at all."""
    import numpy as np

    from rig.commands.laboratory.claims import claim_sensor
    from rig.report.terminal.kvh_info import KvhInfo
    from rig.sensors.errors import SensorError
    from rig.sensors.kvh1775.driver import Kvh1775
    from rig.sensors.kvh1775.settings import Kvh1775Settings

    seen: list[NDArray[Any]] = []
    with (
        raised_as(Refused),
        claim_sensor(name, port),
        closing(Kvh1775(name, port, baud, lambda messages, *_: seen.append(messages))) as kvh,
    ):
        found = KvhInfo(name, port, baud, kvh.serial_number, dict(kvh.settings))
        try:
            kvh.run()
            found = replace(found, built_in_test=kvh.test().values.hex(" "))
            rate_hz = float(kvh.settings["DR"])
            kvh.start(Kvh1775Settings(rate_hz, cast("Format", kvh.settings["OUTPUTFMT"]), "rate"))
            kvh.listen(LOOK_S + LEAST_MESSAGES / rate_hz)
        except SensorError as error:
            found = replace(found, problem=str(error))
        if not seen:
            return found
        messages = np.concatenate(seen)
        return replace(
            found,
            messages=len(messages),
            lost=kvh.lost,
            rotation=tuple(messages["rotation"].mean(axis=0, dtype=np.float64).tolist()),
            acceleration_g=tuple(messages["acceleration_g"].mean(axis=0, dtype=np.float64).tolist()),
            status=f"0x{int(np.bitwise_and.reduce(messages['status'])):02x}",
        )

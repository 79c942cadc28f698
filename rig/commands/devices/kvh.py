"""`rig kvh info`: inspect a KVH 1775 at a port or in a configuration, without changing its memory."""

import sys
from argparse import ArgumentParser, Namespace
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from rig.commands.config_arguments import add_json, add_set
from rig.commands.laboratory.laboratory_process import run_simulated_laboratory
from rig.errors import Refused, raise_as
from rig.station.plain_text import say

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.report.terminal.kvh_info import KvhInfo
    from rig.sensors.kvh1775.kvh_messages import Format

LISTEN_S = 1.0
MIN_MESSAGES = 3


def add(parser: ArgumentParser) -> None:
    """Add the command of `rig kvh`."""
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    text = "print its serial number, settings, built-in test and messages; changes nothing"
    info = commands.add_parser("info", help=text, description=text)
    info.add_argument("target", metavar="PORT_OR_CONFIG", help="its serial port, or a YAML configuration file")
    add_set(info, "change one value of the file")
    info.add_argument("--baud", type=int, metavar="BD", help="speed of its line (default: the file's, or 921600)")
    add_json(info)


def run(options: Namespace) -> int:
    """Print the KVH 1775 at the given port, or each instrument in the configuration; return 2 if one has a problem.

    Raise Refused `no_kvh_section` for a configuration without a KVH 1775.
    """
    from rig.commands.laboratory.own_address import load_at_own_address
    from rig.report.terminal.kvh_info import print_kvh_info

    target, baud = options.target, options.baud
    with ExitStack() as stack:
        ports = {target: (target, baud or 921600)}
        if Path(target).is_file():
            loaded = stack.enter_context(load_at_own_address(Path(target), options.overrides))
            ports = {
                name: (section.serial.port, baud or section.serial.baud)
                for name, section in loaded.config.sensors.items()
                if section.serial is not None and section.part == "kvh1775"
            }
            if not ports:
                raise Refused("no_kvh_section", f"{target} has no KVH 1775", "Give a port, or another configuration")
            if loaded.simulated:
                stack.enter_context(run_simulated_laboratory(loaded.text))
        problems = []
        for name, (port, speed) in ports.items():
            info = _query_instrument(name, port, speed)
            print_kvh_info(info, as_json=options.json)
            problems.extend([info.problem] if info.problem is not None else [])
    for problem in problems:
        say(f"rig: {problem}", file=sys.stderr)
    return 2 if problems else 0


def _query_instrument(name: str, port: str, baud: int) -> "KvhInfo":
    """Return the answers of one instrument. Raise Refused if it does not answer at all."""
    import numpy as np

    from rig.commands.laboratory.claims import claim_sensor
    from rig.report.terminal.kvh_info import KvhInfo
    from rig.sensors.errors import SensorError
    from rig.sensors.kvh1775.kvh_driver import Kvh1775
    from rig.sensors.kvh1775.kvh_settings import Kvh1775Settings

    batches: list[NDArray[Any]] = []
    with (
        raise_as(Refused),
        claim_sensor(name, port),
        closing(Kvh1775(name, port, baud, lambda messages, *_: batches.append(messages))) as kvh,
    ):
        info = KvhInfo(name, port, baud, kvh.serial_number, dict(kvh.settings))
        try:
            kvh.run()
            info = replace(info, built_in_test=kvh.test().values.hex(" "))
            rate_hz = float(kvh.settings["DR"])
            kvh.start(Kvh1775Settings(rate_hz, cast("Format", kvh.settings["OUTPUTFMT"]), "rate"))
            kvh.listen(LISTEN_S + MIN_MESSAGES / rate_hz)
        except SensorError as error:
            info = replace(info, problem=str(error))
        if not batches:
            return info
        messages = np.concatenate(batches)
        return replace(
            info,
            messages=len(messages),
            lost=kvh.lost,
            rotation=tuple(messages["rotation"].mean(axis=0, dtype=np.float64).tolist()),
            acceleration_g=tuple(messages["acceleration_g"].mean(axis=0, dtype=np.float64).tolist()),
            status=f"0x{int(np.bitwise_and.reduce(messages['status'])):02x}",
        )

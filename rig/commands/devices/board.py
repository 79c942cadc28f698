"""`rig board …`: its commands and their arguments: inspect the board, change its calibrations, flash its firmware."""

from argparse import ArgumentParser, Namespace
from typing import Any

from rig.commands.config_arguments import add_config, add_json, add_run


def add(board: ArgumentParser) -> None:
    """Add the commands of `rig board`."""
    commands = board.add_subparsers(title="commands", required=True, metavar="COMMAND")

    def add_command(to: Any, name: str, text: str) -> ArgumentParser:
        command: ArgumentParser = to.add_parser(name, help=text, description=text)
        command.set_defaults(of_board=name)
        return command

    info = add_command(commands, "info", "print the board's identity, health, sensors and calibrations")
    add_config(info)
    add_json(info)
    hand = add_command(commands, "hand", "calibrate on the board itself a gyroscope that is turned by hand")
    add_config(hand)
    add_json(hand)
    hand.add_argument("--sensor", metavar="NAME", help="sensor of the configuration (default: the first)")
    hand.add_argument(
        "--moves", type=int, default=12, metavar="N", help="least number of moves, 8 to 200 (default: 12)"
    )
    hand.add_argument(
        "--scale-std",
        type=float,
        default=1e-3,
        metavar="STD",
        help="continue until the session's standard uncertainty of the scale is at most this (default: 0.001)",
    )
    hand.add_argument(
        "--fetch",
        action="store_true",
        help="start no session: fetch the result of the board's last one, which its button began",
    )
    hand.add_argument("--write", action="store_true", help="store the result as the board's calibration")
    hand.add_argument("--yes", action="store_true", help="do not ask before the board is changed")
    text = "read or change the calibrations in the board's flash"
    stored = commands.add_parser("calibration", help=text, description=text).add_subparsers(
        title="commands", required=True, metavar="COMMAND"
    )
    read = add_command(stored, "read", "print the stored calibrations")
    write = add_command(stored, "write", "store the calibration of a passed run")
    erase = add_command(stored, "erase", "erase the stored calibrations")
    for command in (read, write, erase):
        add_config(command)
    add_json(read)
    add_run(write, "result", "a run folder or its result.json", metavar="RESULT")
    for command in (read, write, erase):
        command.add_argument("--sensor", metavar="NAME", help="only this sensor of the configuration")
    flash = add_command(commands, "flash", "flash the firmware that comes with this program")
    flash.add_argument("--probe", metavar="ID", help="id of the debug probe, or a part of it, if there are several")
    flash.add_argument(
        "--drive",
        nargs="?",
        const="",
        metavar="PATH",
        help="copy to the board's USB drive instead (default: the one present)",
    )
    for command in (write, erase, flash):
        command.add_argument("--yes", action="store_true", help="do not ask before the board is changed")


def run(options: Namespace) -> int:
    """Carry out the chosen command of `rig board`; return its exit status."""
    if options.of_board == "flash":
        from rig.commands.devices.flash import flash

        return flash(options)
    if options.of_board == "hand":
        from rig.commands.devices.hand_on_board import hand

        return hand(options)
    from rig.commands.devices import board_commands as board

    commands = {"info": board.info, "read": board.read, "write": board.write, "erase": board.erase}
    return commands[options.of_board](options)

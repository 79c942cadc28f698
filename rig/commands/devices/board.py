"""`rig board …`: look at the board, read and change its stored calibrations, flash its firmware; what these take."""

from argparse import ArgumentParser, Namespace
from typing import Any

from rig.commands.config_arguments import add_config, add_json, add_run


def add(board: ArgumentParser) -> None:
    """The commands of `rig board`."""
    commands = board.add_subparsers(title="commands", required=True, metavar="COMMAND")

    def added(to: Any, name: str, text: str) -> ArgumentParser:
        command: ArgumentParser = to.add_parser(name, help=text, description=text)
        command.set_defaults(of_board=name)
        return command

    info = added(commands, "info", "what the board is, how it fares, which sensors and calibrations it has")
    add_config(info)
    add_json(info)
    hand = added(commands, "hand", "let the board itself calibrate a gyroscope that is turned by hand")
    add_config(hand)
    add_json(hand)
    hand.add_argument("--sensor", metavar="NAME", help="this one of the configuration's sensors; default: the first")
    hand.add_argument("--moves", type=int, default=12, metavar="N", help="so many moves at least, 8 to 200 (12)")
    hand.add_argument(
        "--scale-std",
        type=float,
        default=1e-3,
        metavar="STD",
        help="and until the standard uncertainty of the scale by this session is no larger (0.001)",
    )
    hand.add_argument(
        "--fetch",
        action="store_true",
        help="make no session: take what the board keeps of the last one, which its button began",
    )
    hand.add_argument("--write", action="store_true", help="store what was found as the board's calibration")
    hand.add_argument("--yes", action="store_true", help="do not ask before the board is changed")
    text = "the calibrations in the board's flash"
    stored = commands.add_parser("calibration", help=text, description=text).add_subparsers(
        title="commands", required=True, metavar="COMMAND"
    )
    read = added(stored, "read", "print what is stored")
    write = added(stored, "write", "store the calibration of a run that passed")
    erase = added(stored, "erase", "forget what is stored")
    for command in (read, write, erase):
        add_config(command)
    add_json(read)
    add_run(write, "result", "a run folder or its result.json", metavar="RESULT")
    for command in (read, write, erase):
        command.add_argument("--sensor", metavar="NAME", help="only this one of the configuration's sensors")
    flash = added(commands, "flash", "put the firmware that comes with this program on it")
    flash.add_argument("--probe", metavar="ID", help="the debug probe's id or a part of it, if there are several")
    flash.add_argument(
        "--drive", nargs="?", const="", metavar="PATH", help="copy to the board's USB drive instead; default: find it"
    )
    for command in (write, erase, flash):
        command.add_argument("--yes", action="store_true", help="do not ask before the board is changed")


def run(options: Namespace) -> int:
    """Carry out the command of `rig board` that is meant."""
    if options.of_board == "flash":
        from rig.commands.devices.flash import flash

        return flash(options)
    if options.of_board == "hand":
        from rig.commands.devices.hand_on_board import hand

        return hand(options)
    from rig.commands.devices import board_commands as board

    commands = {"info": board.info, "read": board.read, "write": board.write, "erase": board.erase}
    return commands[options.of_board](options)

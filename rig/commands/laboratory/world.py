"""`rig world`: the simulated laboratory alone, in the foreground, for any client."""

import subprocess
import sys
from argparse import ArgumentParser, Namespace

from rig.commands.config_arguments import add_config
from rig.commands.laboratory.laboratory_process import run_simulated_laboratory, send_request, write_temporary
from rig.commands.laboratory.only_on_linux import refuse_unless_linux


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig world`."""
    add_config(parser)
    parser.add_argument(
        "--faults",
        action="store_true",
        help="as fast as a real one, with what is typed in this terminal: unplug, slider 50, lay +x, …",
    )


def run(options: Namespace) -> int:
    """Run only the world of a configuration, until Ctrl-C; return its exit status.

    Raise Refused `only_on_linux`, and what `load` and, with `--faults`, `run_simulated_laboratory` raise; Fault
    `world_ended`.
    """
    refuse_unless_linux("the simulated laboratory")
    from rig.config.load import load

    text = load(options.config, options.overrides, sections=None).text
    if options.faults:
        with run_simulated_laboratory(text) as control:
            return _practise(control)
    with write_temporary(text) as config_path:
        return subprocess.call([sys.executable, "-P", "-m", "rig.world", str(config_path)])


def _practise(control: str) -> int:
    """Cause each incident that the user types, by the channel `control`, until the input ends; return 0."""
    from rig.commands.laboratory.practice import opening_text, practise
    from rig.station.plain_text import say

    send_request(control, {"do": "pace", "time_scale": 1.0})  # a servo runs in real time only
    print(opening_text(control), flush=True)
    while True:
        try:
            words = input("laboratory> ")
        except EOFError:
            print()
            return 0
        for line in practise(control, words).split("\n"):
            say(line)
        sys.stdout.flush()

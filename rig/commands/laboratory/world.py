"""`rig world`: only the simulated laboratory, in the foreground, for any client."""

import subprocess
import sys
from argparse import ArgumentParser, Namespace

from rig.commands.config_arguments import add_config
from rig.commands.laboratory.laboratory_process import write_temporary
from rig.commands.laboratory.only_on_linux import refuse_unless_linux


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig world`."""
    add_config(parser)


def run(options: Namespace) -> int:
    """Run only the world of a configuration, until Ctrl-C; return its exit status.

    Raise Refused `only_on_linux`, and as `load`.
    """
    refuse_unless_linux("the simulated laboratory")
    from rig.config.load import load

    with write_temporary(load(options.config, options.overrides, sections=None).text) as config_path:
        return subprocess.call([sys.executable, "-P", "-m", "rig.world", str(config_path)])

"""`python -m rig.world CONFIG [--until-eof]`: the simulated laboratory in the foreground, for any client."""

import argparse
import sys

from rig.config.load import load
from rig.errors import Refused
from rig.world.process import serve


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m rig.world", description="The simulated laboratory.")
    parser.add_argument("config", metavar="CONFIG", help="a configuration file with a world: section")
    parser.add_argument("--until-eof", action="store_true", help="ignore Ctrl-C and end when standard input closes")
    options = parser.parse_args(arguments)
    try:
        serve(load(options.config), options.until_eof)
    except Refused as error:
        print(error, file=sys.stderr)
        return error.exit_status
    return 0


if __name__ == "__main__":
    sys.exit(main())

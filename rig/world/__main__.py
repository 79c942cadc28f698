"""`python -m rig.world CONFIG [--until-eof] [--late FILE] [--truth FILE]`: the simulated laboratory in the foreground.

The first line on stdout is JSON: `ready`, and the addresses at which everything listens. With --until-eof a parent
process reads that line, so a refusal is reported there too: `ready` is false and `problem` holds the error.
"""

import argparse
import json
import sys
from pathlib import Path

from firmware_host.installation import install_command
from rig.config.load import load
from rig.errors import Refused


def main(arguments: list[str] | None = None) -> int:
    """Run the simulated laboratory until it ends; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m rig.world", description="The simulated laboratory.")
    parser.add_argument("config", metavar="CONFIG", help="a configuration file with a world: section")
    parser.add_argument("--until-eof", action="store_true", help="ignore Ctrl-C and end when standard input closes")
    parser.add_argument(
        "--late", type=Path, metavar="FILE", help="the file for reports of steps that came late (stderr)"
    )
    parser.add_argument(
        "--truth", type=Path, metavar="FILE", help="the file for the truth of a run, when it is asked for"
    )
    options = parser.parse_args(arguments)
    try:
        loaded = load(options.config, sections=None)
        try:
            from rig.world.world_process import serve
        except ModuleNotFoundError as error:
            raise Refused(
                "no_emulator",
                f"the simulated laboratory needs the package {error.name}, which is not installed",
                f"Install it: {install_command('world')}",
            ) from error
        serve(loaded, options.until_eof, options.late, options.truth)
    except Refused as error:
        if options.until_eof:
            print(json.dumps({"ready": False, "problem": error.problem._asdict()}), flush=True)
        else:
            print(error, file=sys.stderr)
        return error.exit_status
    return 0


if __name__ == "__main__":
    sys.exit(main())

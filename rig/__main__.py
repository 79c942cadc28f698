"""`python -m rig` is the command `rig`, which begins here."""

import os
import signal
import sys
from contextlib import suppress
from typing import Any


def main() -> int:
    """Entry point of `rig`: as `rig.cli.main`, with a Ctrl-C that is one line from the first moment on."""
    signal.signal(signal.SIGINT, _end)  # until `rig.cli.guarded` has its own
    from rig.cli import main as command

    return command()


def _end(*_: Any) -> None:
    """End at once: while modules are loaded nothing has begun, and what is raised there is a traceback."""
    with suppress(OSError):
        os.write(2, b"rig: interrupted\n")
    os._exit(130)


if __name__ == "__main__":
    sys.exit(main())

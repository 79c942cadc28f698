"""The entry point of `python -m rig`, which is the command `rig`."""

import os
import signal
import sys
from contextlib import suppress
from typing import Any


def main() -> int:
    """Run `rig` as `rig.cli.main` does; from the first moment, Ctrl-C prints one line."""
    signal.signal(signal.SIGINT, _exit_at_once)  # until `rig.cli.run_guarded` installs its own
    from rig.cli import main as command
    from rig.errors import INTERRUPTED_STATUS

    status = command()
    if status == INTERRUPTED_STATUS and hasattr(signal, "pthread_sigmask"):
        # CPython notes an interrupt inside `exec`, which dataclasses use while modules are loaded, although it is
        # handled. At the end of `python -m` it then kills its own process by SIGINT in place of this status.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    return status


def _exit_at_once(*_: Any) -> None:
    """Exit at once: while modules are loaded nothing has begun, and an exception would print a traceback."""
    with suppress(OSError):
        os.write(2, b"rig: interrupted\n")
    os._exit(130)  # `rig.errors.INTERRUPTED_STATUS`, which may not be loaded yet


if __name__ == "__main__":
    sys.exit(main())

"""A command of the user's own after the end of a run, for example to send a mail after hours of measurement."""

import os
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path

from rig.errors import INTERRUPTED_STATUS, Fault, RigError
from rig.station.plain_text import say

MAX_WAIT_S = 60.0


def add_notice(parser: ArgumentParser) -> None:
    """Add the argument `--notify`."""
    parser.add_argument(
        "--notify",
        metavar="COMMAND",
        help="run this command in a shell after the run, however it ended; RIG_RUN is its folder, RIG_STATUS "
        "the exit status: 0 passed, 1 failed, 2 refused, 3 fault, 130 interrupted",
    )


def notify_after(command: str | None, folder: Path, work: Callable[[], int]) -> int:
    """Carry out a run in `folder` and return its exit status; then run the command, even after an error.

    If the command fails or hangs, this is printed, and the exit status remains that of the run.
    """
    if command is None:
        return work()
    status = Fault.exit_status
    try:
        status = work()
        return status
    except RigError as error:
        status = error.exit_status
        raise
    except KeyboardInterrupt:
        status = INTERRUPTED_STATUS
        raise
    finally:
        _notify(command, folder, status)


def _notify(command: str, folder: Path, status: int) -> None:
    """Run the user's command with the run's folder and exit status in its environment; report a failure."""
    environment = {**os.environ, "RIG_RUN": str(folder.resolve()), "RIG_STATUS": str(status)}
    try:
        # Its output is not a result, so it goes to stderr like the run's progress.
        done = subprocess.run(command, shell=True, env=environment, timeout=MAX_WAIT_S, check=False, stdout=2)
        why = f"it ended with status {done.returncode}" if done.returncode else None
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        why = str(error)
    if why is not None:
        say(f"rig: the command of --notify failed: {why}", sys.stderr)

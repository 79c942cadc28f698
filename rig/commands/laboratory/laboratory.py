"""Starts the simulated laboratory a configuration asks for, in a process of its own, and stops it afterwards."""

import json
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from rig.commands.laboratory.only_on_linux import refuse_unless_linux
from rig.errors import Problem, Refused

STOP_TIMEOUT_S = 5.0
MOUNT_TIMEOUT_S = 30.0


@contextmanager
def simulated_laboratory(config_text: str, late: Path | None = None) -> Iterator[str]:
    """Run the world of a configuration, given as its text, for the `with` block; the address of its control channel.

    Should steps of it come late, it writes to the file `late` what held them; to stderr where it is None.

    The world ends when its standard input closes, so it cannot outlive this process, however this process ends.
    Raises Refused: `only_on_linux`, what the world refused, or `world_not_ready` when it ends without a word of its
    own.
    """
    refuse_unless_linux("the simulated laboratory")
    command = [sys.executable, "-P", "-m", "rig.world", "--until-eof", *([] if late is None else ["--late", str(late)])]
    with (
        written(config_text) as path,
        # A session of its own: Ctrl-C in the terminal must stop the arm first, not the laboratory under it.
        subprocess.Popen(
            [*command, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        ) as process,
    ):
        kept_open, answers = filter(None, (process.stdin, process.stdout))
        try:
            answer = json.loads(answers.readline() or "{}")
            if "problem" in answer:
                raise Refused.of(Problem(**answer["problem"]))
            if not answer.get("ready"):
                raise Refused(
                    "world_not_ready",
                    f"the simulated laboratory ended with status {process.wait()} before it was ready",
                    "Its own message is above; `rig world CONFIG` runs it alone",
                )
            yield str(answer["control"])
        finally:
            kept_open.close()
            try:
                process.wait(STOP_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                process.kill()


def hands_of(control: str) -> Callable[[int], None]:
    """What mounts the item for a stage, from 0: the simulated operator, who knows nothing but the stage's number.

    `control` is the laboratory's control channel. Raises OSError where it is gone.
    """
    return lambda stage: _told(control, {"do": "mount", "stage": stage})


def part_fitter(control: str) -> Callable[[str], None]:
    """What lays the part of a serial number in: the simulated operator. `control` and raises as `hands_of`."""
    return lambda part: _told(control, {"do": "fit", "part": part})


def _told(control: str, request: Mapping[str, str | int]) -> None:
    host, _, port = control.rpartition(":")
    with socket.create_connection((host, int(port)), MOUNT_TIMEOUT_S) as channel:
        channel.sendall(json.dumps(request).encode() + b"\n")
        channel.makefile("rb").readline()


@contextmanager
def written(config_text: str) -> Iterator[Path]:
    """The configuration as a file that is there for the length of the `with` block."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "config.yaml"
        path.write_text(config_text, encoding="utf-8")
        yield path

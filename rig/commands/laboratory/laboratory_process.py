"""The start of the simulated laboratory of a configuration, in a process of its own, and its end."""

import json
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rig.commands.laboratory.only_on_linux import refuse_unless_linux
from rig.errors import Problem, Refused

STOP_TIMEOUT_S = 5.0
CONTROL_TIMEOUT_S = 30.0


@contextmanager
def run_simulated_laboratory(config_text: str, late: Path | None = None, truth: Path | None = None) -> Iterator[str]:
    """Run the world of a configuration text during the block; yield the address of its control channel.

    The world writes the causes of late steps to the file `late`, or to stderr, and the truth on request to `truth`.

    The world ends when its standard input closes, so it cannot outlive this process. Raise Refused: `only_on_linux`,
    the world's own refusal, or `world_not_ready` if the world ends without a refusal.
    """
    refuse_unless_linux("the simulated laboratory")
    files = {"--late": late, "--truth": truth}
    options = [text for option, path in files.items() if path is not None for text in (option, str(path))]
    command = [sys.executable, "-P", "-m", "rig.world", "--until-eof", *options]
    with (
        write_temporary(config_text) as path,
        # A session of its own: Ctrl-C in the terminal must stop the arm first, not the laboratory under it.
        subprocess.Popen(
            [*command, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        ) as process,
    ):
        kept_open, answers = filter(None, (process.stdin, process.stdout))
        try:
            answer = json.loads(answers.readline() or "{}")
            if "problem" in answer:
                raise Refused.from_problem(Problem(**answer["problem"]))
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


def make_mounter(control: str) -> Callable[[int], None]:
    """Return the function with which the simulated operator mounts the item for a stage, counted from 0.

    `control`: the laboratory's control channel. The function raises OSError or ValueError if the laboratory has ended.
    """

    def mount(stage: int) -> None:
        send_request(control, {"do": "mount", "stage": stage})

    return mount


def make_fitter(control: str) -> Callable[[str], None]:
    """Return the function with which the simulated operator mounts the part with a given serial number.

    `control`: the laboratory's control channel. The function raises OSError or ValueError if the laboratory has ended.
    """

    def fit(part: str) -> None:
        send_request(control, {"do": "fit", "part": part})

    return fit


def send_request(control: str, request: Mapping[str, Any]) -> Mapping[str, Any]:
    """Send a request to the control channel and return the reply. Raise OSError or ValueError if none comes."""
    host, _, port = control.rpartition(":")
    with socket.create_connection((host, int(port)), CONTROL_TIMEOUT_S) as channel:
        channel.sendall(json.dumps(dict(request)).encode() + b"\n")
        reply: Mapping[str, Any] = json.loads(channel.makefile("rb").readline())
        return reply


@contextmanager
def write_temporary(config_text: str) -> Iterator[Path]:
    """Write the configuration to a file that exists during the block; yield its path."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "config.yaml"
        path.write_text(config_text, encoding="utf-8")
        yield path

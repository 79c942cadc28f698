"""One rig at a time for an arm, a board, an instrument: a command claims what it works with, for as long as it does.

A claim is a socket that listens under a name of the kernel's own, which no file stands for (unix(7), abstract sockets).
It ends with the process that holds it, however that ends, so nothing stale is left behind; every user of the computer
sees it; and the kernel tells whose it is. Other systems than Linux have no such names: nothing is claimed there.

What is held from another computer the arm itself tells: `program_running`, `registers_in_use`.
"""

import os
import shlex
import socket
import struct
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from hashlib import sha256
from pathlib import Path
from urllib.parse import urlsplit

from rig.commands.laboratory.only_on_linux import refuse_unless_linux
from rig.config.models import RigConfig
from rig.errors import Refused
from rig.errors.quoting import shorten

CREDENTIALS = struct.Struct("3i")  # of the far end: process, user, group (unix(7), SO_PEERCRED)


@contextmanager
def claimed(config: RigConfig) -> Iterator[None]:
    """All that a run works with. Raises Refused as `claimed_arm`, `claimed_board` and `claimed_sensor` do."""
    with ExitStack() as stack:
        if config.turner.address:
            stack.enter_context(claimed_arm(config.turner.address))
        if config.board is not None:
            stack.enter_context(claimed_board(config.board.port))
        ports = {each.own_port[1]: name for name, each in config.sensors.items() if each.own_port is not None}
        for port, name in ports.items():
            stack.enter_context(claimed_sensor(name, port))
        yield


def claimed_arm(host: str) -> AbstractContextManager[None]:
    """The arm, or what turns at a serial port, by whatever name it is called.

    Raises Refused `arm_claimed`, `only_on_linux`.
    """
    refuse_unless_linux("what moves an arm or a servomotor")
    if "/" in host:
        return _claimed("arm_claimed", f"port {_place(host)}", f"the turner at {host}")
    return _claimed("arm_claimed", f"arm {_address(host)}", f"the arm at {host}")


def claimed_laboratory(host: str) -> AbstractContextManager[None]:
    """The address of a simulated laboratory, from before its world is there. Raises Refused `arm_claimed`."""
    return _claimed("arm_claimed", f"laboratory {_address(host)}", f"the simulated laboratory at {host}")


def claimed_board(port: str) -> AbstractContextManager[None]:
    """A claim on the board at `port`. Raises Refused `board_claimed`."""
    return _claimed("board_claimed", f"port {_place(port)}", f"the board at {port}")


def claimed_sensor(name: str, port: str) -> AbstractContextManager[None]:
    """A sensor with a port of its own. Raises Refused `sensor_claimed`."""
    return _claimed("sensor_claimed", f"port {_place(port)}", f"the sensor {name} at {port}")


@contextmanager
def _claimed(name: str, device: str, told: str) -> Iterator[None]:
    if sys.platform != "linux":
        yield
        return
    # An address has room for 107 bytes, and a path may have more.
    address = "\0calibration-rig " + sha256(os.fsencode(device)).hexdigest()
    with socket.socket(socket.AF_UNIX) as claim:
        try:
            claim.bind(address)
            claim.listen()
        except OSError as error:
            raise Refused(
                name,
                f"{told} is in use by another rig on this computer, {_holder(address)}",
                "Let it finish, or end it with Ctrl-C where it runs",
            ) from error
        yield


def _holder(address: str) -> str:
    """The process that has it, and how it was called where that may be read."""
    process = 0
    try:
        with socket.socket(socket.AF_UNIX) as question:
            question.settimeout(1.0)
            question.connect(address)
            process, *_ = CREDENTIALS.unpack(
                question.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, CREDENTIALS.size)
            )
        program, *arguments = Path(f"/proc/{process}/cmdline").read_text("utf-8", "replace").split("\0")[1:-1]
    except (OSError, ValueError):  # it has ended meanwhile, or is another user's
        return f"process {process}" if process else "whose process cannot be seen"
    return f"process {process}: {shorten(shlex.join([Path(program).name, *arguments]))}"


def _place(port: str) -> str:
    """A port by the one name it has, whatever links to it: its device, or its address."""
    parts = urlsplit(port)
    if parts.scheme == "socket" and parts.hostname is not None:
        return f"{_address(parts.hostname)}:{parts.port}"
    return os.path.realpath(port)


def _address(host: str) -> str:
    try:
        return socket.gethostbyname(host)
    except (OSError, UnicodeError):  # nobody's name; connecting says so
        return host

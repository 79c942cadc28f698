"""Claims: a command reserves its arm, board or instrument, so that only one rig at a time uses it.

A claim is a socket that listens under an abstract name of the kernel (unix(7)), without a file. The claim ends with the
process that holds it, however the process ends. Every user of the computer sees the claim, and the kernel names its
holder. Only Linux has such names, so on other systems nothing is claimed.

If another computer uses the arm, the arm itself reports this (`program_running`, `registers_in_use`).
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

CREDENTIALS = struct.Struct("3i")  # credentials of the far end: process, user, group (unix(7), SO_PEERCRED)


@contextmanager
def claim_devices(config: RigConfig) -> Iterator[None]:
    """Claim all devices of a run for the block. Raise Refused as `claim_arm`, `claim_board` and `claim_sensor` do."""
    with ExitStack() as stack:
        if config.turner.address:
            stack.enter_context(claim_arm(config.turner.address))
        if config.board is not None:
            stack.enter_context(claim_board(config.board.port))
        ports = {sensor.own_port[1]: name for name, sensor in config.sensors.items() if sensor.own_port is not None}
        for port, name in ports.items():
            stack.enter_context(claim_sensor(name, port))
        yield


def claim_arm(host: str) -> AbstractContextManager[None]:
    """Claim the arm or serial turner, under any of its names, for the block. Raise `arm_claimed`, `only_on_linux`."""
    refuse_unless_linux("what moves an arm or a servomotor")
    if "/" in host:
        return _claim("arm_claimed", f"port {_canonical_port(host)}", f"the turner at {host}")
    return _claim("arm_claimed", f"arm {_resolve_host(host)}", f"the arm at {host}")


def claim_laboratory(host: str) -> AbstractContextManager[None]:
    """Claim a simulated laboratory's address for the block, before its world starts. Raise Refused `arm_claimed`."""
    return _claim("arm_claimed", f"laboratory {_resolve_host(host)}", f"the simulated laboratory at {host}")


def claim_board(port: str) -> AbstractContextManager[None]:
    """Claim the board at `port` for the block. Raise Refused `board_claimed`."""
    return _claim("board_claimed", f"port {_canonical_port(port)}", f"the board at {port}")


def claim_sensor(name: str, port: str) -> AbstractContextManager[None]:
    """Claim a sensor with a port of its own for the block. Raise Refused `sensor_claimed`."""
    return _claim("sensor_claimed", f"port {_canonical_port(port)}", f"the sensor {name} at {port}")


@contextmanager
def _claim(name: str, device: str, description: str) -> Iterator[None]:
    """Claim the device for this process on Linux; raise Refused if another process has claimed it."""
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
                f"{description} is in use by another rig on this computer, {_describe_holder(address)}",
                "Let it finish, or end it with Ctrl-C where it runs",
            ) from error
        yield


def _describe_holder(address: str) -> str:
    """Return the process that holds the claim, in words, with its command line if this process may read it."""
    process = 0
    try:
        with socket.socket(socket.AF_UNIX) as question:
            question.settimeout(1.0)
            question.connect(address)
            process, *_ = CREDENTIALS.unpack(
                question.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, CREDENTIALS.size)
            )
        program, *arguments = Path(f"/proc/{process}/cmdline").read_text("utf-8", "replace").split("\0")[1:-1]
    except (OSError, ValueError):  # it has ended meanwhile, or belongs to another user
        return f"process {process}" if process != 0 else "whose process cannot be seen"
    return f"process {process}: {shorten(shlex.join([Path(program).name, *arguments]))}"


def _canonical_port(port: str) -> str:
    """Return the canonical name of a port, behind any links: its device, or its address."""
    parts = urlsplit(port)
    if parts.scheme == "socket" and parts.hostname is not None:
        return f"{_resolve_host(parts.hostname)}:{parts.port}"
    return os.path.realpath(port)


def _resolve_host(host: str) -> str:
    try:
        return socket.gethostbyname(host)
    except (OSError, UnicodeError):  # an unknown name; the connection reports it
        return host

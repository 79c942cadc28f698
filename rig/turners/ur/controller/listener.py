"""Which process of this machine listens at an address: a simulated controller has to share the machine's processors."""

import socket
from collections.abc import Iterator
from contextlib import suppress
from ipaddress import IPv4Address
from pathlib import Path

LISTENS = "0A"  # the state of a socket in the system's table
PROC = Path("/proc")


def address(host: str) -> IPv4Address | None:
    """The address of a host by its name; None where nobody knows one."""
    try:
        return IPv4Address(socket.gethostbyname(host))
    except OSError:
        return None


def is_here(host: str) -> bool:
    """Whether a host is this machine by a loopback address."""
    found = address(host)
    return found is not None and found.is_loopback


def listener(host: IPv4Address, port: int) -> int | None:
    """The process that listens at that address.

    None where proc(5) does not tell: on other systems than Linux, of another user's processes, in another container.
    """
    addresses = {f"{int.from_bytes(each.packed, 'little'):08X}:{port:04X}" for each in (host, IPv4Address(0))}
    with suppress(OSError):
        for row in (PROC / "net" / "tcp").read_text().splitlines()[1:]:
            _, address, _, state, _, _, _, _, _, inode, *_ = row.split()
            if state == LISTENS and address in addresses:
                return next(_holders(f"socket:[{inode}]"), None)
    return None


def _holders(file: str) -> Iterator[int]:
    for process in PROC.iterdir():
        if process.name.isdecimal():
            with suppress(OSError):  # it has ended, or is somebody else's
                if any(str(held.readlink()) == file for held in (process / "fd").iterdir() if held.is_symlink()):
                    yield int(process.name)

"""The search for the process of this machine that listens at an address, as a simulated controller does."""

import socket
from collections.abc import Iterator
from contextlib import suppress
from ipaddress import IPv4Address
from pathlib import Path

LISTENING_STATE = "0A"  # the state of a socket in the system's table
PROC = Path("/proc")


def resolve_address(host: str) -> IPv4Address | None:
    """Return the IPv4 address of a host name; None if it cannot be resolved."""
    try:
        return IPv4Address(socket.gethostbyname(host))
    except OSError:
        return None


def is_loopback(host: str) -> bool:
    """Return whether a host's address is a loopback address, so that the host is this machine."""
    ip = resolve_address(host)
    return ip is not None and ip.is_loopback


def find_listener(host: IPv4Address, port: int) -> int | None:
    """Return the id of the process that listens at this host and port.

    Return None if proc(5) does not show it: on systems other than Linux, for another user's process, or in a container.
    """
    addresses = {f"{int.from_bytes(ip.packed, 'little'):08X}:{port:04X}" for ip in (host, IPv4Address(0))}
    with suppress(OSError):
        for row in (PROC / "net" / "tcp").read_text().splitlines()[1:]:
            _, address, _, state, _, _, _, _, _, inode, *_ = row.split()
            if state == LISTENING_STATE and address in addresses:
                return next(_holders(f"socket:[{inode}]"), None)
    return None


def _holders(file: str) -> Iterator[int]:
    for process in PROC.iterdir():
        if process.name.isdecimal():
            with suppress(OSError):  # it has ended, or belongs to another user
                if any(str(link.readlink()) == file for link in (process / "fd").iterdir() if link.is_symlink()):
                    yield int(process.name)

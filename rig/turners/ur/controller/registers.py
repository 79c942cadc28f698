"""Which input registers of the controller are free for the client: the lower half of them or the upper.

The client speaks with its script over integers 0 to 7 and doubles 0 to 17, or over the same from 24 on. Who has asked
for one keeps it until he hangs up: fieldbuses take the lower half (EtherNet/IP all 24 of each kind), URCaps mostly some
of the upper. (RTDE guide of the maker: setting up an input recipe. `ur_rtde`: FLAG_UPPER_RANGE_REGISTERS, which its
version 1.6.5 passes over where the controller's software is 5.23 or newer: seen by what it asks for.)
"""

import socket
import struct
import time

from rig.errors import Problem
from rig.turners.ur.controller.rtde_packages import PORT, VERSION, package, packages

LOWER, UPPER = 0, 24  # the first register of each half
INTEGERS, DOUBLES = range(8), range(18)  # that the client takes, counted from there
NOBODYS = "no_such_register"  # a recipe with it is refused as a whole: to look at the others takes none of them
IN_USE = "IN_USE"
LOWER_ONLY_SINCE = (5, 23)  # of the controller's software
OWNERS = (
    "End the other client; disable EtherNet/IP, PROFINET and MODBUS in the installation (they take 0-23); remove "
    "URCaps that use RTDE, as those of grippers and force sensors do"
)


def free_half(host: str, version: tuple[int, ...], timeout_s: float) -> int | None:
    """Which half the client can have at the controller `host` with that software: `LOWER`, `UPPER`, or None.

    Nothing is taken by asking. Raises `OSError` when the controller does not answer within `timeout_s`.
    """
    with socket.create_connection((host, PORT), timeout_s) as connection:
        deadline_s, heard = time.monotonic() + timeout_s, bytearray()
        connection.sendall(package("V", struct.pack(">H", VERSION)))
        _answer(connection, "V", heard, deadline_s)
        for first in _halves(version):
            connection.sendall(package("I", ",".join([*names(first), NOBODYS]).encode()))
            answer = _answer(connection, "I", heard, deadline_s)
            if IN_USE not in answer[1:].decode(errors="replace").split(","):
                return first
    return None


def names(first: int) -> list[str]:
    """The registers that the client takes, of the half that begins with `first`."""
    integers = [f"input_int_register_{first + each}" for each in INTEGERS]
    return [*integers, *(f"input_double_register_{first + each}" for each in DOUBLES)]


def registers_in_use(host: str, version: tuple[int, ...]) -> Problem:
    """Nobody can drive the arm at `host`, with that software, by RTDE."""
    which = "of both halves, 0-23 and 24-47," if UPPER in _halves(version) else "0-23, of which the client needs some,"
    what = f"other clients, URCaps or a fieldbus use input registers {which} of the arm at {host}"
    return Problem("registers_in_use", what, OWNERS)


def _halves(version: tuple[int, ...]) -> tuple[int, ...]:
    """The halves that the client can be told to use."""
    return (LOWER,) if version >= LOWER_ONLY_SINCE else (LOWER, UPPER)


def _answer(connection: socket.socket, kind: str, heard: bytearray, deadline_s: float) -> bytes:
    """The payload of the next package of a kind; others are passed over."""
    while True:
        for found, payload in packages(heard):
            if found == kind:
                return payload
        if (left_s := deadline_s - time.monotonic()) <= 0.0:
            raise TimeoutError("it does not answer")
        connection.settimeout(left_s)
        data = connection.recv(65536)
        if not data:
            raise ConnectionError("it closed the connection")
        heard += data

"""The search for a half of the controller's input registers that is free for the client.

The client talks to its script through integers 0 to 7 and doubles 0 to 17, or the same numbers from 24 on. Every client
of RTDE keeps its registers until it disconnects. Fieldbuses take the lower half (EtherNet/IP all 24 of each kind),
URCaps usually some of the upper half. Sources: the maker's RTDE guide, on input recipes; `ur_rtde` 1.6.5, whose recipes
ignore FLAG_UPPER_RANGE_REGISTERS if the controller's software is 5.23 or newer.
"""

import socket
import struct
import time

from rig.errors import Problem
from rig.turners.ur.controller.rtde_packages import PORT, VERSION, package, packages

LOWER_FIRST, UPPER_FIRST = 0, 24  # the first register of each half
INTEGERS, DOUBLES = range(8), range(18)  # the client's registers, relative to the first
MISSING_REGISTER = "no_such_register"  # refuses the whole recipe, so that the query reserves no register
IN_USE_ANSWER = "IN_USE"
LOWER_ONLY_VERSION = (5, 23)  # of the controller's software
OWNERS = (
    "End the other client; disable EtherNet/IP, PROFINET and MODBUS in the installation (they take 0-23); remove "
    "URCaps that use RTDE, such as those of grippers and force sensors"
)


def find_free_half(host: str, version: tuple[int, ...], timeout_s: float) -> int | None:
    """Return the half of the registers that is free, `LOWER_FIRST` or `UPPER_FIRST`; None if neither half is free.

    `host`, `version`: the controller and its software. Nothing remains reserved. Raise `OSError` if no answer comes
    within `timeout_s`.
    """
    with socket.create_connection((host, PORT), timeout_s) as connection:
        deadline_s, received = time.monotonic() + timeout_s, bytearray()
        connection.sendall(package("V", struct.pack(">H", VERSION)))
        _await_answer(connection, "V", received, deadline_s)
        for first in usable_halves(version):
            connection.sendall(package("I", ",".join([*register_names(first), MISSING_REGISTER]).encode()))
            answer = _await_answer(connection, "I", received, deadline_s)
            if IN_USE_ANSWER not in answer[1:].decode(errors="replace").split(","):
                return first
    return None


def register_names(first: int) -> list[str]:
    """Return the names of the client's registers in the half that begins with `first`."""
    integers = [f"input_int_register_{first + offset}" for offset in INTEGERS]
    return [*integers, *(f"input_double_register_{first + offset}" for offset in DOUBLES)]


def registers_in_use(host: str, version: tuple[int, ...]) -> Problem:
    """Return the problem of an arm at `host` that cannot be driven by RTDE, because its registers are in use."""
    which = (
        "of both halves, 0-23 and 24-47,"
        if UPPER_FIRST in usable_halves(version)
        else "0-23, of which the client needs some,"
    )
    what = f"other clients, URCaps or a fieldbus use input registers {which} of the arm at {host}"
    return Problem("registers_in_use", what, OWNERS)


def usable_halves(version: tuple[int, ...]) -> tuple[int, ...]:
    """Return the halves of the registers, lower and upper, that a client can use with software `version`."""
    return (LOWER_FIRST,) if version >= LOWER_ONLY_VERSION else (LOWER_FIRST, UPPER_FIRST)


def _await_answer(connection: socket.socket, kind: str, received: bytearray, deadline_s: float) -> bytes:
    """Return the payload of the next package of a kind; skip packages of other kinds."""
    while True:
        for answer_kind, payload in packages(received):
            if answer_kind == kind:
                return payload
        if (remaining_s := deadline_s - time.monotonic()) <= 0.0:
            raise TimeoutError("it does not answer")
        connection.settimeout(remaining_s)
        data = connection.recv(65536)
        if not data:
            raise ConnectionError("it closed the connection")
        received += data

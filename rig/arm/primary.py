"""What the controller says of its arm's geometry: one package of the primary interface, port 30001. Receives only.

Every UR is measured in the factory, and its controller reckons with what was found. (Client interface description of
the maker for PolyScope 5: packages of a big-endian size, i32, a type, u8, and a payload; a robot state, type 16, holds
sub-packages of the same form, and of these KinematicsInfo, type 5, is sent once after connecting.)
"""

import math
import socket
import struct
import time
from collections.abc import Iterator

from rig.arm.kinematics import DenavitHartenberg

PORT = 30001
HEADER = struct.Struct(">iB")
ROBOT_STATE, KINEMATICS_INFO = 16, 5
KINEMATICS = struct.Struct(">6I 6d 6d 6d 6d I".replace(" ", ""))  # checksums; θ, a, d, α; how well it was calibrated
SIZE_MAX = 1 << 20  # a robot state has some 1500 bytes


def read_kinematics(host: str, timeout_s: float) -> DenavitHartenberg | None:
    """The geometry of the arm at `host`; None when it is not told within `timeout_s`. Raises `OSError`."""
    deadline_s, buffer = time.monotonic() + timeout_s, bytearray()
    with socket.create_connection((host, PORT), timeout_s) as connection:
        while (left_s := deadline_s - time.monotonic()) > 0:
            connection.settimeout(left_s)
            try:
                data = connection.recv(65536)
            except TimeoutError:
                break
            if not data:
                break
            buffer += data
            for kind, payload in _taken(buffer):
                if kind == ROBOT_STATE and (found := _kinematics(payload)) is not None:
                    return found
    return None


def _kinematics(state: bytes) -> DenavitHartenberg | None:
    """What a robot state says of it, if anything that can be."""
    for kind, payload in _taken(bytearray(state)):
        if kind == KINEMATICS_INFO and len(payload) >= KINEMATICS.size:
            values = KINEMATICS.unpack_from(payload)[6:30]
            if all(map(math.isfinite, values)):
                return DenavitHartenberg(values[:6], values[6:12], values[12:18], values[18:])
    return None


def _taken(buffer: bytearray) -> Iterator[tuple[int, bytes]]:
    """The whole packages at the beginning of the bytes, taken from them. Raises `ConnectionError` for other bytes."""
    while len(buffer) >= HEADER.size:
        size, kind = HEADER.unpack_from(buffer)
        if not HEADER.size <= size <= SIZE_MAX:
            raise ConnectionError("this is no primary interface")
        if len(buffer) < size:
            return
        payload = bytes(buffer[HEADER.size : size])
        del buffer[:size]
        yield kind, payload

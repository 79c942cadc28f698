"""The arm's states, every one of them: the reading half of RTDE, port 30004, protocol version 2.

The receive interface of `ur_rtde` keeps only the newest packet and does not say when one comes: who is held up for a
moment, by another thread or by a busy machine, loses states. Here they wait in the socket until they are read. Only
reading is done here; what drives the arm is `ur_rtde`. (Real-Time Data Exchange guide of the maker: packages of a
big-endian size, u16, a type, one letter, and a payload.)
"""

import select
import socket
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, zip_longest
from math import isfinite
from types import TracebackType
from typing import Self

from rig.motion.state import ArmState

PORT = 30004
VERSION = 2
HEADER = struct.Struct(">HB")
# Ten seconds at the fastest rate, if the system gives it. What does not fit waits at the controller, and nobody says
# how long that keeps it.
ROOM_BYTES = 1 << 20
# What is asked for, with the type it must have. Asking for nothing else keeps the packets small.
VARIABLES = {
    "timestamp": "DOUBLE",
    "actual_q": "VECTOR6D",
    "actual_qd": "VECTOR6D",
    "target_speed_fraction": "DOUBLE",
    "speed_scaling": "DOUBLE",
    "robot_mode": "INT32",
    "safety_mode": "INT32",
    "runtime_state": "UINT32",
    "robot_status_bits": "UINT32",
    "safety_status_bits": "UINT32",
    "payload": "DOUBLE",
    "payload_cog": "VECTOR3D",
}
CONTROLLER_VERSION = struct.Struct(">4I")  # major, minor, bugfix, build
PACKET = struct.Struct(">B d 6d 6d d d i i I I I d 3d".replace(" ", ""))  # the recipe's number, then these

# No arm turns so far or so fast, or has other modes: a UR3e's wrist 3 turns without end, and counts its turns.
ANGLE_RAD, SPEED_RAD_S, MODES = 1e3, 20.0, range(-1, 64)
# A joint of the fastest arm of this kind turns by 6.3 rad/s, and by 3.14 under the rig; three times that is none.
ENCODER_RAD, FASTEST_RAD_S = 0.03, 10.0


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet: the arm's state, and the payload the controller reckons with (kg; m from the flange)."""

    state: ArmState
    payload_kg: float
    payload_centre_m: tuple[float, float, float]


class NotSpoken(ConnectionError):
    """The controller answers, but does not know `what` is asked of it; `version` is its software's."""

    def __init__(self, what: str, version: tuple[int, ...]) -> None:
        super().__init__(f"it does not know {what}")
        self.what, self.version = what, version


class StateStream:
    """A connection over which the controller at `host` sends its state at `rate_hz` of its own time."""

    def __init__(self, host: str, rate_hz: float, timeout_s: float) -> None:
        """Connects and waits for the first packet.

        Raises `OSError` when none comes within `timeout_s`, `NotSpoken` when none can come.
        """
        self._deadline_s = time.monotonic() + timeout_s
        self._buffer = bytearray()
        self.closed = False  # by the controller
        self.version: tuple[int, ...] = ()  # of the controller's software: major, minor, bugfix, build
        self.silent_s = 0.0  # nothing has come for so long at least, however late it was looked for
        self._heard_s = time.monotonic()
        self._socket = socket.create_connection((host, PORT), timeout_s)
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM_BYTES)
            self._socket.setblocking(False)
            self._set_up(rate_hz)
            self._first = self._await_packet()
            self._last = self._first.state
        except BaseException:
            self._socket.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.close()

    @property
    def first(self) -> Packet:
        """The packet that came first; `read` returns those after it."""
        return self._first

    def read(self, timeout_s: float) -> list[Packet]:
        """The packets that have come, oldest first; waits for one for at most `timeout_s`. Empty once `closed`."""
        looked_s = time.monotonic()
        if self.closed:
            time.sleep(timeout_s)
            self.silent_s = looked_s - self._heard_s
            return []
        if select.select([self._socket], [], [], timeout_s)[0]:
            self._receive()
            self.silent_s, self._heard_s = 0.0, time.monotonic()
        else:  # what had come while nobody looked would be there
            self.silent_s = looked_s - self._heard_s
        try:
            packets = [_packet(payload) for kind, payload in self._packages() if kind == "U"]
            for packet in packets:
                _check_way(self._last, packet.state)
                self._last = packet.state
            return packets
        except ConnectionError:  # what is not readable is a link that is lost
            self.closed = True
            return []

    def _set_up(self, rate_hz: float) -> None:
        spoken = self._ask("V", struct.pack(">H", VERSION)) == b"\1"
        told = self._ask("v", b"")
        if len(told) != CONTROLLER_VERSION.size:
            raise ConnectionError("it does not tell its version")
        self.version = CONTROLLER_VERSION.unpack(told)
        if not spoken:
            raise NotSpoken(f"version {VERSION} of RTDE", self.version)
        answer = self._ask("O", struct.pack(">d", rate_hz) + ",".join(VARIABLES).encode())
        types = answer[1:].decode(errors="replace").split(",")
        wrong = [name for name, type_ in zip_longest(VARIABLES, types[: len(VARIABLES)]) if type_ != VARIABLES[name]]
        if wrong:
            raise NotSpoken(", ".join(wrong), self.version)
        if self._ask("S", b"") != b"\1":
            raise ConnectionError("it does not start to send")

    def _ask(self, kind: str, payload: bytes) -> bytes:
        """One question and its answer; messages in between are passed over."""
        self._socket.sendall(HEADER.pack(HEADER.size + len(payload), ord(kind)) + payload)
        while True:
            self._await_bytes()
            for answered, answer in self._packages():
                if answered == kind:
                    return answer

    def _await_packet(self) -> Packet:
        while True:
            for kind, payload in self._packages():
                if kind == "U":
                    return _packet(payload)
            self._await_bytes()

    def _await_bytes(self) -> None:
        left_s = self._deadline_s - time.monotonic()
        if left_s <= 0.0 or not select.select([self._socket], [], [], left_s)[0]:
            raise TimeoutError("it does not answer")
        self._receive()
        if self.closed:
            raise ConnectionError("it closed the connection")

    def _receive(self) -> None:
        try:
            data = self._socket.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        self.closed = not data
        self._buffer += data

    def _packages(self) -> Iterator[tuple[str, bytes]]:
        """The whole packages among the bytes that have come."""
        while len(self._buffer) >= HEADER.size:
            size, kind = HEADER.unpack_from(self._buffer)
            if size < HEADER.size:
                raise ConnectionError("this is no RTDE")  # nothing that follows can be trusted
            if len(self._buffer) < size:
                return
            payload = bytes(self._buffer[HEADER.size : size])
            del self._buffer[:size]
            yield chr(kind), payload


def _check_way(before: ArmState, after: ArmState) -> None:
    """Raises `ConnectionError` where a joint would have gone farther than any arm's joint can in that time."""
    allowed_rad = ENCODER_RAD + FASTEST_RAD_S * abs(after.time_s - before.time_s)
    if any(abs(q2 - q1) > allowed_rad for q1, q2 in zip(before.q_rad, after.q_rad, strict=True)):
        raise ConnectionError("no arm goes that far in that time")


def _packet(payload: bytes) -> Packet:
    """Raises `ConnectionError` for what no arm says: the bytes have come to harm on the way."""
    if len(payload) != PACKET.size:
        raise ConnectionError(f"a state of {len(payload)} bytes where {PACKET.size} belong")
    values = PACKET.unpack(payload)
    fraction, scaling, robot_mode, safety_mode, runtime_state, robot_bits, safety_bits, payload_kg = values[14:22]
    state = ArmState(
        time_s=values[1],
        host_time_s=time.monotonic(),
        q_rad=values[2:8],
        qd_rad_s=values[8:14],
        target_speed_fraction=fraction,
        speed_scaling=scaling,
        robot_mode=robot_mode,
        safety_mode=safety_mode,
        runtime_state=runtime_state,
        robot_status_bits=robot_bits,
        safety_status_bits=safety_bits,
    )
    damaged = (
        not all(map(isfinite, chain(values[1:16], values[21:25])))
        or max(map(abs, state.q_rad)) > ANGLE_RAD
        or max(map(abs, state.qd_rad_s)) > SPEED_RAD_S
        or not 0.0 <= fraction <= 1.0
        or not all(mode in MODES for mode in (robot_mode, safety_mode, runtime_state))
    )
    if damaged:
        raise ConnectionError("no arm is in such a state")
    return Packet(state, payload_kg, values[22:25])

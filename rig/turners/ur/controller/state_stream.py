"""The arm's states, every one of them: the reading half of RTDE, port 30004, protocol version 2.

The receive interface of `ur_rtde` keeps only the newest packet and does not say when one comes: who is held up for a
moment, by another thread or by a busy machine, loses states. Here they wait in the socket until they are read. Only
reading is done here; what drives the arm is `ur_rtde`. (Real-Time Data Exchange guide of the maker.)
"""

import math
import select
import socket
import struct
import time
from dataclasses import dataclass
from itertools import zip_longest
from types import TracebackType
from typing import Self

from rig.errors import Problem
from rig.motion.state import ArmState
from rig.turners.ur.controller.listener import is_here
from rig.turners.ur.controller.rtde_packages import PORT, VERSION, package, packages
from rig.turners.ur.controller.state_checks import clock_step, impossible_payload, impossible_state, impossible_way

# Ten seconds at the fastest rate, if the system gives it. What does not fit waits at the controller, and nobody says
# how long that keeps it.
ROOM_BYTES = 1 << 20
CLOCKS_DIFFER = 1.05  # a controller's clock against this computer's: far more than either is off
SILENT_S = 0.3  # a controller here that was silent for so long may have sent something to nobody
RECENT_S = 2.0  # states that a network held back come, or are missing, so soon after the gap that it made
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


class Disbelieved(ConnectionError):
    """A state that cannot be true, with the `problem` that it is."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.what)
        self.problem = problem


class StateStream:
    """A connection over which the controller at `host` sends its state at `rate_hz` of its own time."""

    def __init__(self, host: str, rate_hz: float, timeout_s: float) -> None:
        """Connects and waits for the first packet.

        Raises `OSError` when none comes within `timeout_s`, of it `NotSpoken` when none can come, and `Disbelieved`
        when no arm is in the state that the first one tells.
        """
        self._deadline_s = time.monotonic() + timeout_s
        self._buffer = bytearray()
        self._period_s = 1 / rate_hz
        self.closed = False  # by the controller, or nothing that follows can be believed
        self.problem: Problem | None = None  # what it has told that cannot be true
        self.version: tuple[int, ...] = ()  # of the controller's software: major, minor, bugfix, build
        self.silent_s = 0.0  # nothing has come for so long at least, however late it was looked for
        self._heard_s = time.monotonic()
        self._gap_s, self._gap_ended_s = 0.0, self._heard_s  # the longest silence of late, and its end
        self._elsewhere = not is_here(host)
        self._socket = socket.create_connection((host, PORT), timeout_s)
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, ROOM_BYTES)
            self._socket.setblocking(False)
            self._set_up(rate_hz)
            self._first = self._await_packet()
            if (problem := impossible_state(self._first.state)) is not None:
                raise Disbelieved(problem)
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
        """The packets that have come, oldest first; waits for one for at most `timeout_s`. Empty once `closed`.

        What cannot be true is left out, and is the stream's `problem` from then on. A state that no arm is in closes it
        too; after a clock that was set states go on, which still tell whether the arm stands.
        """
        looked_s = time.monotonic()
        if self.closed:
            time.sleep(timeout_s)
            self.silent_s = looked_s - self._heard_s
            return []
        if not select.select([self._socket], [], [], timeout_s)[0]:  # what had come while nobody looked would be there
            self.silent_s = looked_s - self._heard_s
            return []
        self._receive()
        now_s = time.monotonic()
        if self.silent_s >= self._gap_s or now_s - self._gap_ended_s > RECENT_S:
            self._gap_s, self._gap_ended_s = self.silent_s, now_s
        self.silent_s, self._heard_s = 0.0, now_s
        packets: list[Packet] = []
        try:
            for kind, payload in packages(self._buffer):
                if kind != "U":
                    continue
                packet = _packet(payload)
                step = self._checked(packet)
                self._last = packet.state
                if step is not None:
                    self.problem = self.problem or step
                    break  # those after it come with the next reading, when the problem is known
                packets.append(packet)
        except ConnectionError as error:  # what is not readable is a link that is lost
            self.closed = True
            if isinstance(error, Disbelieved):
                self.problem = self.problem or error.problem
        return packets

    def _checked(self, packet: Packet) -> Problem | None:
        """Whether the clock was set since the last state. Raises `Disbelieved` for a state that no arm is in."""
        before, after = self._last, packet.state
        impossible = impossible_state(after) or impossible_payload(packet.payload_kg, packet.payload_centre_m)
        step = None
        if impossible is None:
            step = clock_step(before.time_s, after.time_s, self._period_s, self._missed_s)
        if impossible is None and step is None:
            impossible = impossible_way(before, after)
        if impossible is not None:
            raise Disbelieved(impossible)
        return step

    @property
    def _missed_s(self) -> float:
        """Seconds of the controller's clock, at most, of which states may have been lost in the silences of late.

        One here has a pace of its own, and between its states and this process lies nothing that could lose some.
        """
        if self._elsewhere:
            return CLOCKS_DIFFER * self._gap_s
        return 0.0 if self._gap_s < SILENT_S else math.inf

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
        self._socket.sendall(package(kind, payload))
        while True:
            self._await_bytes()
            for answered, answer in packages(self._buffer):
                if answered == kind:
                    return answer

    def _await_packet(self) -> Packet:
        while True:
            for kind, payload in packages(self._buffer):
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


def _packet(payload: bytes) -> Packet:
    """Raises `ConnectionError` for another number of bytes: some have got lost on the way."""
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
    return Packet(state, payload_kg, values[22:25])

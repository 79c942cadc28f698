"""The complete stream of the arm's states: the receiving half of RTDE, port 30004, protocol version 2.

The receive interface of `ur_rtde` keeps only the newest packet and does not signal its arrival, so a delayed reader
loses states. In this stream the states wait in the socket until they are read. This module only receives; `ur_rtde`
drives the arm. Source: the maker's Real-Time Data Exchange guide.
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
from rig.motion.turner_state import ArmState
from rig.turners.ur.controller.listener import is_loopback
from rig.turners.ur.controller.rtde_packages import PORT, VERSION, package, packages
from rig.turners.ur.controller.state_checks import clock_step, impossible_motion, impossible_payload, impossible_state

# The buffer holds ten seconds at the highest rate, if the system grants it. Further states wait at the controller, for
# an undocumented time.
BUFFER_BYTES = 1 << 20
MAX_CLOCK_RATIO = 1.05  # of the controller's time to this computer's: far more than their errors
MIN_SILENCE_S = 0.3  # after which a controller on this computer may have sent states without a receiver
LOSS_PROOF_S = 2.0  # time after the gap within which states delayed or lost by a network show
# The requested variables and their types. Nothing else is requested, which keeps the packets small.
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
class StatePacket:
    """One packet: the arm's state, and the payload that the controller uses (kg; m from the flange)."""

    state: ArmState
    payload_kg: float
    payload_centre_m: tuple[float, float, float]


class NotSupported(ConnectionError):
    """The error of a controller that answers but does not support `what`; `version` is its software's version."""

    def __init__(self, what: str, version: tuple[int, ...]) -> None:
        super().__init__(f"it does not know {what}")
        self.what, self.version = what, version


class ImpossibleState(ConnectionError):
    """An impossible state, with its `problem`."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.what)
        self.problem = problem


class StateStream:
    """A connection over which the controller at `host` sends its state at `rate_hz` of its own time."""

    def __init__(self, host: str, rate_hz: float, timeout_s: float) -> None:
        """Connect and wait for the first packet.

        Raise `OSError` if none comes within `timeout_s`: `NotSupported` if none can come, `ImpossibleState` for a first
        state that is impossible.
        """
        self._deadline_s = time.monotonic() + timeout_s
        self._buffer = bytearray()
        self._period_s = 1 / rate_hz
        self.closed = False  # closed by the controller, or after an impossible state
        self.problem: Problem | None = None  # the first impossible item that it sent
        self.version: tuple[int, ...] = ()  # the controller's software: major, minor, bugfix, build
        self.silent_s = 0.0  # least time without data, excluding delays of this reader
        self._received_s = time.monotonic()
        self._gap_s, self._gap_ended_s = 0.0, self._received_s  # the longest recent silence, and its end
        self._is_remote = not is_loopback(host)
        self._socket = socket.create_connection((host, PORT), timeout_s)
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
            self._socket.setblocking(False)
            self._set_up(rate_hz)
            self._first = self._await_packet()
            if (problem := impossible_state(self._first.state)) is not None:
                raise ImpossibleState(problem)
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
    def first(self) -> StatePacket:
        """The first packet; `read` returns the following ones."""
        return self._first

    def read(self, timeout_s: float) -> list[StatePacket]:
        """Return the packets received, oldest first; wait at most `timeout_s` for the first one.

        After the stream is `closed`, there are none. A packet with an impossible state or time is omitted and becomes
        the stream's `problem`. An impossible state also closes the stream; after a step of the clock the states
        continue, because they still show whether the arm is at rest.
        """
        looked_s = time.monotonic()
        if self.closed:
            time.sleep(timeout_s)
            self.silent_s = looked_s - self._received_s
            return []
        if not select.select([self._socket], [], [], timeout_s)[0]:  # data that came meanwhile would be there
            self.silent_s = looked_s - self._received_s
            return []
        self._receive()
        now_s = time.monotonic()
        if self.silent_s >= self._gap_s or now_s - self._gap_ended_s > LOSS_PROOF_S:
            self._gap_s, self._gap_ended_s = self.silent_s, now_s
        self.silent_s, self._received_s = 0.0, now_s
        packets: list[StatePacket] = []
        try:
            for kind, payload in packages(self._buffer):
                if kind != "U":
                    continue
                packet = _decode_packet(payload)
                step = self._check(packet)
                self._last = packet.state
                if step is not None:
                    self.problem = self.problem or step
                    break  # the next call returns the rest, with the problem known
                packets.append(packet)
        except ConnectionError as error:  # unreadable bytes count as a lost link
            self.closed = True
            if isinstance(error, ImpossibleState):
                self.problem = self.problem or error.problem
        return packets

    def _check(self, packet: StatePacket) -> Problem | None:
        """Return a problem if the clock was set since the last state. Raise `ImpossibleState` for a wrong state."""
        before, after = self._last, packet.state
        impossible = impossible_state(after) or impossible_payload(packet.payload_kg, packet.payload_centre_m)
        step = None
        if impossible is None:
            step = clock_step(before.time_s, after.time_s, self._period_s, self._missed_s)
        if impossible is None and step is None:
            impossible = impossible_motion(before, after)
        if impossible is not None:
            raise ImpossibleState(impossible)
        return step

    @property
    def _missed_s(self) -> float:
        """The longest time, s of the controller's clock, for which states may have been lost in recent silences.

        A local connection loses no states unless it was silent for `MIN_SILENCE_S`; then any number may be lost.
        """
        if self._is_remote:
            return MAX_CLOCK_RATIO * self._gap_s
        return 0.0 if self._gap_s < MIN_SILENCE_S else math.inf

    def _set_up(self, rate_hz: float) -> None:
        """Agree with the controller on protocol version, variables and rate, and start the stream."""
        is_supported = self._ask("V", struct.pack(">H", VERSION)) == b"\1"
        version = self._ask("v", b"")
        if len(version) != CONTROLLER_VERSION.size:
            raise ConnectionError("it does not report its version")
        self.version = CONTROLLER_VERSION.unpack(version)
        if not is_supported:
            raise NotSupported(f"version {VERSION} of RTDE", self.version)
        answer = self._ask("O", struct.pack(">d", rate_hz) + ",".join(VARIABLES).encode())
        types = answer[1:].decode(errors="replace").split(",")
        wrong = [name for name, type_ in zip_longest(VARIABLES, types[: len(VARIABLES)]) if type_ != VARIABLES[name]]
        if wrong:
            raise NotSupported(", ".join(wrong), self.version)
        if self._ask("S", b"") != b"\1":
            raise ConnectionError("it does not start to send")

    def _ask(self, kind: str, payload: bytes) -> bytes:
        """Send a request and return its answer; skip messages that come before the answer."""
        self._socket.sendall(package(kind, payload))
        while True:
            self._await_bytes()
            for answer_kind, answer in packages(self._buffer):
                if answer_kind == kind:
                    return answer

    def _await_packet(self) -> StatePacket:
        while True:
            for kind, payload in packages(self._buffer):
                if kind == "U":
                    return _decode_packet(payload)
            self._await_bytes()

    def _await_bytes(self) -> None:
        remaining_s = self._deadline_s - time.monotonic()
        if remaining_s <= 0.0 or not select.select([self._socket], [], [], remaining_s)[0]:
            raise TimeoutError("it does not answer")
        self._receive()
        if self.closed:
            raise ConnectionError("it closed the connection")

    def _receive(self) -> None:
        """Add arrived bytes to the buffer, without waiting; note a closed connection."""
        try:
            data = self._socket.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        self.closed = not data
        self._buffer += data


def _decode_packet(payload: bytes) -> StatePacket:
    """Return a packet's content. Raise `ConnectionError` for a wrong number of bytes, because some were lost."""
    if len(payload) != PACKET.size:
        raise ConnectionError(f"a state of {len(payload)} bytes instead of {PACKET.size}")
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
    return StatePacket(state, payload_kg, values[22:25])

"""The lag of a client: the bytes sent to it that it has not read.

This lag paces the world's clock, as a wire paces a sender. The client is not asked: if both ends are on one Linux
machine, the system knows how many bytes wait in the other end's socket (sock_diag(7)). Otherwise all bytes count as
read.
"""

import itertools
import socket
import struct
from collections.abc import Callable

# All in wall time. A client gains patience while it keeps pace; one that never does delays the others only at first.
FIRST_PATIENCE_S, PATIENCE_S = 0.1, 5.0
PATIENCE_GAIN = 0.5  # per time in pace
MAX_PACED_WAIT_S = 0.05  # a shorter wait costs no patience: the client works, though slowly
POLL_LIMITS_S = (0.0001, 0.001)  # of the time between two checks of a lagging client: a quarter of its delay

Unread = Callable[[], int]

_REQUEST = struct.Struct("=IHHIIBBBBI")  # struct nlmsghdr and the start of struct inet_diag_req_v2
_SOCKET_ID = struct.Struct(">HH4s12x4s12x")  # struct inet_diag_sockid without interface and cookie
_ANY = struct.pack("=III", 0, 0xFFFFFFFF, 0xFFFFFFFF)
_SOCK_DIAG_BY_FAMILY, _NLM_F_REQUEST, _ALL_STATES = 20, 1, 0xFFFFFFFF
_NETLINK_SOCK_DIAG = 4
# Offsets in the answer: nlmsghdr.nlmsg_type and .nlmsg_seq, inet_diag_msg.idiag_rqueue.
_TYPE_AT, _NUMBER_AT, _UNREAD_AT = 4, 8, 16 + 4 + 48 + 4


class SocketTable:
    """The system's socket table, which is queried for the other ends of connections."""

    def __init__(self) -> None:
        self._netlink: socket.socket | None = None
        self._numbers = itertools.count(1)
        if hasattr(socket, "AF_NETLINK"):
            try:
                self._netlink = socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, _NETLINK_SOCK_DIAG)
                self._netlink.setblocking(False)  # the answer is ready when `send` returns
            except OSError:
                self._netlink = None

    def count_unread(self, connection: socket.socket) -> Unread:
        """Return a function that counts the bytes that the other end of `connection` has not read; 0 if unknown."""
        netlink = self._netlink
        if netlink is None:
            return lambda: 0
        try:
            (far_host, far_port), (near_host, near_port) = connection.getpeername(), connection.getsockname()
        except OSError:  # it has hung up already
            return lambda: 0
        sockets = _SOCKET_ID.pack(far_port, near_port, socket.inet_aton(far_host), socket.inet_aton(near_host)) + _ANY
        number = next(self._numbers) & 0xFFFFFFFF  # distinguishes a late answer to another request
        request = (
            _REQUEST.pack(
                *(_REQUEST.size + len(sockets), _SOCK_DIAG_BY_FAMILY, _NLM_F_REQUEST, number, 0),
                *(socket.AF_INET, socket.IPPROTO_TCP, 0, 0, _ALL_STATES),
            )
            + sockets
        )

        def ask() -> int:
            try:
                netlink.send(request)
                answer = netlink.recv(1024)
                while struct.unpack_from("=I", answer, _NUMBER_AT)[0] != number:
                    answer = netlink.recv(1024)
            except OSError:
                return 0
            is_answer = struct.unpack_from("=H", answer, _TYPE_AT)[0] == _SOCK_DIAG_BY_FAMILY
            return int(struct.unpack_from("=I", answer, _UNREAD_AT)[0]) if is_answer else 0

        return ask

    def close(self) -> None:
        if self._netlink is not None:
            self._netlink.close()


class Wire:
    """The pace of one client, which may lag `lag_s` of virtual time before the world waits for it.

    The world waits for a client that reads as fast as it can, even if it is slow. For a client that does not read, the
    world waits only until its patience with this client ends, and not again before the client has kept pace. All other
    clients wait meanwhile, so a longer wait would let them regard the world as dead.
    """

    def __init__(self, count_unread: Unread, lag_s: float, wall: Callable[[], float]) -> None:
        self._count_unread, self._lag_s, self._wall = count_unread, lag_s, wall
        self._behind_since_s: float | None = None  # virtual time of the first packet that may be unread
        self._waiting_since_s: float | None = None  # start of the wait; wall time, like all times below
        self._unread_bytes = 0  # number at the last check
        self._slept = False  # whether it has not read for a while since it was last in pace
        self._patience_s = FIRST_PATIENCE_S
        self._in_pace = True
        self._settled_s = wall()
        self._send_s, self._send_time_s = 0.0, 0.0  # wall time and virtual time of the last packet

    def record_send(self, time_s: float) -> None:
        """Record that something was sent at the virtual time `time_s`."""
        self._send_s, self._send_time_s = self._wall(), time_s
        if self._behind_since_s is None:
            self._behind_since_s = time_s

    def wait_s(self, time_s: float) -> float:
        """Return the wall time until the next check, s; 0 if the bytes of the virtual time `time_s` may be sent."""
        if self._behind_since_s is None or time_s - self._behind_since_s <= self._lag_s:
            return 0.0
        now_s = self._wall()
        unread = self._count_unread()
        if unread < self._unread_bytes or not unread:
            self._take(now_s)
        self._unread_bytes = unread
        if not unread:
            self._settle(now_s)
            return 0.0
        if self._waiting_since_s is None:
            self._waiting_since_s = now_s
        waited_s = now_s - self._waiting_since_s
        if waited_s >= max(self._patience_s, MAX_PACED_WAIT_S if self._in_pace else 0.0):
            return 0.0
        due_s = self._send_s + time_s - self._send_time_s - now_s
        return max(0.0, min(due_s, max(POLL_LIMITS_S[0], waited_s / 4), POLL_LIMITS_S[1]))

    def _take(self, now_s: float) -> None:
        """Record that the client has read; if it had not read for a while, reduce the patience with this client."""
        waited_s = 0.0 if self._waiting_since_s is None else now_s - self._waiting_since_s
        if waited_s > MAX_PACED_WAIT_S:
            self._slept = True
            self._patience_s = max(0.0, self._patience_s - waited_s)
        self._waiting_since_s = now_s

    def _settle(self, now_s: float) -> None:
        """Record that the client has caught up."""
        self._in_pace, self._slept = not self._slept, False
        if self._in_pace:
            self._patience_s = min(self._patience_s + PATIENCE_GAIN * (now_s - self._settled_s), PATIENCE_S)
        self._settled_s, self._behind_since_s, self._waiting_since_s = now_s, None, None

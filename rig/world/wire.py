"""How far a client is behind: what it was sent and has not taken.

The world's clock is paced by this, as a sender is by a wire. Nothing is asked of the client: where both ends are on one
Linux machine, the system knows how many bytes wait in the other end's socket (sock_diag(7)). Elsewhere they count as
taken.
"""

import itertools
import socket
import struct
from collections.abc import Callable

# Wall time, all of it. Patience is earned by keeping pace: a client that never does costs the others only the first.
FIRST_PATIENCE_S, PATIENCE_S = 0.1, 5.0
EARNED = 0.5  # of the time in which a client keeps pace, in patience
IN_PACE_S = 0.05  # a wait no longer than this costs no patience: it is how fast the client works, not that it sleeps
LOOK_S = (0.0001, 0.001)  # time between two looks at a client that is waited for: a quarter of its delay, within these

Unread = Callable[[], int]

_REQUEST = struct.Struct("=IHHIIBBBBI")  # struct nlmsghdr and the start of struct inet_diag_req_v2
_SOCKET_ID = struct.Struct(">HH4s12x4s12x")  # struct inet_diag_sockid without interface and cookie
_ANY = struct.pack("=III", 0, 0xFFFFFFFF, 0xFFFFFFFF)
_SOCK_DIAG_BY_FAMILY, _NLM_F_REQUEST, _ALL_STATES = 20, 1, 0xFFFFFFFF
_NETLINK_SOCK_DIAG = 4
# In the answer: nlmsghdr.nlmsg_type and .nlmsg_seq, inet_diag_msg.idiag_rqueue.
_TYPE_AT, _NUMBER_AT, _UNREAD_AT = 4, 8, 16 + 4 + 48 + 4


class SocketTable:
    """Asks the system about the other ends of connections."""

    def __init__(self) -> None:
        self._netlink: socket.socket | None = None
        self._numbers = itertools.count(1)
        if hasattr(socket, "AF_NETLINK"):
            try:
                self._netlink = socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, _NETLINK_SOCK_DIAG)
                self._netlink.setblocking(False)  # the answer is there when `send` returns
            except OSError:
                self._netlink = None

    def unread(self, connection: socket.socket) -> Unread:
        """A function that says how many bytes sent over `connection` its other end has not read, as far as known."""
        netlink = self._netlink
        if netlink is None:
            return lambda: 0
        try:
            (far_host, far_port), (near_host, near_port) = connection.getpeername(), connection.getsockname()
        except OSError:  # it has hung up already
            return lambda: 0
        sockets = _SOCKET_ID.pack(far_port, near_port, socket.inet_aton(far_host), socket.inet_aton(near_host)) + _ANY
        number = next(self._numbers) & 0xFFFFFFFF  # so that nobody takes another's late answer for his own
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
            known = struct.unpack_from("=H", answer, _TYPE_AT)[0] == _SOCK_DIAG_BY_FAMILY
            return int(struct.unpack_from("=I", answer, _UNREAD_AT)[0]) if known else 0

        return ask

    def close(self) -> None:
        if self._netlink is not None:
            self._netlink.close()


class Wire:
    """One client's pace: it may be `lag_s` of the world's time behind before the world waits for it.

    Waiting is to go on as a real laboratory would, 1 s in 1 s: what others are sent comes no slower than from that, or
    they would take the world for one that has gone. A client that takes what it is sent as fast as it can is waited for
    however slow that is, one that lets it lie only as long as its patience lasts, and then no more until it has kept
    pace again.
    """

    def __init__(self, unread: Unread, lag_s: float, wall: Callable[[], float]) -> None:
        self._unread, self._lag_s, self._wall = unread, lag_s, wall
        self._behind_since_s: float | None = None  # the world's time of the first packet that is not known to be taken
        self._waiting_since_s: float | None = None  # for it to take something; wall time, as everything below
        self._left = 0  # bytes that it had not taken at the last look
        self._slept = False  # it let them lie since it was in pace
        self._patience_s = FIRST_PATIENCE_S
        self._in_pace = True
        self._settled_s = wall()
        self._sent_s, self._sent_time_s = 0.0, 0.0  # of the last packet, and the world's time then

    def sent(self, time_s: float) -> None:
        """Something was sent at `time_s` of the world."""
        self._sent_s, self._sent_time_s = self._wall(), time_s
        if self._behind_since_s is None:
            self._behind_since_s = time_s

    def wait_s(self, time_s: float) -> float:
        """Wall time until the next look; 0 when what came about at `time_s` of the world may be sent."""
        if self._behind_since_s is None or time_s - self._behind_since_s <= self._lag_s:
            return 0.0
        now_s = self._wall()
        unread = self._unread()
        if unread < self._left or not unread:
            self._take(now_s)
        self._left = unread
        if not unread:
            self._settle(now_s)
            return 0.0
        if self._waiting_since_s is None:
            self._waiting_since_s = now_s
        waited_s = now_s - self._waiting_since_s
        if waited_s >= max(self._patience_s, IN_PACE_S if self._in_pace else 0.0):
            return 0.0
        due_s = self._sent_s + time_s - self._sent_time_s - now_s
        return max(0.0, min(due_s, max(LOOK_S[0], waited_s / 4), LOOK_S[1]))

    def _take(self, now_s: float) -> None:
        """The client has taken something, and paid with patience if it slept before."""
        waited_s = 0.0 if self._waiting_since_s is None else now_s - self._waiting_since_s
        if waited_s > IN_PACE_S:
            self._slept = True
            self._patience_s = max(0.0, self._patience_s - waited_s)
        self._waiting_since_s = now_s

    def _settle(self, now_s: float) -> None:
        """The client has caught up."""
        self._in_pace, self._slept = not self._slept, False
        if self._in_pace:
            self._patience_s = min(self._patience_s + EARNED * (now_s - self._settled_s), PATIENCE_S)
        self._settled_s, self._behind_since_s, self._waiting_since_s = now_s, None, None

"""How far a client is behind: what it was sent and has not taken, and how much time it needs before the next packet.

The world's clock is paced by this, as a sender is by a wire that carries one packet at a time. Nothing is asked of the
client: where both ends are on one Linux machine, the system knows how many bytes wait in the other end's socket
(sock_diag(7)). Elsewhere they count as taken.
"""

import itertools
import socket
import struct
from collections.abc import Callable

# So long a client is waited for; until it has caught up it then gets its packets as fast as from a real controller.
# One that often lets the world wait longer than the least is waited for less: a real controller would not wait at all.
LEAST_PATIENCE_S, PATIENCE_S = 0.3, 0.7
REGAINED = 0.1  # of the time that passes, in patience
# A client that keeps only the newest packet must look at one before the next comes, so it is given some time after it
# has taken one: so many times as long as it took of late, which grows with the load of the machine.
LATENESS = 2.0
LEAST_S = 0.0004  # … and at least this
LATEST_S = 0.01  # a client that once was later than this is not given more for it
FORGETTING = 0.99  # of how late a client was, at every packet
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
    """One client's pace: `look` at it often, and send the next packet when `wait_s` is 0.

    The wire is free while at most `allowance` bytes are unread.
    """

    def __init__(self, unread: Unread, allowance: int, wall: Callable[[], float]) -> None:
        self._unread, self._allowance, self._wall = unread, allowance, wall
        self._sent_s: float | None = None  # when the first packet went that is not known to be taken
        self._seen_unread = False
        self._taken_s = wall()
        self._late_s = 0.0
        self._newest_s = 0.0  # when the last packet went
        self._patience_s = PATIENCE_S

    def sent(self) -> None:
        """Something was sent."""
        self._newest_s = self._wall()
        if self._sent_s is None:
            self._sent_s, self._seen_unread = self._newest_s, False

    def look(self) -> None:
        """See whether the client has taken what was sent."""
        if self._sent_s is None:
            return
        if self._unread() > self._allowance:
            self._seen_unread = True
            return
        now_s = self._wall()
        # What is gone at the first look may have been for long: then it was this process that was late.
        late_s = (now_s - self._sent_s) * self._seen_unread
        self._late_s = max(min(late_s, LATEST_S), self._late_s * FORGETTING)
        spent_s = max(0.0, min(late_s, self._patience_s) - LEAST_PATIENCE_S)
        regained_s = REGAINED * (now_s - self._taken_s)
        self._patience_s = min(self._patience_s - spent_s + regained_s, PATIENCE_S)
        self._taken_s, self._sent_s = now_s, None

    def wait_s(self, interval_s: float, *, overlooks: bool) -> float:
        """Wall time until the next look; 0 when the next packet may go.

        `interval_s` is the virtual time since the last one, which is what a real controller gives a client. One that
        `overlooks` a packet when the next comes at once has time to look at it.
        """
        now_s = self._wall()
        if self._sent_s is None:
            time_s = min(max(self._late_s * LATENESS, LEAST_S), interval_s) if overlooks else 0.0
            return max(0.0, self._taken_s + time_s - now_s)
        delay_s = now_s - self._sent_s
        if delay_s > self._patience_s:
            return max(0.0, self._newest_s + interval_s - now_s)
        return min(max(LOOK_S[0], delay_s / 4), LOOK_S[1])

"""What a client has said reaches the controller, however soon it hangs up."""

import socket

from rig.world.network import Network
from support.laboratories.worlds import fresh_host

PROGRAM = b"def nudge():\nend\n"


class Told:
    """A session that sends at every tick and keeps what it hears."""

    closing = False
    dialogue = False

    def __init__(self) -> None:
        self.heard, self.ended = b"", False

    def greeting(self) -> bytes:
        return b"hello"

    def receive(self, data: bytes) -> bytes:
        self.heard += data
        return b"heard"

    def tick(self) -> bytes:
        return b"state"

    def handle_close(self) -> None:
        self.ended = True


def test_a_client_that_hangs_up_at_once_is_still_heard() -> None:
    """It reads nothing, so that its end arrives as a reset: the next send fails before anything was received."""
    session, network, host = Told(), Network(lambda: None), fresh_host()
    try:
        network.listen(host, 30002, lambda: session)
        with socket.create_connection((host, 30002)) as client:
            network.poll(1.0)
            client.sendall(PROGRAM)
        for _ in range(3):
            network.tick()
            network.deliver()
        while not session.ended:
            network.poll(1.0)
            network.tick()
            network.deliver()
        assert session.heard == PROGRAM
        assert network.connections == []
    finally:
        network.close()

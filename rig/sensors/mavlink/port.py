"""Bytes to and from an autopilot: over a serial port, a TCP connection, or datagrams that it sends to this computer."""

import socket
import time
from contextlib import suppress

from firmware_host.serial_port import READ_TIMEOUT_S, SerialPort
from rig.sensors.own_port import Port

DATAGRAM_BYTES = 65536


def open_port(port: str, baud: int) -> Port:
    """The port at `tcp:host:port`, `udp:host:port`, or a serial port's name. Raises OSError."""
    kind, _, address = port.partition(":")
    if kind == "udp":
        host, _, number = address.rpartition(":")
        return UdpPort(host, int(number))
    return SerialPort(f"socket://{address}" if kind == "tcp" else port, baud)


class UdpPort:
    """Datagrams that come to an address of this computer; answers go to who sent the first one."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._peer: tuple[str, int] | None = None
        try:
            self._socket.bind((host, port))
            self._socket.setblocking(False)
        except OSError:
            self._socket.close()
            raise

    def read(self) -> bytes:
        """What came within `READ_TIMEOUT_S`, from one sender."""
        time.sleep(READ_TIMEOUT_S)
        found = bytearray()
        with suppress(BlockingIOError, ConnectionRefusedError):
            while True:
                data, sender = self._socket.recvfrom(DATAGRAM_BYTES)
                self._peer = self._peer or sender
                if sender == self._peer:
                    found += data
        return bytes(found)

    def write(self, data: bytes) -> None:
        """Send, once somebody has sent something."""
        if self._peer is not None:
            with suppress(BlockingIOError, ConnectionRefusedError):  # nobody listens just now: silence says so
                self._socket.sendto(data, self._peer)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

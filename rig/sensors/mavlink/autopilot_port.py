"""The port to an autopilot: a serial port, a TCP connection, or datagrams from the autopilot to this computer."""

import socket
import time
from contextlib import suppress

from firmware_host.serial_port import READ_TIMEOUT_S, SerialPort
from rig.sensors.own_port import DevicePort

DATAGRAM_BYTES = 65536


def open_port(port: str, baud: int) -> DevicePort:
    """Return the open port at `tcp:host:port`, `udp:host:port`, or a serial port by its name. Raise OSError."""
    kind, _, address = port.partition(":")
    if kind == "udp":
        host, _, number = address.rpartition(":")
        return UdpPort(host, int(number))
    return SerialPort(f"socket://{address}" if kind == "tcp" else port, baud)


class UdpPort:
    """A port of datagrams to an address of this computer; answers go to the sender of the first datagram."""

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
        """Return the data received within `READ_TIMEOUT_S`; datagrams of other senders are ignored."""
        time.sleep(READ_TIMEOUT_S)
        received = bytearray()
        with suppress(BlockingIOError, ConnectionRefusedError):
            while True:
                data, sender = self._socket.recvfrom(DATAGRAM_BYTES)
                self._peer = self._peer or sender
                if sender == self._peer:
                    received += data
        return bytes(received)

    def write(self, data: bytes) -> None:
        """Send data, or drop it as long as no autopilot has sent anything, because its address is unknown."""
        if self._peer is not None:
            with suppress(BlockingIOError, ConnectionRefusedError):  # no receiver at present: it shows as silence
                self._socket.sendto(data, self._peer)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

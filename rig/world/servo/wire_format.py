"""Packets of protocol 2.0, byte by byte, as the servo sees them.

Source: ROBOTIS e-Manual, "DYNAMIXEL Protocol 2.0" (packets, stuffing, errors) and "CRC calculation": polynomial 0x8005,
initial value 0, not reflected. Written from the manual, apart from the maker's client, which it must satisfy.
"""

from collections.abc import Iterator
from typing import NamedTuple

HEADER = b"\xff\xff\xfd"
STUFFED = HEADER + b"\xfd"
BROADCAST = 0xFE
LONGEST = 1024  # length field of the longest packet that is believed
GAP_S = 0.1  # between two bytes of one packet; what began before is given up (not in the manual)

PING, READ, WRITE, REG_WRITE, ACTION, REBOOT, CLEAR, STATUS = 0x01, 0x02, 0x03, 0x04, 0x05, 0x08, 0x10, 0x55
SYNC_READ, SYNC_WRITE = 0x82, 0x83

RESULT_FAIL, INSTRUCTION_ERROR, CRC_ERROR, RANGE_ERROR, LENGTH_ERROR, LIMIT_ERROR, ACCESS_ERROR = range(1, 8)
ALERT = 0x80


def _crc_of(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = crc << 1 ^ (0x8005 if crc & 0x8000 else 0)
    return crc & 0xFFFF


_CRC = [_crc_of(byte) for byte in range(256)]


def crc16(data: bytes) -> int:
    """The checksum of everything before it in a packet."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRC[crc >> 8 ^ byte]
    return crc


def encode(servo_id: int, instruction: int, parameters: bytes = b"") -> bytes:
    """One packet, stuffed."""
    body = (bytes([instruction]) + parameters).replace(HEADER, STUFFED)
    packet = HEADER + b"\0" + bytes([servo_id]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc16(packet).to_bytes(2, "little")


def encode_status(servo_id: int, error: int, parameters: bytes = b"") -> bytes:
    """A servo's answer."""
    return encode(servo_id, STATUS, bytes([error]) + parameters)


class Packet(NamedTuple):
    """A packet as it came; `whole` is whether its checksum is right."""

    servo_id: int
    instruction: int
    parameters: bytes
    whole: bool


class Receiver:
    """A servo's ear: it finds packets in whatever comes."""

    def __init__(self) -> None:
        self._heard = bytearray()
        self._heard_s = 0.0

    def hear(self, data: bytes, time_s: float) -> Iterator[Packet]:
        """The packets that end in `data`, which came at `time_s`."""
        if time_s - self._heard_s > GAP_S:
            self._heard.clear()
        self._heard_s = time_s
        self._heard += data
        while (packet := self._next()) is not None:
            yield packet

    def _next(self) -> Packet | None:
        heard = self._heard
        while True:
            start = heard.find(HEADER)
            if start < 0:
                del heard[: max(0, len(heard) - 2)]
                return None
            del heard[:start]
            if len(heard) < 7:
                return None
            length = int.from_bytes(heard[5:7], "little")
            if heard[3] != 0 or not 3 <= length <= LONGEST:
                del heard[:3]  # no packet begins here
                continue
            if len(heard) < 7 + length:
                return None
            packet, self._heard = bytes(heard[: 7 + length]), heard[7 + length :]
            body = packet[7:-2].replace(STUFFED, HEADER)
            whole = crc16(packet[:-2]) == int.from_bytes(packet[-2:], "little")
            return Packet(packet[4], body[0], body[1:], whole)

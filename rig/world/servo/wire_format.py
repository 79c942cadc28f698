"""Packets of protocol 2.0, byte by byte, from the servo's side.

Source: ROBOTIS e-Manual, "DYNAMIXEL Protocol 2.0" (packets, stuffing, errors) and "CRC calculation": polynomial 0x8005,
initial value 0, not reflected. Written from the manual, independently of the maker's client, which it must satisfy.
"""

from collections.abc import Iterator
from typing import NamedTuple

HEADER = b"\xff\xff\xfd"
STUFFED_HEADER = HEADER + b"\xfd"
BROADCAST = 0xFE
MAX_LENGTH = 1024  # length field of the longest packet that is accepted
GAP_S = 0.1  # time between two bytes of a packet, after which the partial packet is dropped (not in the manual)

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
    """Return the checksum of `data`, all bytes of a packet that precede the checksum."""
    crc = 0
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _CRC[crc >> 8 ^ byte]
    return crc


def encode(servo_id: int, instruction: int, parameters: bytes = b"") -> bytes:
    """Return an instruction packet with stuffed parameters."""
    body = (bytes([instruction]) + parameters).replace(HEADER, STUFFED_HEADER)
    packet = HEADER + b"\0" + bytes([servo_id]) + (len(body) + 2).to_bytes(2, "little") + body
    return packet + crc16(packet).to_bytes(2, "little")


def encode_status(servo_id: int, error: int, parameters: bytes = b"") -> bytes:
    """Return a status packet, a servo's answer."""
    return encode(servo_id, STATUS, bytes([error]) + parameters)


class ServoPacket(NamedTuple):
    """A received packet; `is_valid`: whether its checksum is correct."""

    servo_id: int
    instruction: int
    parameters: bytes
    is_valid: bool


class Receiver:
    """A servo's receiver, which finds packets in a stream of bytes."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._received_s = 0.0

    def receive(self, data: bytes, time_s: float) -> Iterator[ServoPacket]:
        """Yield the packets that are complete with `data`, which arrived at `time_s`."""
        if time_s - self._received_s > GAP_S:
            self._buffer.clear()
        self._received_s = time_s
        self._buffer += data
        while (packet := self._next()) is not None:
            yield packet

    def _next(self) -> ServoPacket | None:
        """Drop the first complete packet and all bytes before it from the buffer; return the packet, or None."""
        buffer = self._buffer
        while True:
            start = buffer.find(HEADER)
            if start < 0:
                del buffer[: max(0, len(buffer) - 2)]
                return None
            del buffer[:start]
            if len(buffer) < 7:
                return None
            length = int.from_bytes(buffer[5:7], "little")
            if buffer[3] != 0 or not 3 <= length <= MAX_LENGTH:
                del buffer[:3]  # no packet begins here
                continue
            if len(buffer) < 7 + length:
                return None
            packet, self._buffer = bytes(buffer[: 7 + length]), buffer[7 + length :]
            body = packet[7:-2].replace(STUFFED_HEADER, HEADER)
            is_valid = crc16(packet[:-2]) == int.from_bytes(packet[-2:], "little")
            return ServoPacket(packet[4], body[0], body[1:], is_valid)

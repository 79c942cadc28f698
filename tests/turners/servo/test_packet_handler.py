"""Replies of a servo, as the rig takes them from the line."""

import os
import pty
import threading
import tty

import pytest
from dynamixel_sdk.protocol2_packet_handler import Protocol2PacketHandler

from rig.turners.servo.packet_handler import Bus, ReplyLost
from rig.turners.servo.servo_registers import MODEL_NUMBER

READ_BYTES = 14  # of an instruction to read


class Line:
    """A pseudo-terminal whose far end answers every read with the given status packet."""

    def __init__(self, data: bytes) -> None:
        self._far, self._near = pty.openpty()
        tty.setraw(self._near)
        self.path = os.ttyname(self._near)
        packet = bytes([0xFF, 0xFF, 0xFD, 0, 1, 4 + len(data), 0, 0x55, 0, *data])
        crc = Protocol2PacketHandler().updateCRC(0, list(packet), len(packet))
        self._thread = threading.Thread(target=self._answer, args=(packet + crc.to_bytes(2, "little"),))
        self._thread.start()

    def _answer(self, packet: bytes) -> None:
        asked = 0
        while asked < READ_BYTES:
            asked += len(os.read(self._far, READ_BYTES))
        os.write(self._far, packet)

    def close(self) -> None:
        self._thread.join()
        os.close(self._far)
        os.close(self._near)


def read_model(data: bytes) -> int:
    line = Line(data)
    bus = Bus(line.path, 57600, 1)
    try:
        return bus.read(MODEL_NUMBER)[0]
    finally:
        bus.close()
        line.close()


def test_a_reply_of_the_register_s_size_is_its_value() -> None:
    assert read_model((1060).to_bytes(2, "little")) == 1060


@pytest.mark.parametrize("data", [b"", bytes(10)], ids=["acknowledgement of a write", "state"])
def test_a_late_reply_to_another_instruction_is_not_taken_for_the_value(data: bytes) -> None:
    """The checksum of a late acknowledgement is 3233, which no servo has for a model number."""
    with pytest.raises(ReplyLost):
        read_model(data)

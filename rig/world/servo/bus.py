"""The bus: servos on one line, what they send at the same time, and the converter between them and the host."""

from collections.abc import Callable, Sequence
from math import ceil

import numpy as np

from rig.world.servo.servo import Servo
from rig.world.servo.truth import LineTruth
from rig.world.servo.wire_format import BROADCAST, PING, SYNC_READ, Packet, Receiver

BITS = 10  # of a byte on the wire: start, eight, stop
HELD_UP_S = 0.02  # far longer than it takes to come round
PING_SLOT_S = 0.003  # between two answers to a ping of everybody, times the ID; the maker's client waits so long


class Bus:
    """The far end of a serial line (a `Device` of `rig.world.board.serial_line`); `now` is the world's clock.

    Answers that overlap on the wire pull each other low: the host reads their bytes' AND. `lose` is how many of the
    next answers are lost on their way, `spoil` how many arrive damaged.
    """

    def __init__(self, servos: Sequence[Servo], line: LineTruth, now: Callable[[], float], seed: int = 0) -> None:
        self.servos, self.line = servos, line
        self.lose = self.spoil = 0
        self._now = now
        self._receiver = Receiver()
        self._lived_s = now()
        self._random = np.random.default_rng(seed)
        self._under_way: list[tuple[float, bytes]] = []  # when the host gets it, and what

    @property
    def baud_rate(self) -> float | None:
        """The baud rate of the first servo with power."""
        return next((baud for servo in self.servos if (baud := servo.baud_rate) is not None), None)

    def receive(self, data: bytes) -> None:
        """Bytes of the host's that end now."""
        now_s = self._now()
        if self.line.echo:
            self._send(now_s, data)
        for packet in self._receiver.hear(data, now_s):
            self.advance()
            self._answer(packet, now_s)

    def advance(self) -> None:
        """Let every servo live until now.

        Where this process was held up, what the host sent meanwhile has not been heard yet: no watchdog counts that.
        """
        now_s = self._now()
        held_up_s, self._lived_s = now_s - self._lived_s, now_s
        for servo in self.servos:
            if held_up_s > HELD_UP_S:
                servo.hear_later(held_up_s)
            servo.advance(now_s)

    def due_s(self) -> float:
        """The time at which the host is to get something; infinity when nothing is under way."""
        return min((due_s for due_s, _ in self._under_way), default=float("inf"))

    def transmitted(self) -> bytes:
        """What has reached the host since it was asked last."""
        now_s = self._now()
        arrived = b"".join(data for due_s, data in self._under_way if due_s <= now_s)
        self._under_way = [each for each in self._under_way if each[0] > now_s]
        return arrived

    def _answer(self, packet: Packet, time_s: float) -> None:
        byte_s = BITS / (self.baud_rate or 1e6)
        answers: list[tuple[int, bytes]] = []  # the byte's place on the wire, from now, at which each begins
        free = 0  # … after the answers to a sync read before it
        for servo in sorted(self.servos, key=lambda each: each.memory["ID"]):
            answer = servo.obey(packet, time_s)
            if answer is None:
                continue
            wait_s = servo.return_delay_s()
            if packet.servo_id == BROADCAST and packet.instruction == PING:
                wait_s += PING_SLOT_S * servo.memory["ID"]
            if len(self.servos) > 1:  # no two clocks are alike
                wait_s += byte_s * self._random.uniform(0.0, 2.0)
            begins = round(wait_s / byte_s) + (free if packet.instruction == SYNC_READ else 0)
            answers.append((begins, answer))
            free = begins + len(answer)
        if not answers:
            return
        wire: dict[int, int] = {}
        for begins, answer in answers:
            for place, byte in enumerate(answer, begins):
                wire[place] = wire.get(place, 0xFF) & byte
        self._send(time_s + max(wire) * byte_s + 1e-3 * self.line.reply_delay_ms, bytes(wire[p] for p in sorted(wire)))

    def _send(self, time_s: float, data: bytes) -> None:
        if self.lose > 0:
            self.lose -= 1
            return
        if self.spoil > 0 and len(data) > 9:
            self.spoil -= 1
            data = data[:9] + bytes([data[9] ^ 0x10]) + data[10:]
        lump_s = 1e-3 * self.line.latency_ms
        self._under_way.append((ceil(time_s / lump_s) * lump_s if lump_s else time_s, data))

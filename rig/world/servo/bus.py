"""The bus: servos on one line, collisions of their answers, and the converter between them and the host."""

from collections.abc import Callable
from math import ceil

import numpy as np

from rig.world.servo.servo import SimulatedServo
from rig.world.servo.truth import LineTruth
from rig.world.servo.wire_format import BROADCAST, PING, SYNC_READ, Receiver, ServoPacket

BITS_PER_BYTE = 10  # on the wire: start, eight data, stop
STALL_S = 0.02  # far longer than one cycle of the world's loop
PING_SLOT_S = 0.003  # delay per ID of the answers to a broadcast ping, as the maker's client expects it


class SimulatedBus:
    """The far end of a serial line (a `Device` of `rig.world.board.serial_line`); `now` is the servos' clock.

    Answers that overlap on the wire pull each other low: the host reads the AND of their bytes. `lose` is the number of
    next answers to lose, `spoil` the number to corrupt.
    """

    def __init__(self, servos: list[SimulatedServo], line: LineTruth, now: Callable[[], float], seed: int = 0) -> None:
        self.servos, self.line = servos, line
        self.lose = self.spoil = 0
        self._now = now
        self._receiver = Receiver()
        self._advanced_s = now()
        self._random = np.random.default_rng(seed)
        self._pending: list[tuple[float, bytes]] = []  # arrival at the host, s, and data

    @property
    def baud_rate(self) -> float | None:
        """The baud rate of the first servo with power."""
        return next((baud for servo in self.servos if (baud := servo.baud_rate) is not None), None)

    def receive(self, data: bytes) -> None:
        """Receive bytes from the host; the transmission of the last one ends now."""
        now_s = self._now()
        if self.line.echo:
            self._send(now_s, data)
        for packet in self._receiver.receive(data, now_s):
            self.advance()
            self._answer(packet, now_s)

    def advance(self) -> None:
        """Simulate every servo until now. Time in which this process was suspended does not count for the watchdogs."""
        now_s = self._now()
        stalled_s, self._advanced_s = now_s - self._advanced_s, now_s
        for servo in self.servos:
            if stalled_s > STALL_S:
                servo.extend_watchdog(stalled_s)
            servo.advance(now_s)

    def due_s(self) -> float:
        """Return the time at which the next bytes reach the host, s; infinity if none are pending."""
        return min((due_s for due_s, _ in self._pending), default=float("inf"))

    def take_sent(self) -> bytes:
        """Return the bytes that have reached the host since the last call."""
        now_s = self._now()
        arrived = b"".join(data for due_s, data in self._pending if due_s <= now_s)
        self._pending = [(due_s, data) for due_s, data in self._pending if due_s > now_s]
        return arrived

    def _answer(self, packet: ServoPacket, time_s: float) -> None:
        """Queue the answers of all servos to the packet; bytes that coincide on the wire are combined by AND."""
        byte_s = BITS_PER_BYTE / (self.baud_rate or 1e6)
        answers: list[tuple[int, bytes]] = []  # the first byte's slot on the wire, counted from now, and the bytes
        free = 0  # the first free slot after the earlier answers to a sync read
        for servo in sorted(self.servos, key=lambda servo: servo.memory["ID"]):
            answer = servo.obey(packet, time_s)
            if answer is None:
                continue
            wait_s = servo.return_delay_s()
            if packet.servo_id == BROADCAST and packet.instruction == PING:
                wait_s += PING_SLOT_S * servo.memory["ID"]
            if len(self.servos) > 1:  # no two clocks run alike
                wait_s += byte_s * self._random.uniform(0.0, 2.0)
            first_slot = round(wait_s / byte_s) + (free if packet.instruction == SYNC_READ else 0)
            answers.append((first_slot, answer))
            free = first_slot + len(answer)
        if not answers:
            return
        wire: dict[int, int] = {}
        for first_slot, answer in answers:
            for slot, byte in enumerate(answer, first_slot):
                wire[slot] = wire.get(slot, 0xFF) & byte
        end_s = time_s + max(wire) * byte_s + 1e-3 * self.line.reply_delay_ms
        self._send(end_s, bytes(wire[slot] for slot in sorted(wire)))

    def _send(self, time_s: float, data: bytes) -> None:
        """Queue an answer for the host at the converter's next transfer; lose or corrupt it on request."""
        if self.lose > 0:
            self.lose -= 1
            return
        if self.spoil > 0 and len(data) > 9:
            self.spoil -= 1
            data = data[:9] + bytes([data[9] ^ 0x10]) + data[10:]
        lump_s = 1e-3 * self.line.latency_ms
        self._pending.append((ceil(time_s / lump_s) * lump_s if lump_s else time_s, data))

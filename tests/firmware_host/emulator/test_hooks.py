"""The machine code that saves time changes nothing: the same in plain Python gives the same bytes at the same times."""

import ctypes
from collections.abc import Callable, Sequence

import pytest
from unicorn import UC_HOOK_BLOCK

from firmware_host.emulator.engine import Engine, QuickAccess
from firmware_host.emulator.hooks import BlockTicks
from firmware_host.emulator.timeline import Timeline
from firmware_host.frames import encode
from support.board.emulated_session import PARTS, RANGE_G, Session, samples

COUNT, STATUS, DATA = (0x24, 4), (0x1_3008, 4), (0x1_300C, 2)  # offset and size of an access
POLL_TICKS, POLLS = 40, 3  # reads of the counter closer together than this, more than so many in a row, are a wait
RXNE, TXE, BSY = 1 << 0, 1 << 1, 1 << 7

Hook = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint32)


class PlainEngine(Engine):
    """Everything in Python, block by block and access by access."""

    blocks = 0
    reads = 0

    def meter(self, timeline: Timeline, ticks: BlockTicks, measure: Callable[[int, int], int | None]) -> None:
        def on_block(_handle: int, address: int, size: int) -> None:
            try:
                PlainEngine.blocks += 1
                may_run = timeline.now < timeline.deadline or timeline.go_on()
                taken = measure(address, size) if may_run else None
                if taken is None:
                    self.paused = True
                    self.stop()
                else:
                    timeline.now += taken
            except BaseException as error:
                self._fail(error)

        self._hook(UC_HOOK_BLOCK, Hook(on_block))

    def map_io(
        self,
        address: int,
        size: int,
        read: Callable[[int, int], int],
        write: Callable[[int, int, int], None],
        quick: QuickAccess | None = None,
    ) -> None:
        if quick is None:
            super().map_io(address, size, read, write)
            return
        registers = PlainRegisters(quick)

        def plain_read(offset: int, width: int) -> int:
            if (offset, width) == COUNT and quick.counter.clocked:
                PlainEngine.reads += 1
                return registers.count()
            if (offset, width) == STATUS and quick.bus.clocked:
                return registers.status()
            if (offset, width) == DATA and quick.bus.clocked:
                return registers.take()
            return read(offset, width)

        def plain_write(offset: int, width: int, value: int) -> None:
            if (offset, width) == DATA and quick.bus.clocked and quick.bus.speaks:
                registers.put(value)
            else:
                write(offset, width, value)

        super().map_io(address, size, plain_read, plain_write)


class PlainRegisters:
    """Counter and bus, with a queue of its own for what is on the bus."""

    def __init__(self, quick: QuickAccess) -> None:
        self._quick = quick
        self._received: list[tuple[int, int]] = []  # tick at which both bytes are in, the bytes
        self._read_at = self._polls = 0
        self._polled = False

    def count(self) -> int:
        timeline, counter = self._quick.timeline, self._quick.counter
        self._polls = self._polls + 1 if timeline.now - self._read_at < POLL_TICKS else 0
        if self._polls > POLLS and counter.counts:
            next_count = (timeline.now - counter.since) * counter.counts // counter.ticks + 1
            wait_until(timeline, counter.since - -next_count * counter.ticks // counter.counts)
        self._read_at = timeline.now
        counts = (timeline.now - counter.since) * counter.counts // counter.ticks
        return (counter.counted + counts) % counter.modulus

    def status(self) -> int:
        timeline, bus = self._quick.timeline, self._quick.bus
        awaited = self._received[0][0] if self._received else bus.free
        if awaited > timeline.now:
            if self._polled:
                wait_until(timeline, awaited)
            self._polled = True
        received = bool(self._received) and self._received[0][0] <= timeline.now
        room = bus.free - timeline.now <= bus.pair_ticks
        return BSY * (bus.free > timeline.now) | RXNE * received | TXE * room

    def put(self, pair: int) -> None:
        timeline, bus = self._quick.timeline, self._quick.bus
        self._polled = False
        answer = self._quick.exchange(pair)
        bus.free = max(timeline.now, bus.free) + bus.pair_ticks
        self._received.append((bus.free - bus.half_bit_ticks, answer))

    def take(self) -> int:
        self._polled = False
        ready, answer = self._received.pop(0)
        assert ready <= self._quick.timeline.now
        return answer


def wait_until(timeline: Timeline, tick: int) -> None:
    timeline.now = max(timeline.now, min(tick, timeline.deadline))


def bytes_by_tick(parts: Sequence[str], duration_s: float) -> list[bytes]:
    """What a board with these parts sends in each tick, all of them streaming with accelerations."""
    session = Session(parts=parts)
    session.run(0.2)
    for part in parts:
        session.configure(part, range_g=RANGE_G)
    session.board.receive(encode("start", 78, {"sensors": 0}))
    sent = [bytes(session.sent)]
    frames = []
    for _tick in range(round(duration_s / 0.002)):
        before = len(session.sent)
        frames.extend(session.run(0.002))
        sent.append(bytes(session.sent[before:]))
    counts = [len(samples(frames, sensor)) for sensor in range(len(parts))]
    assert min(counts) > 10, counts
    return sent


@pytest.mark.slow
def test_machine_code_gives_the_bytes_of_plain_python(monkeypatch: pytest.MonkeyPatch) -> None:
    quick = bytes_by_tick(list(PARTS), 0.2)
    monkeypatch.setattr("firmware_host.emulator.machine.Engine", PlainEngine)
    plain = bytes_by_tick(list(PARTS), 0.2)
    assert PlainEngine.blocks > 50_000
    assert PlainEngine.reads > 5_000
    assert quick == plain


def test_blocks_outside_the_table_are_asked_for_each_time() -> None:
    ticks = BlockTicks(0x0800_0000, 16)
    for address in (0x0800_0000, 0x0800_000E, 0x0800_0010, 0x2000_0000, 0x07FF_FFFE):
        ticks[address] = 3
    assert [ticks[address] for address in (0x0800_0000, 0x0800_000E)] == [3, 3]
    assert [ticks[address] for address in (0x0800_0010, 0x2000_0000, 0x07FF_FFFE)] == [0, 0, 0]
    ticks.clear()
    assert ticks[0x0800_0000] == 0

"""Damage to messages in transit, and a guard around their readers."""

import signal
import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from random import Random

HANG_S = 20  # wall time, far longer than a reader may wait for the rest
NASTY = (b"\0", b"\xff", b"\n", b"\r", b"\x1b[2J", b"%s%n", b"\xed\xa0\x80", b"(" * 300, b"9" * 400, b"1e999", b"-nan")


def damage_message(random: Random, messages: Sequence[bytes]) -> bytes:
    """Return one of the messages after one to four faults, different from all of them."""
    before = random.choice(messages)
    while True:
        bad = bytearray(before)
        for _ in range(random.choice((1, 1, 2, 4))):
            random.choice(FAULTS)(random, bad, messages)
        if bad and bytes(bad) != before:
            return bytes(bad)


Fault = Callable[[Random, bytearray, Sequence[bytes]], None]


def _run(random: Random, bad: bytearray) -> slice:
    begin = random.randrange(len(bad) + 1)
    return slice(begin, min(len(bad), begin + 1 + int(random.expovariate(0.1))))


def _flip(random: Random, bad: bytearray, messages: Sequence[bytes]) -> None:
    for _ in range(random.choice((1, 1, 2, 8))):
        if bad:
            bad[random.randrange(len(bad))] ^= 1 << random.randrange(8)


def _cut(random: Random, bad: bytearray, messages: Sequence[bytes]) -> None:
    del bad[random.randrange(len(bad) + 1) :]


def _lose(random: Random, bad: bytearray, messages: Sequence[bytes]) -> None:
    del bad[_run(random, bad)]


def _double(random: Random, bad: bytearray, messages: Sequence[bytes]) -> None:
    run = _run(random, bad)
    bad[run] = bad[run] * random.choice((2, 2, 3, 50))


def _overwrite(random: Random, bad: bytearray, messages: Sequence[bytes]) -> None:
    run = _run(random, bad)
    bad[run] = random.randbytes(run.stop - run.start)


def _insert(random: Random, bad: bytearray, messages: Sequence[bytes]) -> None:
    begin = random.randrange(len(bad) + 1)
    bad[begin:begin] = random.choice((*NASTY, random.randbytes(1 + random.randrange(20))))


def _splice(random: Random, bad: bytearray, messages: Sequence[bytes]) -> None:
    """Continue with another message from a random byte on."""
    other = random.choice(messages)
    bad[random.randrange(len(bad) + 1) :] = other[random.randrange(len(other) + 1) :]


def _swap(random: Random, bad: bytearray, messages: Sequence[bytes]) -> None:
    split = random.randrange(len(bad) + 1)
    bad[:] = bad[split:] + bad[:split]


def _mislead(random: Random, bad: bytearray, messages: Sequence[bytes]) -> None:
    """Replace the size."""
    wrong = random.choice((0, 1, 2, 3, 5, len(bad) + 1, 2 * len(bad), 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF))
    bad[:4] = struct.pack(">I", wrong) if random.random() < 0.5 else struct.pack(">H", wrong & 0xFFFF) + bad[2:4]


FAULTS: tuple[Fault, ...] = (_flip, _flip, _cut, _lose, _double, _overwrite, _insert, _splice, _swap, _mislead)


@contextmanager
def ending_by_name(bad: bytes) -> Iterator[None]:
    """Attach to an exception raised here the bytes that caused it; raise AssertionError if the block does not end."""

    def hung(*_: object) -> None:
        raise AssertionError("it hangs")

    signal.signal(signal.SIGALRM, hung)
    signal.alarm(HANG_S)
    try:
        yield
    except BaseException as error:
        error.add_note(f"after {bad.hex()}")
        raise
    finally:
        signal.alarm(0)

"""The host's speed of decoding a KVH 1775's messages: `python benchmarks/wire/kvh1775_decoding.py [megabytes]`.

The stream is read in pieces of 64 KB, like a recording, and of 4 KB. Fails under 20 MB/s; a line at 4147200 Bd delivers
0.4 MB/s.
"""

import sys
import time
from pathlib import Path

import numpy as np

from rig.sensors.kvh1775.kvh_messages import MESSAGE_BYTES, Format, MessageReader, encode
from rig.sensors.kvh1775.message_numbering import MessageCounter

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

LIMIT_MB_S = 20.0
READS = (65536, 4096)
FORMATS: tuple[Format, ...] = ("A", "B", "C")
ROUNDS = 3


def sent(name: Format, megabytes: float) -> bytes:
    """Return `megabytes` of a stream at 1000 Hz in the format `name`."""
    numbers = np.arange(round(megabytes * 1e6 / MESSAGE_BYTES[name]))
    vectors = np.random.default_rng(1).normal(size=(2, len(numbers), 3))
    return encode(
        name,
        rotation=vectors[0],
        acceleration_g=vectors[1],
        sequence=numbers % 128,
        time_us=numbers * 1000 % 2**32,
    )


def measure(name: Format, stream: bytes, size: int) -> float:
    """Return the megabytes decoded and counted per second of processor time, the best of some rounds."""
    best_s = float("inf")
    for _ in range(ROUNDS):
        reader, counter = MessageReader(), MessageCounter("kvh", 1000.0, timed=name == "B")
        began_s = time.process_time()
        for offset in range(0, len(stream), size):
            counter.count(reader.feed(stream[offset : offset + size]).messages)
        best_s = min(best_s, time.process_time() - began_s)
    return len(stream) / best_s * 1e-6


def main(megabytes: float) -> int:
    slowest_mb_s = float("inf")
    slow = []
    for name in FORMATS:
        stream = sent(name, megabytes)
        for size in READS:
            mb_s = measure(name, stream, size)
            print(f"format {name}, {size:6} bytes a read: {mb_s:6.1f} MB/s")
            slowest_mb_s = min(slowest_mb_s, mb_s)
            if mb_s < LIMIT_MB_S:
                slow.append(f"format {name} in reads of {size}")
    record("decode a KVH 1775", slowest_mb_s, "MB/s")
    if slow:
        print(f"under {LIMIT_MB_S:g} MB/s: {', '.join(slow)}")
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 8.0))

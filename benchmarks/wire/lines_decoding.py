"""The host's speed of decoding lines of text: `python benchmarks/wire/lines_decoding.py [megabytes]`.

Compared with the obvious loop, `readline().split()`: from a serial port by pyserial, as it would be used, and from
memory. Fails under 5 MB/s, and if the loop on a port is more than a fifth as fast.
"""

import io
import os
import sys
import threading
import time
import tty
from pathlib import Path

import numpy as np
import serial

from rig.config.sensors.lines_section import LinesSection
from rig.sensors.lines.decoding import LineReader
from rig.sensors.lines.stamping import Stamper

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

LIMIT_MB_S, LIMIT_RATIO = 5.0, 5.0
READS = (65536, 4096)
PORT_FRACTION = 50  # the stream over the part of it that goes through a port for the loop
SECTION = LinesSection.model_validate(
    {
        "columns": ["time", "gx", "gy", "gz", "ax", "ay", "az"],
        "time": {"unit": "us"},
        "rate": {"unit": "deg/s"},
        "acceleration": {"unit": "g"},
        "temperature": {"stated_c": 22},
    }
)


def make_stream(megabytes: float) -> bytes:
    """Return `megabytes` of a stream at 1000 Hz."""
    rows = np.random.default_rng(1).normal(0, 50, (round(megabytes * 1e6 / 56), 6))
    form = "%d,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f\r\n"
    return b"0\n" + "".join(form % (1000 * number, *row) for number, row in enumerate(rows)).encode()


def measure_decoding(stream: bytes, size: int) -> float:
    """Return the megabytes decoded, numbered and timed per second of processor time."""
    reader, stamper = LineReader(SECTION), Stamper(SECTION, 1000.0, "sensors.imu")
    began_s = time.process_time()
    for offset in range(0, len(stream), size):
        stamper.stamp(reader.feed(stream[offset : offset + size]).values, 0, 0.0)
    return len(stream) / (time.process_time() - began_s) * 1e-6


def measure_split(source: io.RawIOBase | io.BytesIO | serial.Serial, size: int) -> float:
    """Return the megabytes per second of the thread's processor time by the plain loop, for `size` bytes."""
    read, began_s = 0, time.thread_time()
    while read < size:
        line = source.readline()
        read += len(line)
        [float(word) for word in line.split(b",")]
    return read / (time.thread_time() - began_s) * 1e-6


def measure_split_at_port(stream: bytes) -> float:
    """Return the megabytes per second of the plain loop at a pseudo-terminal that is filled as fast as it is read."""
    master, slave = os.openpty()
    tty.setraw(slave)

    def fill() -> None:
        for offset in range(0, len(stream), 2000):
            os.write(master, stream[offset : offset + 2000])

    filling = threading.Thread(target=fill, daemon=True)
    with serial.Serial(os.ttyname(slave), 921600) as port:
        filling.start()  # not before: bytes received before it opens are discarded
        speed_mb_s = measure_split(port, len(stream))
    filling.join()
    os.close(slave)
    os.close(master)
    return speed_mb_s


def main(megabytes: float) -> int:
    stream = make_stream(megabytes)
    fast = {size: measure_decoding(stream, size) for size in READS}
    for size, mb_s in fast.items():
        print(f"rig, {size:6} bytes a read:            {mb_s:6.1f} MB/s")
    port_mb_s = measure_split_at_port(stream[: len(stream) // PORT_FRACTION].rpartition(b"\n")[0] + b"\n")
    print(f"readline().split() at a port:       {port_mb_s:6.2f} MB/s")
    print(f"readline().split() from memory:     {measure_split(io.BytesIO(stream), len(stream)):6.1f} MB/s")
    slowest = min(fast.values())
    record("decode lines", slowest, "MB/s", peer="readline() at a port", peer_value=port_mb_s)
    if slowest < LIMIT_MB_S or slowest < LIMIT_RATIO * port_mb_s:
        print(f"under {LIMIT_MB_S:g} MB/s, or under {LIMIT_RATIO:g} times the loop at a port")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 8.0))

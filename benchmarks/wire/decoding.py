"""The host's speed of decoding the board's stream: `python benchmarks/wire/decoding.py [megabytes]`.

The emulated board's stream is decoded to batches of samples, on this machine and as on one where package `cobs` could
not compile its fast part. For comparison: a decoder that takes one byte after the other, and pymavlink on as many
RAW_IMU messages as there are samples. The board's few seconds are sent repeatedly, each time to a new reader; fails if
a sample is missing, and under 20 MB/s.
"""

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest.mock import patch
from zlib import crc32

from pymavlink.dialects.v20 import common as mavlink

from firmware_host import frames as codec
from firmware_host import stuffing
from firmware_host.answers import sample_batches
from firmware_host.frames import Frame, FrameReader
from firmware_host.protocol import MESSAGES, SAMPLES

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names
from support.board.emulated_session import Session

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

STREAMS = {
    "three sensors": {"lsm9ds1": 238.0, "mpu9250": 200.0, "adis16465": 200.0},
    "one at 952 Hz": {"lsm9ds1": 952.0},
}
LIMIT_MB_S = 20.0
CHUNK = 4096  # largest size of a read from the port
RECORDED_S = 4.0
ROUNDS = 3
SLOW_FRACTION = 0.05  # of the stream is enough for the other decoders

_SAMPLES = next(message for message in MESSAGES if message.name == "samples")
_CRC_OF_BYTE = [crc32(bytes((value,)), 0xFFFF_FFFF) ^ 0xFFFF_FFFF for value in range(256)]


def record_stream(rates_hz: dict[str, float]) -> bytes:
    """Return the bytes that the board sends while these parts stream."""
    session = Session(parts=list(rates_hz))
    session.run(0.2)
    for part, rate_hz in rates_hz.items():
        session.configure(part, rate_hz)
    session.ask("start", sensors=0)
    before = len(session.sent)
    session.run(RECORDED_S)
    return bytes(session.sent[before:])


def read(once: bytes) -> Iterator[list[Frame]]:
    """Yield the frames that a new reader finds in each chunk from the port."""
    reader = FrameReader()
    return (reader.feed(once[i : i + CHUNK]) for i in range(0, len(once), CHUNK))


def frames(once: bytes) -> int:
    """Return the number of samples in the stream's frames, decoded by a FrameReader."""
    return sum(len(frame.items) for frames in read(once) for frame in frames if frame.name in SAMPLES)


def batches(once: bytes) -> int:
    """Return the number of samples in batches, made of the frames of each chunk."""
    streamed = ([frame for frame in frames if frame.name in SAMPLES] for frames in read(once))
    return sum(len(batch.samples) for frames in streamed for batch in sample_batches(frames, 0.0))


def batches_without_compiler(once: bytes) -> int:
    """Return the number of samples in batches, decoded in plain Python."""
    with patch.object(codec, "unstuff", stuffing.unstuff_in_python):
        return batches(once)


def byte_loop(once: bytes) -> int:
    """Return the number of samples, decoded as on a small controller: COBS and CRC by the byte, then the integers."""
    samples, body, remaining, crc = 0, bytearray(), -1, 0xFFFF_FFFF
    for byte in once:
        if byte == 0:
            if crc == 0xDEBB_20E3 and body[0] == _SAMPLES.code:
                samples += len(_counts(body))
            body, remaining, crc = bytearray(), -1, 0xFFFF_FFFF
            continue
        if remaining > 0:
            value = byte
            remaining -= 1
        else:
            first, remaining = remaining < 0, byte - 1
            if first:
                continue
            value = 0
        body.append(value)
        crc = crc >> 8 ^ _CRC_OF_BYTE[(crc ^ value) & 0xFF]
    return samples


def _counts(body: bytearray) -> list[list[int]]:
    """Return x, y, z and temperature, in counts, of every sample in a decoded `samples` frame."""
    items = range(2 + _SAMPLES.head.size, len(body) - 4, _SAMPLES.item_dtype.itemsize)
    return [[body[offset + k] | body[offset + k + 1] << 8 for k in range(4, 12, 2)] for offset in items]


def make_mavlink_stream(samples: int) -> bytes:
    """Return `samples` RAW_IMU messages."""
    sender = mavlink.MAVLink(None)
    messages = (
        mavlink.MAVLink_raw_imu_message(4202 * k, 0, 0, 0, k % 400, -k % 400, 7, 0, 0, 0) for k in range(samples)
    )
    return b"".join(message.pack(sender) for message in messages)


def pymavlink(once: bytes) -> int:
    """Return the number of messages in the stream, decoded by pymavlink."""
    receiver = mavlink.MAVLink(None)
    return sum(len(receiver.parse_buffer(once[i : i + CHUNK]) or ()) for i in range(0, len(once), CHUNK))


def measure(decode: Callable[[bytes], int], once: bytes, samples: int, megabytes: float) -> float:
    """Return megabytes per second of processor time, the best of some rounds. Fail if samples are missing."""
    times, best_s = max(1, round(megabytes * 1e6 / len(once))), float("inf")
    for _ in range(ROUNDS):
        began_s = time.process_time()
        decoded = sum(decode(once) for _ in range(times))
        best_s = min(best_s, time.process_time() - began_s)
        if decoded != times * samples:
            raise SystemExit(f"{decode.__name__}: {decoded} samples of {times * samples}")
    return times * len(once) / best_s * 1e-6


def main(megabytes: float) -> int:
    slow = []
    print(f"package cobs has its compiled part: {stuffing.unstuff is stuffing.unstuff_by_package}")
    for name, rates_hz in STREAMS.items():
        once = record_stream(rates_hz)
        samples = frames(once)
        mavlink_stream, speeds_mb_s = make_mavlink_stream(samples), dict[str, float]()
        print(f"{name}: {' + '.join(f'{rate_hz:g}' for rate_hz in rates_hz.values())} Hz, {samples} samples at a time")
        for decode, stream, fraction in (
            (frames, once, 1.0),
            (batches, once, 1.0),
            (batches_without_compiler, once, 1.0),
            (byte_loop, once, SLOW_FRACTION),
            (pymavlink, mavlink_stream, SLOW_FRACTION),
        ):
            mb_s = measure(decode, stream, samples, fraction * megabytes)
            print(f"  {decode.__name__:26}{mb_s:7.1f} MB/s {mb_s * samples / len(stream):6.2f} million samples/s")
            if fraction == 1.0 and mb_s < LIMIT_MB_S:
                slow.append(f"{decode.__name__} of {name}")
            speeds_mb_s[decode.__name__] = mb_s
        figure, loop_mb_s = f"decode to batches, {name}", speeds_mb_s["byte_loop"]
        record(figure, speeds_mb_s["batches"], "MB/s", peer="byte loop", peer_value=loop_mb_s)
    if slow:
        print(f"under {LIMIT_MB_S:g} MB/s: {', '.join(slow)}")
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 8.0))

"""A serial line that damages its bytes, and the results of receivers behind it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from firmware_host.frames import FrameReader, encode
from firmware_host.protocol import MESSAGES
from support.board.host_frames import CReceiver, encode_in_c

MEAN_FAULT_BYTES = 4
CHUNK = 4096  # largest size of a read from the port

_SAMPLES = next(message for message in MESSAGES if message.name == "samples")


@dataclass(frozen=True, slots=True)
class Transmission:
    """Frames of one sensor: frame `i` has the sequence `i` mod 256 and the samples `first[i]` up to `first[i + 1]`."""

    wires: list[bytes]
    first: np.ndarray


@dataclass(frozen=True, slots=True)
class Received:
    """A receiver's result. `wrong`: accepted, but never sent; `missed`: not accepted, although no fault touched it."""

    accepted: int
    wrong: int
    missed: int
    refused: int


@dataclass(frozen=True, slots=True)
class Outcome:
    """The results of the host's and the firmware's receiver for a damaged transmission.

    `touched` counts frames of which a fault touched a byte or the preceding delimiter; `intact`: frames that arrived as
    sent; `damaged`: other blocks between two delimiters. Losses are counted between the first and the last received
    frame: the true ones, and those by the sequences of frames and of samples.
    """

    sent: int
    bytes_sent: int
    faults: int
    touched: int
    intact: int
    damaged: int
    host: Received
    firmware: Received
    frames_lost: int
    frames_lost_by_sequence: int
    samples_lost: int
    samples_lost_by_sequence: int


def transmission(random: np.random.Generator, count: int) -> Transmission:
    """Return `count` frames of 1 to 18 samples, as the firmware makes them."""
    sizes = random.integers(1, 19, count)
    first = np.concatenate(([0], np.cumsum(sizes)))
    counts = random.integers(-400, 400, (first[-1], 3)).astype("<i2")
    wires = []
    for number, size in enumerate(sizes.tolist()):
        begin = int(first[number])
        items = np.zeros(size, _SAMPLES.item_dtype)
        items["delta_us"] = np.arange(size) * 4202
        items["counts"] = counts[begin : begin + size]
        items["temperature_counts"] = -48
        values = {"sensor": 0, "mode": 0, "sequence": begin, "dropped": 0, "base_time_us": begin * 4202, "count": size}
        wires.append(encode("samples", number % 256, values, items))
    return Transmission(wires, first)


def damage(random: np.random.Generator, stream: bytes, faults: int) -> tuple[bytes, list[tuple[int, int]]]:
    """Return `stream` with `faults` at random places, and the spans of it that they touched.

    A fault flips one bit or several, or loses, doubles, overwrites or inserts a run of bytes, of random length.
    """

    def noise(size: int) -> bytes:
        return random.integers(0, 256, size, np.uint8).tobytes()

    def flipped(run: bytes, bits: int) -> bytes:
        damaged = bytearray(run)
        for bit in random.integers(0, 8 * len(run), bits).tolist():
            damaged[bit // 8] ^= 1 << bit % 8
        return bytes(damaged)

    kinds: tuple[Callable[[bytes], bytes], ...] = (
        lambda run: flipped(run, 1),
        lambda run: flipped(run, 2 + int(random.integers(8))),
        lambda run: b"",
        lambda run: run + run,
        lambda run: noise(len(run)),
        lambda run: noise(len(run)) + run,
    )
    end = 0
    pieces = []
    spans = []
    for position, length, kind in zip(
        np.sort(random.integers(0, len(stream) - 1, faults)).tolist(),
        random.geometric(1 / MEAN_FAULT_BYTES, faults).tolist(),
        random.integers(0, len(kinds), faults).tolist(),
        strict=True,
    ):
        begin = max(position, end)
        run = stream[begin : begin + length]
        if run:
            pieces.extend([stream[end:begin], kinds[kind](run)])
            end = begin + len(run)
            spans.append((begin, end))
    return b"".join([*pieces, stream[end:]]), spans


def _find_touched(wires: list[bytes], spans: list[tuple[int, int]]) -> set[int]:
    """Return the numbers of the frames of which a span contains a byte or the preceding delimiter."""
    begins = np.concatenate(([0], np.cumsum([len(wire) for wire in wires])))
    touched: set[int] = set()
    for begin, end in spans:
        # A byte before the span too: bytes inserted right after a delimiter belong to the next frame
        low, high = np.searchsorted(begins, (begin, end), "right") - 1
        touched.update(range(int(low), min(int(high) + 1, len(wires))))
    return touched


def carry(seed: int, count: int, faults: int) -> Outcome:
    """Send `count` frames over a line with `faults` to both receivers, and return their results."""
    random = np.random.default_rng(seed)
    sent = transmission(random, count)
    stream = b"".join(sent.wires)
    arrived, spans = damage(random, stream, faults)
    touched = _find_touched(sent.wires, spans)
    untouched = set(range(count)) - touched
    number_of = {wire: number for number, wire in enumerate(sent.wires)}
    blocks = [block + b"\0" for block in arrived.split(b"\0")[:-1] if block]
    intact = [number_of[block] for block in blocks if block in number_of]

    def judged(accepted: list[bytes], refused: int) -> Received:
        numbers = {number_of[wire] for wire in accepted if wire in number_of}
        return Received(
            accepted=len(accepted),
            wrong=sum(wire not in number_of for wire in accepted),
            missed=len(untouched - numbers),
            refused=refused,
        )

    reader, c_reader = FrameReader(), CReceiver()
    frames = [frame for chunk in _chunks(arrived) for frame in reader.feed(chunk)]
    c_frames = [frame for chunk in _chunks(arrived) for frame in c_reader.feed(chunk)]
    begins = np.array([frame.values["sequence"] for frame in frames])
    ends = begins + [frame.values["count"] for frame in frames]
    return Outcome(
        sent=count,
        bytes_sent=len(stream),
        faults=len(spans),
        touched=len(touched),
        intact=len(intact),
        damaged=len(blocks) - len(intact),
        host=judged([encode(f.name, f.sequence, f.values, f.items) for f in frames], reader.damaged),
        firmware=judged([encode_in_c(*frame) for frame in c_frames], c_reader.damaged),
        frames_lost=intact[-1] - intact[0] + 1 - len(intact),
        frames_lost_by_sequence=reader.lost,
        samples_lost=int(np.delete(np.diff(sent.first), intact)[intact[0] : intact[-1] + 1 - len(intact)].sum()),
        samples_lost_by_sequence=int((begins[1:] - ends[:-1]).sum()),
    )


def _chunks(data: bytes) -> Iterator[bytes]:
    return (data[begin : begin + CHUNK] for begin in range(0, len(data), CHUNK))

"""Damaged frames by the million, made by `damaged_frames.c`, for the firmware's receiver or the host's."""

import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import IO, Any

import numpy as np

from firmware_host import protocol
from firmware_host.answers import (
    BoardIdentity,
    BoardObservation,
    BoardSolution,
    BoardStatus,
    SensorSetup,
    StoredCalibration,
    sample_batches,
)
from firmware_host.frames import Frame, FrameReader, encode
from support.paths import FIRMWARE

CHUNK = 1 << 16
OF_EACH = 40  # sound frames of each message


@dataclass(frozen=True, slots=True)
class Sent:
    """Counts of what was sent, by a receiver written from the protocol's description.

    `blocks`: all between two delimiters; `valid`: those with a correct CRC. Valid are the frames that arrived
    `as_sent`, nonsense `made` with a correct CRC on purpose, and damage with a correct CRC by `chance`. `answers`
    counts the board's frames, `errors` the refusals among these.
    """

    frames: int
    blocks: int
    refused: int
    valid: int
    as_sent: int
    made: int
    chance: int
    answers: int
    errors: int


def build(folder: Path) -> Path:
    """Compile the program with sanitizers in `folder`, and return its path."""
    command = ["make", "-s", "-C", str(FIRMWARE), "damaged", f"OUT={folder}", f"PYTHON={sys.executable}"]
    subprocess.run(command, check=True)
    return folder / "fuzz" / "damaged_frames"


def write_sound(path: Path, sender: str, seed: int) -> Path:
    """Write frames of all messages of a sender, with random valid contents."""
    random = np.random.default_rng(seed)
    wires = [
        _sound(random, message) for message in protocol.MESSAGES if message.sender == sender for _ in range(OF_EACH)
    ]
    path.write_bytes(b"".join(wires))
    return path


def _sound(random: np.random.Generator, message: protocol.Message) -> bytes:
    item_size = message.item_dtype.itemsize
    values: dict[str, Any] = message.name_values(message.head.unpack(random.bytes(message.head.size)))
    items = None
    if item_size:
        number = int(random.integers((protocol.PAYLOAD_MAX - message.head.size) // item_size + 1))
        items = np.frombuffer(bytearray(random.bytes(number * item_size)), message.item_dtype)
        if message.name == "identity":
            items["quantity"] %= len(protocol.QUANTITIES)
        values |= {"count": number} if "count" in values else {}
    if message.name == "identity":
        values["protocol"] = protocol.PROTOCOL_VERSION
    values |= {name: 0 for name in ("mode", "method", "status", "written_unix_s") if name in values}
    return encode(message.name, int(random.integers(256)), values, items)


def damage_requests(program: Path, frames: int, seed: int, sound: Path) -> Sent:
    """Send damaged requests to the firmware's receiver and board. Raise AssertionError with the sanitizers' report."""
    run = subprocess.run([program, str(frames), str(seed), sound], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return Sent(**json.loads(run.stderr.splitlines()[-1]))


@dataclass(frozen=True, slots=True)
class Heard:
    """The host receiver's result of a stream: frames by name, and a digest of their contents in order.

    `damaged`: the number of refused blocks; `repeated`: of blocks received before.
    """

    frames: Counter[str]
    digest: str
    damaged: int
    repeated: int

    @property
    def accepted(self) -> int:
        """The number of blocks accepted as frames."""
        return sum(self.frames.values()) + self.repeated


# What the host makes of a frame, as firmware_host/client.py does.
_READ: dict[str, Callable[[Frame], object]] = {
    **{name: lambda frame: list(sample_batches([frame], 0.0)) for name in protocol.SAMPLES},
    "setup": SensorSetup.decode,
    "report": lambda frame: BoardStatus.decode(frame, 0, 0),
    "observed": BoardObservation.decode,
    "solution": BoardSolution.decode,
    "calibration": StoredCalibration.decode,
}


def listen(stream: IO[bytes]) -> Heard:
    """Return the result of the host's receiver and decoders for a stream."""
    reader, names, digest = FrameReader(), Counter[str](), sha256()
    while data := stream.read(CHUNK):
        for frame in reader.feed(data):
            names[frame.name] += 1
            digest.update(repr((frame.name, frame.sequence, frame.values, frame.items.tobytes())).encode())
            if frame.name == "identity" and frame.values["protocol"] == protocol.PROTOCOL_VERSION:
                BoardIdentity.decode(frame)
            elif read := _READ.get(frame.name):
                read(frame)
    return Heard(names, digest.hexdigest(), reader.damaged, reader.repeated)


def damage_answers(program: Path, frames: int, seed: int, sound: Path) -> tuple[Sent, Heard, Heard]:
    """Send damaged answers and samples to the host's receiver.

    Return what was sent, the result, and the result of the intact blocks alone.
    """
    whole = sound.with_suffix(".whole")
    command = [str(program), str(frames), str(seed), str(sound), str(whole)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stderr is not None
        heard = listen(process.stdout)
        complaint = process.stderr.read().decode()
    assert process.returncode == 0, complaint
    with whole.open("rb") as stream:
        return Sent(**json.loads(complaint.splitlines()[-1])), heard, listen(stream)

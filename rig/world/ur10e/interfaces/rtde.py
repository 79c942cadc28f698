"""RTDE, port 30004: data packages at the rate that a client requests. Bytes in, bytes out; no sockets here.

Source: the maker's Real-Time Data Exchange guide, protocol versions 1 and 2. A package is a big-endian size (u16), a
type (one letter) and a payload.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rig.world.clock import TICKS_PER_SECOND
from rig.world.ur10e.interfaces.variables import INPUTS, OUTPUTS, TYPES, Get, Put, apply_masked, find_output_type
from rig.world.ur10e.robot import Robot

PORT = 30004
HEADER = struct.Struct(">HB")
# The guide's limit of 2048 bytes for a list of names is not enforced: the maker's test program sends four times that.
DATA_BYTES = 0xFFFF - HEADER.size - 1  # the greatest size of a recipe's values, after its number
INPUT_RECIPES = 255  # the number is a byte, and 0 means none
DEFAULT_HZ = 125.0  # version 1 has no frequency
CB3_HZ, E_SERIES = 125.0, 5  # highest rate before the e-Series; major version of the first e-Series


def build_package(kind: str, payload: bytes) -> bytes:
    return HEADER.pack(HEADER.size + len(payload), ord(kind)) + payload


@dataclass(frozen=True, slots=True)
class InputRecipe:
    """An input recipe: the layout of a data package, and the name, size and destination of each of its values."""

    layout: struct.Struct
    fields: tuple[tuple[str, int, Put], ...]  # name, number of values, destination


class OutputRecipe:
    """An output recipe: the getters of its variables, in order, and the precompiled layout of a package."""

    def __init__(self, names: list[str], frequency_hz: float, recipe_id: int | None) -> None:
        kinds = [OUTPUTS[name][0] for name in names]
        self._getters: list[tuple[Get, bool]] = [
            (OUTPUTS[name][1], TYPES[kind][1] > 1) for name, kind in zip(names, kinds, strict=True)
        ]
        self._lead: list[Any] = [] if recipe_id is None else [recipe_id]
        layout = ">HB" + "B" * len(self._lead) + "".join(TYPES[kind][0] for kind in kinds)
        self._struct = struct.Struct(layout)
        self._lead = [self._struct.size, ord("U"), *self._lead]
        self._per_tick = frequency_hz / TICKS_PER_SECOND
        self._due_fraction = 1.0 - self._per_tick  # the first package goes out with the first tick

    def is_due(self) -> bool:
        """Return whether a package is due in this tick. Call it once per tick."""
        self._due_fraction += self._per_tick
        if self._due_fraction < 1.0 - 1e-9:
            return False
        self._due_fraction -= float(int(self._due_fraction + 1e-9))
        return True

    def pack(self, robot: Robot) -> bytes:
        values = list(self._lead)
        for get, vector in self._getters:
            if vector:
                values += get(robot)
            else:
                values.append(get(robot))
        return self._struct.pack(*values)


class RtdeSession:
    """The world's side of one RTDE connection, with the recipes that the client has set up."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.closing = False
        self._buffer = bytearray()
        self._version = 1
        self._output: OutputRecipe | None = None
        self._inputs: dict[int, InputRecipe] = {}
        self._started = False
        self._answers: dict[str, Callable[[bytes], bytes]] = {
            "V": self._negotiate, "v": self._controller_version, "O": self._setup_outputs, "I": self._setup_inputs,
            "S": self._start, "P": self._pause, "U": self._data, "M": self._message,
        }  # fmt: skip

    @property
    def dialogue(self) -> bool:
        """Whether the client still asks questions; once it has started the data packages, it only exchanges values."""
        return not self._started

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        """Return the answers to all complete packages, and keep further bytes; close the connection at a wrong size."""
        self._buffer += data
        answer = b""
        while len(self._buffer) >= HEADER.size:
            size, kind = HEADER.unpack_from(self._buffer)
            if size < HEADER.size:
                self._buffer.clear()  # nothing that follows can be trusted
                self.closing = True
                answer += self._say(f"a package of {size} bytes is not RTDE")
                break
            if len(self._buffer) < size:
                break
            payload = bytes(self._buffer[HEADER.size : size])
            del self._buffer[:size]
            handler = self._answers.get(chr(kind))
            try:
                answer += handler(payload) if handler else self._say(f"unknown package type {kind}")
            except struct.error:
                answer += self._say(f"package of type {chr(kind)} with {len(payload)} bytes, which is not its length")
        return answer

    def tick(self) -> bytes:
        """Return the data package of this tick; empty if none is due."""
        if self._started and self._output is not None and self._output.is_due():
            return self._output.pack(self._robot)
        return b""

    def handle_close(self) -> None:
        """Release the inputs of a closed connection."""
        claims = self._robot.claims
        for name in [name for name, owner in claims.items() if owner is self]:
            del claims[name]

    # -- answers -----------------------------------------------------------------------------------------------
    def _negotiate(self, payload: bytes) -> bytes:
        (version,) = struct.unpack(">H", payload)
        accepted = version in (1, 2)
        if accepted:
            self._version = version
        return build_package("V", bytes([accepted]))

    def _controller_version(self, payload: bytes) -> bytes:
        return build_package("v", struct.pack(">4I", *self._robot.identity.polyscope))

    def _setup_outputs(self, payload: bytes) -> bytes:
        """Set up the output recipe of a request; return the answer, which has the types of its variables."""
        frequency_hz = DEFAULT_HZ
        if self._version == 2:
            (frequency_hz,) = struct.unpack_from(">d", payload)
            payload = payload[8:]
        names = _names(payload)
        kinds = [find_output_type(self._robot, name) for name in names]
        if (size := _size_bytes(kinds)) > DATA_BYTES:
            self._output = None
            refusal = build_package("O", b"\0" if self._version == 2 else b"")
            return self._say(f"a recipe of {size} bytes of values; the limit is {DATA_BYTES}") + refusal
        fastest_hz = TICKS_PER_SECOND if self._robot.identity.polyscope[0] >= E_SERIES else CB3_HZ
        valid = "NOT_FOUND" not in kinds and bool(names) and 0.0 < frequency_hz <= fastest_hz
        self._output = OutputRecipe(names, frequency_hz, 1 if self._version == 2 else None) if valid else None
        lead = bytes([valid]) if self._version == 2 else b""
        return build_package("O", lead + ",".join(kinds).encode())

    def _setup_inputs(self, payload: bytes) -> bytes:
        """Set up an input recipe and claim its registers; return the answer: the types, or the reason for a refusal."""
        if len(self._inputs) == INPUT_RECIPES:
            return self._say("no more input recipes") + build_package("I", b"\0")
        names = _names(payload)
        claims = self._robot.claims
        kinds = []
        for name in names:
            if name not in INPUTS:
                kinds.append("NOT_FOUND")
            elif claims.get(name, self) is not self:
                kinds.append("IN_USE")
            else:
                kinds.append(INPUTS[name][0])
        if not names or "NOT_FOUND" in kinds or "IN_USE" in kinds:
            return build_package("I", b"\0" + ",".join(kinds).encode())
        for name in names:
            claims[name] = self
        recipe_id = len(self._inputs) + 1
        self._inputs[recipe_id] = InputRecipe(
            struct.Struct(">" + "".join(TYPES[kind][0] for kind in kinds)),
            tuple((name, TYPES[kind][1], INPUTS[name][1]) for name, kind in zip(names, kinds, strict=True)),
        )
        return build_package("I", bytes([recipe_id]) + ",".join(kinds).encode())

    def _start(self, payload: bytes) -> bytes:
        self._started = True
        return build_package("S", b"\1")

    def _pause(self, payload: bytes) -> bytes:
        self._started = False
        return build_package("P", b"\1")

    def _data(self, payload: bytes) -> bytes:
        """Write a data package's values into the inputs of its recipe; return b"", or a message on an error."""
        recipe = self._inputs.get(payload[0]) if payload else None
        if recipe is None:
            return self._say("data package for an input recipe that was never set up")
        if len(payload) - 1 != recipe.layout.size:
            return self._say(f"data package of {len(payload) - 1} bytes instead of {recipe.layout.size}")
        values = iter(recipe.layout.unpack_from(payload, 1))
        named: dict[str, Any] = {}
        for name, count, put in recipe.fields:
            value = next(values) if count == 1 else tuple(next(values) for _ in range(count))
            named[name] = value
            put(self._robot, value)
        apply_masked(self._robot, named)
        self._robot.feed_watchdog()
        return b""

    def _message(self, payload: bytes) -> bytes:
        """Log a text message from a client; return b"", because it is not answered."""
        length = payload[0] if payload else 0
        self._robot.messages.say(payload[1 : 1 + length].decode(errors="replace"))
        return b""

    def _say(self, text: str) -> bytes:
        """Return the package of a message to the client, in the form of its protocol version."""
        words, error = text.encode(), 1
        if self._version == 1:
            return build_package("M", bytes([error]) + words)
        source = b"RTDE"
        return build_package("M", bytes([len(words)]) + words + bytes([len(source)]) + source + bytes([error]))


def _size_bytes(kinds: list[str]) -> int:
    """Return the number of bytes of values of these types, or of the list of the types' names if that is larger."""
    return max(struct.calcsize(">" + "".join(TYPES[kind][0] for kind in kinds if kind in TYPES)), len(",".join(kinds)))


def _names(payload: bytes) -> list[str]:
    return [name for name in payload.decode(errors="replace").split(",") if name]

"""The wire between host and board: one table of messages, for Python here and, through `c_header.py`, for C.

A frame is `COBS(type u8, sequence u8, payload, CRC u16) 0x00`. The CRC is CRC-16/XMODEM (polynomial 0x1021, start 0)
over type, sequence and payload, sent big-endian: the CRC of a whole undamaged frame is then 0. Everything else is
little-endian. A frame is shorter than 254 bytes, so COBS never needs a second block.

The sequence of a host's frame is chosen by the host, 1 … 255; the board's answer carries it in `reply_to`. A board's
own frames count up modulo 256, so a missing number is a lost frame. `reply_to` 0 means nobody asked.
"""

import struct
from binascii import crc_hqx
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from cobs import cobs

PROTOCOL_VERSION = 1
PAYLOAD_MAX = 240
BAUD_RATE = 921600  # what the shipped image uses

MODES = ("raw", "calibrated")
RESET_CAUSES = ("unknown", "power", "pin", "software", "watchdog", "fault")

# kind → (struct code, C type, C array suffix)
KINDS = {
    "u8": ("B", "uint8_t", ""),
    "u16": ("H", "uint16_t", ""),
    "u32": ("I", "uint32_t", ""),
    "u64": ("Q", "uint64_t", ""),
    "i16": ("h", "int16_t", ""),
    "f32": ("f", "float", ""),
    "f64": ("d", "double", ""),
    "bytes12": ("12s", "uint8_t", "[12]"),
    "text12": ("12s", "char", "[12]"),
    "vector_i16": ("3h", "int16_t", "[3]"),
}


@dataclass(frozen=True, slots=True)
class Field:
    """One value in a payload; `meaning` names its unit."""

    name: str
    kind: str
    meaning: str


@dataclass(frozen=True)
class Message:
    """One kind of frame: fixed fields, then any number of items of one layout."""

    code: int
    name: str
    sender: str
    meaning: str
    fields: tuple[Field, ...] = ()
    items: tuple[Field, ...] = ()

    @cached_property
    def head(self) -> struct.Struct:
        """Layout of the fixed fields."""
        return struct.Struct("<" + "".join(KINDS[field.kind][0] for field in self.fields))

    @cached_property
    def item_dtype(self) -> np.dtype[np.void]:
        """Layout of one item; without items, an empty one."""
        codes = {"bytes12": "V12", "text12": "S12", "vector_i16": "(3,)<i2"}
        return np.dtype([(f.name, codes.get(f.kind, "<" + KINDS[f.kind][0])) for f in self.items])


REPLY_TO = Field("reply_to", "u8", "sequence of the frame this answers, 0 = nobody asked")
SENSOR = Field("sensor", "u8", "index in the identity's list")

MESSAGES = (
    Message(0x01, "hello", "host", "who is there? answered by identity"),
    Message(
        0x02,
        "identity",
        "board",
        "answers hello; also sent twice a second while idle, so that a wrong baud rate can be told from silence",
        (
            REPLY_TO,  # these first two fields stay in every version of the protocol
            Field("protocol", "u8", "PROTOCOL_VERSION of the image"),
            Field("firmware", "text12", "version of the image"),
            Field("unique_id", "bytes12", "of the microcontroller"),
            Field("reset_cause", "u8", "why the board last started: enum reset_cause"),
        ),
        (
            Field("part", "text12", "part the firmware has a driver for"),
            Field("who_am_i", "u16", "identity register as read"),
            Field("present", "u8", "1 = the identity register reads as the part's"),
        ),
    ),
    Message(
        0x03,
        "configure",
        "host",
        "set a sensor up; answered by setup",
        (
            SENSOR,
            Field("rate_hz", "f32", "wanted data rate, Hz; the nearest is taken"),
            Field("range_deg_s", "f32", "wanted range, degrees per second; the next one up is taken"),
        ),
    ),
    Message(
        0x04,
        "setup",
        "board",
        "what the part really does",
        (
            REPLY_TO,
            SENSOR,
            Field("rate_hz", "f64", "nominal data rate, Hz"),
            Field("range_deg_s", "f64", "range, degrees per second"),
            Field("sensitivity_rad_s", "f64", "rad/s per count"),
            Field("temperature_scale_c", "f64", "degrees Celsius per count"),
            Field("temperature_offset_c", "f64", "degrees Celsius at count 0"),
        ),
    ),
    Message(
        0x05,
        "start",
        "host",
        "stream every configured sensor, sequences from 0; answered by ack",
        (Field("mode", "u8", "enum sample_mode"),),
    ),
    Message(0x06, "stop", "host", "stop streaming; the ack follows the last samples"),
    Message(0x07, "ack", "board", "done as asked", (REPLY_TO,)),
    Message(
        0x08,
        "samples",
        "board",
        "a run of samples with consecutive sequence numbers",
        (
            SENSOR,
            Field("mode", "u8", "enum sample_mode"),
            Field("sequence", "u32", "of the first sample; counts every conversion of the part since start"),
            Field("dropped", "u32", "conversions since start that never became a sample in a frame"),
            Field("base_time_us", "u64", "board time of the first sample, read before the bus transfer"),
            Field("count", "u8", "number of samples"),
        ),
        (
            Field("delta_us", "u32", "board time after base_time_us"),
            Field("counts", "vector_i16", "x, y, z as the part reports them"),
            Field("temperature_counts", "i16", "as the part reports it"),
        ),
    ),
    Message(0x09, "status", "host", "how is it going? answered by report"),
    Message(
        0x0A,
        "report",
        "board",
        "the board's health",
        (
            REPLY_TO,
            Field("uptime_us", "u64", "board time"),
            Field("rx_errors", "u32", "frames from the host that were damaged or too long"),
            Field("tx_overruns", "u32", "frames there was no room to send"),
            Field("bus_errors", "u32", "sensor reads that did not carry new data"),
            Field("stack_high_water", "u32", "most stack ever used, bytes"),
            Field("fault_pc", "u32", "where the last processor fault struck, 0 = none"),
            Field("reset_cause", "u8", "enum reset_cause"),
            Field("clock_locked", "u8", "1 = the clock follows the 32768 Hz crystal"),
            Field("streaming", "u8", "1 = between start and stop"),
        ),
        (
            Field("conversions", "u32", "conversions seen since start"),
            Field("samples", "u32", "of them sent in a frame"),
            Field("dropped", "u32", "of them lost on the board"),
        ),
    ),
    Message(
        0x0B,
        "error",
        "board",
        "a request refused, or something wrong on the board",
        (REPLY_TO, Field("code", "u8", "enum error_code"), SENSOR),
    ),
    Message(0x0C, "reboot", "host", "start afresh; the ack comes before"),
)


@dataclass(frozen=True, slots=True)
class ErrorKind:
    """An error the board can report: `what` follows "the board says that"."""

    code: int
    name: str
    what: str
    remedy: str


ERRORS = (
    ErrorKind(1, "unknown_message", "it does not know this request", "Flash the image that comes with this program"),
    ErrorKind(2, "bad_length", "the request has the wrong length", "Flash the image that comes with this program"),
    ErrorKind(3, "no_such_sensor", "it has no sensor of this number", "Check the sensors in the configuration"),
    ErrorKind(4, "sensor_absent", "the sensor does not answer on its bus", "Check its supply and its SPI wires"),
    ErrorKind(5, "bad_rate", "the data rate is not a positive number", "Correct rate_hz in the configuration"),
    ErrorKind(6, "bad_range", "the part has no such range", "Correct range_deg_s in the configuration"),
    ErrorKind(7, "bad_mode", "it cannot send samples in this mode", "Ask for raw samples"),
    ErrorKind(8, "setup_failed", "a setting did not read back as written", "Check the sensor's SPI wires and supply"),
    ErrorKind(9, "not_configured", "no sensor is configured", "Configure a sensor before the start"),
    ErrorKind(10, "busy_streaming", "it is streaming and cannot change settings", "Stop the stream first"),
    ErrorKind(11, "sensor_silent", "the sensor stopped signalling new data", "Check its interrupt wire and supply"),
)

_BY_CODE = {message.code: message for message in MESSAGES}
_BY_NAME = {message.name: message for message in MESSAGES}
ERROR_BY_CODE = {error.code: error for error in ERRORS}


@dataclass(frozen=True, slots=True)
class Frame:
    """A received frame: fixed fields by name, items as a structured array of the table's layout."""

    name: str
    sequence: int
    values: dict[str, Any]
    items: np.ndarray


def encode(name: str, sequence: int, values: dict[str, Any] | None = None, items: np.ndarray | None = None) -> bytes:
    """The bytes of one frame, delimiter included. Raises ValueError when the payload exceeds `PAYLOAD_MAX`."""
    message = _BY_NAME[name]
    values = values or {}
    flat: list[Any] = []
    for field in message.fields:
        value = values[field.name]
        flat.append(value.encode("ascii") if isinstance(value, str) else value)
    payload = message.head.pack(*flat)
    if items is not None:
        payload += np.ascontiguousarray(items, message.item_dtype).tobytes()
    if len(payload) > PAYLOAD_MAX:
        raise ValueError(f"{name}: payload of {len(payload)} bytes, at most {PAYLOAD_MAX} fit a frame")
    body = bytes((message.code, sequence)) + payload
    return bytes(cobs.encode(body + crc_hqx(body, 0).to_bytes(2, "big"))) + b"\0"


def decode(block: bytes) -> Frame | None:
    """One COBS block (without its delimiter) → frame; None when damaged or not in the table.

    An identity of another protocol version comes back with only the two fields every version has.
    """
    try:
        body = cobs.decode(block)
    except cobs.DecodeError:
        return None
    message = _BY_CODE.get(body[0]) if len(body) >= 4 and crc_hqx(body, 0) == 0 else None
    if message is None:
        return None
    payload = body[2:-2]
    if message.name == "identity" and len(payload) >= 2 and payload[1] != PROTOCOL_VERSION:
        return Frame("identity", body[1], {"reply_to": payload[0], "protocol": payload[1]}, np.empty(0))
    size, each = message.head.size, message.item_dtype.itemsize
    if len(payload) < size or (len(payload) - size) % each if each else len(payload) != size:
        return None
    values = dict(zip((f.name for f in message.fields), message.head.unpack_from(payload), strict=True))
    items = np.frombuffer(payload, message.item_dtype, offset=size) if each else np.empty(0)
    if values.get("count", len(items)) != len(items):
        return None
    return Frame(message.name, body[1], values, items)


class FrameReader:
    """Cuts a byte stream into frames, whatever the chunks it arrives in."""

    def __init__(self) -> None:
        self._rest = b""
        self.damaged = 0  # blocks that did not decode
        self.bytes_seen = 0

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that `data` completes."""
        self.bytes_seen += len(data)
        *blocks, self._rest = (self._rest + data).split(b"\0")
        if len(self._rest) > 2 * PAYLOAD_MAX:  # no frame is that long: noise, or another baud rate
            blocks.append(self._rest)
            self._rest = b""
        frames = []
        for block in blocks:
            if block:
                frame = decode(block)
                if frame is None:
                    self.damaged += 1
                else:
                    frames.append(frame)
        return frames


def text(value: bytes) -> str:
    """A fixed-width text field as str."""
    return value.rstrip(b"\0").decode("ascii", "replace")

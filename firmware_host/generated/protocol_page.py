"""Print the message table as a page, docs/protocol.md: `make -C firmware_host/firmware header`."""

import struct
from collections.abc import Iterable, Iterator, Sequence

from firmware_host import protocol
from firmware_host.frames import encode
from firmware_host.protocol import Field, Message

MAX_BLOCK_BYTES = protocol.PAYLOAD_MAX + protocol.OVERHEAD + protocol.COBS_BYTES


def reference() -> str:
    """Return the protocol as Markdown: frame, messages with offsets of fields, enumerations, errors and remedies."""
    lines = [
        "# The protocol between host and board",
        "",
        "Generated from [`firmware_host/protocol.py`](../firmware_host/protocol.py) by",
        "`make -C firmware_host/firmware header`: change the table, not this page.",
        "",
        f"Version {protocol.PROTOCOL_VERSION}, spoken by the shipped image {protocol.FIRMWARE_VERSION} at "
        f"{protocol.BAUD_RATE} Bd, 8 data bits, no parity, 1 stop bit.",
        *_frame(),
        "",
        "## Messages",
        "",
        *_table(("code", "message", "from", "meaning"), map(_row, protocol.MESSAGES)),
    ]
    for message in protocol.MESSAGES:
        if message.fields or message.items:
            lines += ["", f"### {message.name}", "", f"From the {message.sender}: {message.meaning}."]
        if message.fields:
            lines += ["", *_layout(message.fields, "byte")]
        if message.items:
            item_bytes, room = message.item_dtype.itemsize, protocol.PAYLOAD_MAX - message.head.size
            lines += ["", f"Then any number of items of {item_bytes} bytes, at most {room // item_bytes} a frame:"]
            lines += ["", *_layout(message.items, "byte of the item")]
    lines += ["", "## Enumerations", "", *_table(("enumeration", "values"), _enumerations())]
    lines += [
        "",
        "## Errors of the board",
        "",
        "The programs on the host report them by these names; other errors of the link have names of the host's.",
        "",
        *_errors(),
    ]
    return "\n".join(lines) + "\n"


def _frame() -> list[str]:
    return [
        "",
        "## Frame",
        "",
        "```",
        "COBS(type u8, sequence u8, payload, CRC u32) 0x00",
        "```",
        "",
        "- Everything is little-endian. A vector is x, y, z, a matrix its three rows; a text is",
        "  ASCII, filled up with zeros.",
        f"- A payload has at most {protocol.PAYLOAD_MAX} bytes, a frame on the wire at most {MAX_BLOCK_BYTES}: COBS",
        "  needs no second block.",
        "- The CRC is CRC-32 as in zlib and Ethernet, over type, sequence and payload.",
        "- The host chooses the numbers of its frames, 1 … 255; the board's answer repeats the number as `reply_to`,",
        "  which is 0 in unrequested frames.",
        "- The board numbers its own frames 0 … 255 and again from 0: a missing number is a lost frame.",
        "- A receiver discards and counts blocks that do not decode, up to the next 0x00. The host repeats a request",
        "  without an answer, so every request may arrive twice; the board repeats nothing.",
        f"- Example: `hello` with sequence 1 is `{encode('hello', 1).hex(' ')}` on the wire.",
    ]


def _row(message: Message) -> tuple[str, ...]:
    detailed = message.fields or message.items
    name = f"[{message.name}](#{message.name})" if detailed else message.name
    return f"0x{message.code:02x}", name, message.sender, message.meaning


def _layout(fields: Sequence[Field], heading: str) -> Iterator[str]:
    """Yield the lines of a table of fields, which follow each other without gaps."""
    offset = 0
    offsets = []
    for field in fields:
        offsets.append(offset)
        offset += struct.calcsize("<" + protocol.KINDS[field.kind][0])
    rows = ((str(offset), field.name, field.kind, field.meaning) for offset, field in zip(offsets, fields, strict=True))
    return _table((heading, "field", "kind", "meaning"), rows)


def _enumerations() -> Iterator[tuple[str, str]]:
    for name, (_, values) in protocol.ENUMERATIONS.items():
        yield name, ", ".join(f"{number} {value}" for number, value in enumerate(values))


def _errors() -> Iterator[str]:
    rows = ((str(code), error.name, error.what, error.remedy) for code, error in protocol.ERRORS.items())
    return _table(("code", "error", "the board says that", "remedy"), rows)


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"| {' | '.join(headings)} |"
    yield "|" + " --- |" * len(headings)
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', '/') for cell in row)} |"


if __name__ == "__main__":
    print(reference(), end="")

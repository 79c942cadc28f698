"""The protocol's page says what the table says."""

from pathlib import Path

from firmware_host import protocol
from firmware_host.reference import reference
from firmware_host.stuffing import unstuff

PAGE = Path(__file__).parent.parent / "docs" / "protocol.md"


def test_the_committed_page_is_what_the_table_generates() -> None:
    again = "python -m firmware_host.reference > docs/protocol.md"
    assert PAGE.read_text(encoding="utf-8") == reference(), f"the protocol has changed: {again}"


def test_every_message_field_and_error_is_on_the_page() -> None:
    page = reference()
    for message in protocol.MESSAGES:
        assert f"| 0x{message.code:02x} |" in page
        for field in (*message.fields, *message.items):
            assert f"| {field.name} | {field.kind} | {field.meaning} |" in page
    for error in protocol.ERRORS:
        assert f"| {error.code} | {error.name} | {error.what} | {error.remedy} |" in page


def test_the_places_of_the_fields_are_those_on_the_wire() -> None:
    """`sequence` of a batch stands at byte 2 of the payload, after sensor and mode."""
    batch = {"sensor": 1, "mode": 0, "sequence": 0xAABBCCDD, "dropped": 0, "base_time_us": 0, "count": 0}
    frame = protocol.encode("samples", 7, batch)
    payload = unstuff(frame[:-1])
    assert payload is not None
    assert payload[2 + 2 : 2 + 6] == bytes.fromhex("ddccbbaa")
    section = reference().split("### samples")[1].split("###")[0]
    assert "| 2 | sequence | u32 |" in section

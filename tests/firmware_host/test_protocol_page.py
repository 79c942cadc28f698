"""The documents about the board say what the tables and the board do."""

import pytest

from firmware_host import protocol
from firmware_host.frames import encode
from firmware_host.generated.protocol_page import reference
from firmware_host.parts import GYROSCOPES, BoardPart
from firmware_host.stuffing import unstuff
from support.paths import DOCS

PAGE = DOCS / "protocol.md"


def test_the_committed_page_is_what_the_table_generates() -> None:
    assert PAGE.read_text(encoding="utf-8") == reference(), "again: make -C firmware_host/firmware header"


def test_every_message_field_and_error_is_on_the_page() -> None:
    page = reference()
    for message in protocol.MESSAGES:
        assert f"| 0x{message.code:02x} |" in page
        for field in (*message.fields, *message.items):
            assert f"| {field.name} | {field.kind} | {field.meaning} |" in page
    for code, error in protocol.ERRORS.items():
        assert f"| {code} | {error.name} | {error.what} | {error.remedy} |" in page


def test_the_places_of_the_fields_are_those_on_the_wire() -> None:
    """`sequence` of a batch stands at byte 2 of the payload, after sensor and mode."""
    batch = {"sensor": 1, "mode": 0, "sequence": 0xAABBCCDD, "dropped": 0, "base_time_us": 0, "count": 0}
    frame = encode("samples", 7, batch)
    payload = unstuff(frame[:-1])
    assert payload is not None
    assert payload[2 + 2 : 2 + 6] == bytes.fromhex("ddccbbaa")
    section = reference().split("### samples")[1].split("###")[0]
    assert "| 2 | sequence | u32 |" in section


def wiring() -> dict[str, dict[str, str]]:
    """Chip pin → part → the part's pin, by the table in docs/board.md."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in (PAGE.parent / "board.md").read_text(encoding="utf-8").splitlines()
        if line.startswith("|")
    ]
    heading = next(row for row in rows if row[0] == "Nucleo")
    return {row[1]: dict(zip(heading[2:], row[2:], strict=True)) for row in rows if len(row) == len(heading)}


@pytest.mark.parametrize("wired", GYROSCOPES.values(), ids=lambda wired: wired.name)
def test_the_wiring_table_is_how_the_board_is_wired(wired: BoardPart) -> None:
    """The firmware drives these pins, and the register models sit on them."""
    table = wiring()
    assert "CS" in table[wired.select][wired.name]
    assert table[wired.data_ready][wired.name] in ("INT1_A/G", "INT", "INT1", "DR")
    for pin in (wired.select, wired.data_ready):
        assert [name for name, label in table[pin].items() if label] == [wired.name]
    assert all(table[bus][wired.name] for bus in ("PB3", "PB4", "PB5"))


def test_the_batches_age_is_the_firmware_s() -> None:
    page = (PAGE.parent / "board.md").read_text(encoding="utf-8")
    assert f"its first sample is {protocol.BATCH_AGE_US // 1000} ms old" in page

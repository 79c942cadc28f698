"""The documents about the board say what the tables and the board do."""

import inspect

import pytest

from firmware_host import protocol
from firmware_host.emulator.adis16465 import Adis16465
from firmware_host.emulator.lsm9ds1 import Lsm9ds1
from firmware_host.emulator.mpu9250 import Mpu9250
from firmware_host.frames import encode
from firmware_host.protocol_page import reference
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


@pytest.mark.parametrize("model", [Lsm9ds1, Mpu9250, Adis16465])
def test_the_wiring_table_is_how_the_board_is_wired(model: type) -> None:
    """The register models sit on the pins that the firmware drives, or no test of theirs would pass."""
    pins = inspect.signature(model).parameters
    part = model.name  # type: ignore[attr-defined]
    table = wiring()
    assert "CS" in table[pins["chip_select"].default][part]
    assert table[pins["interrupt"].default][part] in ("INT1_A/G", "INT", "DR")
    for others in (pins["chip_select"].default, pins["interrupt"].default):
        assert [name for name, pin in table[others].items() if pin] == [part]
    assert all(table[bus][part] for bus in ("PB3", "PB4", "PB5"))


def test_the_batches_age_is_the_firmware_s() -> None:
    page = (PAGE.parent / "board.md").read_text(encoding="utf-8")
    assert f"its first sample is {protocol.BATCH_AGE_US // 1000} ms old" in page

"""The table of messages and the C header made from it."""

from pathlib import Path

from firmware_host import protocol
from firmware_host.generated.c_header import c_header
from firmware_host.protocol import MESSAGES

HEADER = Path(protocol.__file__).parent / "firmware" / "core" / "link" / "protocol.h"


def test_the_committed_c_header_is_the_one_the_table_generates() -> None:
    assert HEADER.read_text() == c_header(), "run `make -C firmware_host/firmware header`"


def test_what_both_ends_must_agree_on_is_written_in_the_table_alone() -> None:
    """The firmware's other sources use the header's names; none of them defines one of its own."""
    defined = {line.split()[1] for line in HEADER.read_text().splitlines() if line.startswith("#define ")}
    assert {"FRAME_OVERHEAD", "COBS_BYTES", "BATCH_AGE_US", "CALIBRATED_PER_RAD_S", "MAX_SCALE"} <= defined
    sources = [source for source in HEADER.parents[1].rglob("*.[ch]") if source != HEADER]
    again = [
        f"{source.name}: {name}" for source in sources for name in defined if f"#define {name} " in source.read_text()
    ]
    assert not again


def test_codes_and_names_are_unique() -> None:
    assert len({entry.code for entry in MESSAGES}) == len(MESSAGES) == len({entry.name for entry in MESSAGES})
    assert len({error.name for error in protocol.ERRORS.values()}) == len(protocol.ERRORS)

"""The table of the board's parts: what is made of it, and what it says elsewhere too."""

from firmware_host.generated.parts_header import parts_header
from firmware_host.parts import BOARD_PARTS, GYROSCOPES, MAGNETOMETERS
from rig.config.sensors import sensor_catalogue
from support.board.data_sheet import DataSheet
from support.parts import SHEETS
from support.paths import CONFIGS, FIRMWARE

TAKEN = {"PA2", "PA13", "PA14", "PA15", "PB3", "PB4", "PB5", "PC14", "PC15"}  # serial line, probe, bus, crystal


def test_the_committed_header_is_what_the_table_generates() -> None:
    header = FIRMWARE / "core" / "drivers" / "board_parts.h"
    assert header.read_text(encoding="utf-8") == parts_header(), "again: make -C firmware_host/firmware header"


def test_every_pin_is_one_wire_and_every_line_has_a_number_of_its_own() -> None:
    pins = [pin for part in BOARD_PARTS.values() for pin in (part.select, part.data_ready)]
    assert len(set(pins)) == len(pins) and not TAKEN & set(pins)
    lines = [part.data_ready[2:] for part in BOARD_PARTS.values()]
    assert len(set(lines)) == len(lines) <= 8


def test_the_catalogue_has_the_boards_parts_and_those_with_a_port_of_their_own() -> None:
    on_board = {name for name in sensor_catalogue.PARTS if not sensor_catalogue.has_own_port(name)}
    assert on_board == set(GYROSCOPES)
    assert set(sensor_catalogue.MAGNETOMETERS) == set(MAGNETOMETERS)


def test_every_part_is_in_an_example() -> None:
    examples = "".join(path.read_text(encoding="utf-8") for path in CONFIGS.rglob("*.yaml"))
    assert [name for name in BOARD_PARTS if f"part: {name}" not in examples] == []


def test_what_the_configuration_offers_is_what_the_data_sheet_has() -> None:
    def offered(name: str, sheet: DataSheet) -> bool:
        part = sensor_catalogue.PARTS[name]
        here, there = set(part.rates_hz), set(sheet.rates_hz)  # of some parts the tests have only some, of others all
        ranges = set(part.ranges_deg_s) == set(sheet.per_count_deg_s) and set(part.ranges_g) == set(sheet.per_count_g)
        return ranges and (here <= there or there <= here)

    assert [name for name, sheet in SHEETS.items() if not offered(name, sheet)] == []


def test_who_answers_is_said_with_whom_was_expected() -> None:
    assert GYROSCOPES["icm42688p"].describe_other(0x42) == "an ICM-42605, identity 0x42 instead of 0x47"
    assert GYROSCOPES["mpu9250"].describe_other(0x99) == "an unknown part, identity 0x99 instead of 0x71"
    assert {name: part.who_am_i for name, part in GYROSCOPES.items()} == {
        name: sheet.identity for name, sheet in SHEETS.items()
    }

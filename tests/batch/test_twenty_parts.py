"""Parts in a row at a terminal, by a script in place of the scanner, with troubles that are planted."""

import csv
from pathlib import Path

import pytest

from support.laboratories.commands import configuration
from support.laboratories.scanner import Scanner, station
from support.laboratories.station_laboratory import Laboratory
from support.processes.stopwatch import time_block, times_in_words
from support.processes.system import descendant, grown, resident_kb
from support.processes.waiting import PATIENCE_S, alive, wait_for
from support.processes.warm import start_by_system

PARTS = 20
GROWTH = 0.05  # of 150 MB, by fragmentation; recordings of the parts that stay in memory would be a third
NUMBER = "serial number (Enter alone ends): "
pytestmark = [pytest.mark.slow, pytest.mark.proof, pytest.mark.thorough]


def moves(at: Scanner, laboratory: Laboratory) -> None:
    """Let the part that is mounted go, and wait until the arm moves."""
    at.types("go")
    wait_for(lambda: laboratory("state")["moving"], "the first motion", meanwhile=alive(at.process))


@pytest.mark.timeout(3600)
def test_twenty_parts_in_a_row_each_get_the_right_verdict(tmp_path: Path) -> None:
    """One number twice, one board that is not plugged in, one sweep that is disturbed."""
    numbers = [f"G-{number:03d}" for number in range(1, PARTS + 1)]
    unplugged, disturbed = numbers[1], numbers[2]
    config = configuration(tmp_path, {"world": {"tray": {unplugged: {"plugged_in": False}}}})
    laboratory, out = Laboratory(config), tmp_path / "batch"
    next_s, motion_s = list[float](), list[float]()
    memory_kb, laboratory_kb = list[int](), list[int]()
    with station(config, "--out", out, "--operator", "A. Person", start=start_by_system) as at:
        for number in numbers:
            at.waits_for(NUMBER)
            at.types(number)
            at.waits_for("then Enter")
            at.types("")
            if number == unplugged:
                at.waits_for("again? ")
                assert at.has_printed("no_port")
                at.types("yes")
                at.waits_for("then Enter")
                at.types("")
            at.waits_for("Type go to start, or no: ")
            if number == disturbed:
                laboratory(
                    "pace", time_scale=1
                )  # a busy computer must see the end of the transfer before that of the sweep
            with time_block(motion_s):
                moves(at, laboratory)
            if number == disturbed:
                at.waits_for("done: transfer to the start of sweep wrist_3 cw")
                laboratory.disturb()
                at.waits_for("recorded: ")  # and once more, when the sweeps were repeated
            at.waits_for("recorded: ")
            with time_block(next_s):
                at.sees(NUMBER)
            memory_kb.append(resident_kb(at.process.pid))
            laboratory_kb.append(resident_kb(descendant(at.process.pid, "rig.world")))
            print(f"{number}: {memory_kb[-1]} kB, its laboratory {laboratory_kb[-1]} kB", flush=True)
            if len(memory_kb) == 1:
                at.waits_for(NUMBER)
                at.types(number)
                at.waits_for(f"{number} is done")
                at.waits_for("Continue anyway? ")
                at.types("no")
                at.sees(NUMBER)
        at.types("")
        at.process.wait(PATIENCE_S)
        assert at.process.returncode == 0
    print("to next:", times_in_words(next_s), "\nto the first motion:", times_in_words(motion_s))
    with (out / "batch.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["serial_number"], row["verdict"]) for row in rows] == [(number, "pass") for number in numbers]
    assert [row["serial_number"] for row in rows if row["sweeps_repeated"] != "0"] == [disturbed]
    assert grown(memory_kb) <= GROWTH and grown(laboratory_kb) <= GROWTH

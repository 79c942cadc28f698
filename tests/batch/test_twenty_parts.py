"""Parts in a row at a terminal, by a script in place of the scanner, with troubles that are planted."""

import csv
import os
import time
from pathlib import Path

import pytest

from support.commands import configuration
from support.scanner import Scanner, station
from support.station_laboratory import Laboratory

NEXT_S, FIRST_MOTION_S = 3.0, 2.0
GROWTH = 0.02
pytestmark = [pytest.mark.slow, pytest.mark.proof]


def goes(at: Scanner, laboratory: Laboratory) -> float:
    """Let the part that is mounted go; the time until the arm moves."""
    at.waits_for("Type go to start: ")
    typed_s = at.types("go")
    while not laboratory("state")["moving"]:
        assert time.monotonic() < typed_s + 60
        time.sleep(0.01)
    return time.monotonic() - typed_s


def resident_kb(process: int) -> int:
    """How much memory a process has in use, kB (proc(5))."""
    status = Path(f"/proc/{process}/status").read_text(encoding="ascii")
    return int(status.split("VmRSS:")[1].split()[0])


def without_processor_s(process: int) -> float:
    """How long its main thread was ready to run and had no processor: what a busy machine adds (sched-stats.rst)."""
    _, waited_ns, _ = Path(f"/proc/{process}/schedstat").read_text(encoding="ascii").split()
    return int(waited_ns) * 1e-9


@pytest.mark.thorough
@pytest.mark.timeout(1800)
def test_parts_in_a_row_each_get_the_right_verdict(tmp_path: Path, thorough: bool) -> None:
    """One number twice, one board that is not plugged in, one sweep that is disturbed."""
    count = 20 if thorough else 4
    numbers = [f"G-{number:03d}" for number in range(1, count)]
    numbers.insert(1, "G-001")
    unplugged, disturbed = numbers[2], numbers[3]
    config = configuration(tmp_path, {"world": {"tray": {unplugged: {"plugged_in": False}}}})
    laboratory, out = Laboratory(config), tmp_path / "batch"
    next_s, motion_s, memory = list[float](), list[float](), list[int]()
    with station(config, "--out", out, "--operator", "A. Person") as at:
        for number in numbers:
            at.waits_for("serial number (Enter alone ends): ")
            at.types(number)
            if number == "G-001" and next_s:
                at.waits_for("G-001 is done")
                at.waits_for("Go on all the same? ")
                at.types("no")
                continue
            at.waits_for("then Enter")
            at.types("")
            if number == unplugged:
                at.waits_for("again? ")
                assert at.said("no_port")
                at.types("yes")
                at.waits_for("then Enter")
                at.types("")
            motion_s.append(goes(at, laboratory))
            if number == disturbed:
                at.waits_for("done: transfer to the start of sweep wrist_3 cw")
                laboratory.disturb()
                at.waits_for("recorded: ")  # and once more, when the sweeps were repeated
            at.waits_for("recorded: ")
            ended_s, starved_s = time.monotonic(), without_processor_s(at.process.pid)
            at.sees("serial number (Enter alone ends): ")
            starved_s = without_processor_s(at.process.pid) - starved_s
            next_s.append(time.monotonic() - ended_s - starved_s)
            memory.append(resident_kb(at.process.pid))
        at.types("")
        at.process.wait(60)
        assert at.process.returncode == 0
    print("to next", next_s, "to the first motion", motion_s, "memory", memory)
    with (out / "batch.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["serial_number"] for row in rows] == [n for at, n in enumerate(numbers) if at != 1]
    assert {row["verdict"] for row in rows} == {"pass"}
    assert [row["serial_number"] for row in rows if row["sweeps_repeated"] != "0"] == [disturbed]
    if thorough:
        assert max(motion_s) <= FIRST_MOTION_S
        if os.getloadavg()[0] <= (os.cpu_count() or 1):  # a crowded machine says nothing: processes are started in it
            assert max(next_s) <= NEXT_S
        # The most of a few parts: what is connected ahead comes and goes, and a part with repeated sweeps needs more.
        assert max(memory[-4:]) <= (1 + GROWTH) * max(memory[1:5])

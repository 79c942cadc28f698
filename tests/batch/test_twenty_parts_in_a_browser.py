"""Parts in a row by the keyboard of the station's page, with troubles that are planted."""

import csv
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By

from support.browser import needs_browser, picture, text, typed, until
from support.commands import configuration, wait_for_log
from support.station_laboratory import Laboratory
from support.waiting import wait_for

NEXT_S, FIRST_MOTION_S = 3.0, 2.0
BUSY_S = 400.0  # a busy machine's patience
NUMBER, MOUNT, GO, DOUBT, AGAIN = "serial number", "mount it", "Type go", "Go on all the same", "again?"
pytestmark = [
    pytest.mark.slow, pytest.mark.proof, needs_browser,
    pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere"),
]  # fmt: skip


@contextmanager
def station_with_a_page(config: Path, out: Path, told: Path) -> Iterator[tuple["subprocess.Popen[bytes]", str]]:
    """`rig station --page` without a terminal, and the address that it tells."""
    command = [sys.executable, "-m", "rig", "station", str(config), "--page", "--out", str(out)]
    with (
        told.open("wb") as file,
        subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=file, stderr=file) as process,
    ):
        try:
            lines = wait_for(lambda: [each for each in _lines(told) if each.startswith("page: ")], "its page", 120)
            yield process, lines[0].removeprefix("page: ")
        finally:
            process.kill()


def _lines(told: Path) -> list[str]:
    return told.read_text(encoding="utf-8").splitlines()


def answers(driver: Chrome, question: str, words: str) -> None:
    asks(driver, question)
    typed(driver, words)


def asks(driver: Chrome, question: str) -> None:
    until(lambda: question in text(driver, "text"), f"the question {question!r}", BUSY_S)


@pytest.mark.thorough
@pytest.mark.timeout(2400)
def test_parts_in_a_row_are_worked_off_by_the_keyboard_of_the_page(
    driver: Chrome, tmp_path: Path, thorough: bool
) -> None:
    """One number twice and one board that is not plugged in; of twenty parts one sweep is disturbed as well."""
    numbers = [f"G-{number:03d}" for number in range(1, 20 if thorough else 3)]
    unplugged, disturbed = numbers[1], numbers[2] if thorough else ""
    config = configuration(tmp_path, {"world": {"tray": {unplugged: {"plugged_in": False}}}})
    laboratory, out = Laboratory(config), tmp_path / "batch"
    next_s, motion_s = list[float](), list[float]()
    with station_with_a_page(config, out, tmp_path / "told.txt") as (process, url):
        driver.get(url)
        for at, number in enumerate(numbers, 1):
            folder = out / f"{at:02d}-{number}"
            answers(driver, NUMBER, number)
            answers(driver, MOUNT, "")
            if number == unplugged:
                answers(driver, AGAIN, "yes")
                answers(driver, MOUNT, "")
            answers(driver, GO, "go")
            gone_s = time.monotonic()
            until(lambda: laboratory("state")["moving"], "the first motion", BUSY_S)
            motion_s.append(time.monotonic() - gone_s)
            if number == disturbed:
                wait_for_log(folder, "done: transfer to the start of sweep wrist_3 cw", timeout_s=BUSY_S)
                laboratory.disturb()
            wait_for_log(folder, "recorded: ", timeout_s=BUSY_S, times=2 if number == disturbed else 1)
            recorded_s = time.monotonic()
            asks(driver, NUMBER)
            next_s.append(time.monotonic() - recorded_s)
            if at == 1:
                answers(driver, NUMBER, number)
                answers(driver, DOUBT, "no")
                asks(driver, NUMBER)
        tray = [each.get_attribute("data-is") for each in driver.find_elements(By.CSS_SELECTOR, "#tray li")]
        assert tray == ["pass"] * len(numbers)
        picture(driver, "station-tray")
        answers(driver, NUMBER, "")
        until(lambda: text(driver, "state") == "■ the batch has ended", "the end of the batch")
        assert process.wait(BUSY_S) == 0
        until(lambda: text(driver, "link-words") == "the page has ended", "that the line is closed")
        assert not driver.find_element(By.ID, "stale").is_displayed()
    print("to next", next_s, "to the first motion", motion_s)
    with (out / "batch.csv").open(encoding="utf-8", newline="") as csv_file:
        rows = list(csv.DictReader(csv_file))
    assert [(row["serial_number"], row["verdict"]) for row in rows] == [(number, "pass") for number in numbers]
    assert [row["serial_number"] for row in rows if row["sweeps_repeated"] != "0"] == [disturbed] * thorough
    if thorough and os.getloadavg()[0] <= (os.cpu_count() or 1):  # a crowded machine says nothing
        assert max(motion_s) <= FIRST_MOTION_S and max(next_s) <= NEXT_S

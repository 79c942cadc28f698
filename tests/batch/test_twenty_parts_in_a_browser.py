"""Parts in a row by the keyboard of the station's page, with troubles that are planted."""

import csv
from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By

from support.laboratories.command_with_a_page import start_with_page
from support.laboratories.commands import configuration, wait_for_log
from support.laboratories.station_laboratory import Laboratory
from support.page.browser import needs_browser, picture, text, type_line
from support.processes.stopwatch import time_block, times_in_words
from support.processes.system import grown, resident_kb
from support.processes.waiting import PATIENCE_S, wait_for

PARTS = 20
GROWTH = 0.02
NUMBER, MOUNT, GO, DOUBT, AGAIN = "serial number", "mount it", "Type go", "Continue anyway", "again?"
pytestmark = [
    pytest.mark.slow, pytest.mark.proof, needs_browser,
    pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere"),
]  # fmt: skip


def answers(driver: Chrome, question: str, words: str) -> None:
    asks(driver, question)
    type_line(driver, words)


def asks(driver: Chrome, question: str) -> None:
    wait_for(lambda: question in text(driver, "text"), f"the question {question!r}")


@pytest.mark.thorough
@pytest.mark.timeout(2400)
def test_parts_in_a_row_are_worked_off_by_the_keyboard_of_the_page(
    driver: Chrome, tmp_path: Path, thorough: bool
) -> None:
    """One number twice and one board that is not plugged in; of twenty parts one sweep is disturbed as well."""
    numbers = [f"G-{number:03d}" for number in range(1, PARTS + 1 if thorough else 3)]
    unplugged, disturbed = numbers[1], numbers[2] if thorough else ""
    config = configuration(tmp_path, {"world": {"tray": {unplugged: {"plugged_in": False}}}})
    laboratory, out = Laboratory(config), tmp_path / "batch"
    next_s, motion_s = list[float](), list[float]()
    memory_kb = list[int]()
    with start_with_page(tmp_path / "told.txt", "station", config, "--page", "--out", out) as (process, url):
        driver.get(url)
        for at, number in enumerate(numbers, 1):
            folder = out / f"{at:02d}-{number}"
            answers(driver, NUMBER, number)
            answers(driver, MOUNT, "")
            if number == unplugged:
                answers(driver, AGAIN, "yes")
                answers(driver, MOUNT, "")
            if number == disturbed:
                laboratory(
                    "pace", time_scale=1
                )  # a busy computer must see the end of the transfer before that of the sweep
            answers(driver, GO, "go")
            with time_block(motion_s):
                wait_for(lambda: laboratory("state")["moving"], "the first motion")
            if number == disturbed:
                wait_for_log(folder, "done: transfer to the start of sweep wrist_3 cw")
                laboratory.disturb()
            wait_for_log(folder, "recorded: ", times=2 if number == disturbed else 1)
            with time_block(next_s):
                asks(driver, NUMBER)
            memory_kb.append(resident_kb(process.pid))
            print(f"{number}: {memory_kb[-1]} kB", flush=True)
            if at == 1:
                answers(driver, NUMBER, number)
                answers(driver, DOUBT, "no")
                asks(driver, NUMBER)
        tray = [element.get_attribute("data-is") for element in driver.find_elements(By.CSS_SELECTOR, "#tray li")]
        assert tray == ["pass"] * len(numbers)
        picture(driver, "station-tray")
        answers(driver, NUMBER, "")
        wait_for(lambda: text(driver, "state") == "■ the batch has ended", "the end of the batch")
        assert process.wait(PATIENCE_S) == 0
        wait_for(lambda: text(driver, "link-words") == "the page has ended", "that the line is closed")
        assert not driver.find_element(By.ID, "stale").is_displayed()
    print("to next:", times_in_words(next_s), "\nto the first motion:", times_in_words(motion_s))
    with (out / "batch.csv").open(encoding="utf-8", newline="") as csv_file:
        rows = list(csv.DictReader(csv_file))
    assert [(row["serial_number"], row["verdict"]) for row in rows] == [(number, "pass") for number in numbers]
    assert [row["serial_number"] for row in rows if row["sweeps_repeated"] != "0"] == [disturbed] * thorough
    if thorough:
        assert grown(memory_kb) <= GROWTH

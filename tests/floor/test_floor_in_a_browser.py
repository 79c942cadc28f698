"""The floor in a real browser: what it says of each rig, and where it asks. Look at its picture in build/page."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By

from rig.batch.status import Now
from rig.floor.floor_feed import polled_feed
from rig.history import stations
from rig.history.storage.address import resolve_address
from rig.history.store import open_history
from rig.page.server.control import Control
from rig.page.server.sections import Sections
from rig.page.server.serving import Page, PageAddress, serving
from support.history.past_runs import FIRST, finish_run
from support.page.browser import legible, needs_browser, picture, screen, set_theme, text
from support.processes.waiting import wait_for

pytestmark = [pytest.mark.slow, needs_browser, pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere")]

LINES = """
return [...document.querySelectorAll(arguments[0])].map((e) =>
  Math.round(e.clientHeight / parseFloat(getComputedStyle(e).lineHeight)));
"""
TRAY = (("G-001", "pass"), ("G-002", "fail"), ("G-003", "open"))
SAID = {
    "bench 1": Now("running", "G-003", "sweep wrist_1 cw", 31.6, "A. Person", "W-17", True, {"pass": 1}, TRAY),
    "bench 2": Now("fault", "G-104", "board_link_lost: the cable was pulled out", over=True),
    "bench <b>3</b>": Now("waiting"),
}


@pytest.fixture
def feed(tmp_path: Path) -> Iterator[Sections]:
    where = resolve_address(str(tmp_path / "history.sqlite"))
    days = (datetime.now(UTC) - FIRST).total_seconds() / 86400
    with open_history(where) as history:
        stations.make_table(history.engine)
        for ago in range(6):
            history.enter(finish_run(days - ago, serial_number="CHECK", rig="bench 1", check_standard=True))
        for rig, now in SAID.items():
            stations.tell(history.engine, rig, "lab-1", now.json())
        with polled_feed(where) as found:
            yield found


def test_the_floor_shows_each_rig_and_a_dead_one(driver: Chrome, feed: Sections) -> None:
    with serving(feed, Control(may_answer=False), None, PageAddress(port=0), Page("floor.html")) as url:
        driver.get(url)
        wait_for(lambda: len(cards(driver)) == len(SAID), "a card for each rig")
        assert cards(driver, " h3 span:first-child") == list(SAID)  # a name is text, whatever is in it
        wait_for(lambda: "no sign of life" in cards(driver)[2], "that nothing comes from the third")
        assert "fault" in cards(driver)[1] and "board_link_lost" in cards(driver)[1] and "G-104" in cards(driver)[1]
        wait_for(lambda: "in control" in text(driver, "standards"), "the check standard")
        assert "CHECK" in text(driver, "today") and "None." in text(driver, "recalls")
        picture(driver, "floor")
        for dark in (False, True):
            set_theme(driver, dark=dark)
            legible(driver)
        with screen(driver, 390, 800):
            assert driver.execute_script("return document.documentElement.scrollWidth") <= 390
            cells = driver.find_elements(By.CSS_SELECTOR, "#today td")
            assert [cell.get_attribute("data-label") for cell in cells][1:3] == ["Rig", "Serial number"]
            assert driver.execute_script(LINES, "#today td") == [2] * len(
                cells
            )  # a heading, and a text that is not cut


def cards(driver: Chrome, part: str = "") -> list[str]:
    """What the rigs' cards say, or a part of each; in one go, for they are made anew every second."""
    script = "return [...document.querySelectorAll(arguments[0])].map((each) => each.innerText)"
    found: list[str] = driver.execute_script(script, f".rig{part}")
    return found

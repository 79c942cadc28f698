"""The station's page in a real browser, with its own keyboard. Look at its pictures in build/page."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from queue import SimpleQueue

import pytest
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver import Chrome, Keys
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement

from rig.batch.now import Now, Present
from rig.batch.on_page import OnPage
from rig.batch.operators import Asked
from rig.page.control import Control
from rig.page.sections import Sections
from rig.page.serving import Address, Page, serving
from support.browser import legible, needs_browser, picture, screen, text, until

pytestmark = [pytest.mark.slow, needs_browser, pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere")]

TRAY = (("G-001", "pass"), ("G-002", "fail"), ("<b>G-003</b>", "open"))
NOW = Now("checking", "<b>G-003</b>", "", None, "A. Person", "W-17", True, {"pass": 1, "fail": 1}, TRAY)
WORDS = ("The arm at 127.0.0.2 will move for 29 s.", "Nobody and nothing may be within its reach.")


@contextmanager
def page(present: Present) -> Iterator[tuple[Asked, str]]:
    sections, control = Sections(), Control(may_answer=False)
    voice = OnPage(sections, control)
    present.hears = (voice.hear,)
    voice.hear(present.now)
    with serving(sections, control, None, Address(port=0), Page("station.html", voice.routes)) as url:
        yield Asked(voice), url


@contextmanager
def answered(asked: Asked, *questions: str) -> Iterator["SimpleQueue[object]"]:
    """The station's side, which asks one after the other."""
    answers = SimpleQueue[object]()

    def ask() -> None:
        for kind in questions:
            answers.put(asked.next_part([]) if kind == "number" else asked.agrees(WORDS, "start"))

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    yield answers
    thread.join(30)


def typed(driver: Chrome, words: str) -> None:
    """Typed as a scanner does, wherever the cursor is."""
    driver.switch_to.active_element.send_keys(words, Keys.ENTER)


def replaced(button: WebElement) -> bool:
    """Whether the next question has taken the place of the one that the button belongs to."""
    try:
        button.is_enabled()
    except StaleElementReferenceException:
        return True
    return False


def test_a_number_is_scanned_and_go_is_typed_or_ticked(driver: Chrome) -> None:
    with page(Present(NOW)) as (asked, url), answered(asked, "number", "go", "go") as answers:
        driver.get(url)
        until(lambda: "serial number" in text(driver, "text"), "the question for a number")
        assert text(driver, "part") == "<b>G-003</b>" and "A. Person" in text(driver, "who")
        assert [each.text for each in driver.find_elements(By.CSS_SELECTOR, "#tray li strong")] == ["✓", "✗", "◉"]
        legible(driver)
        picture(driver, "station-number")
        typed(driver, "G-004")
        assert answers.get(timeout=30) == "G-004"
        until(lambda: "Type go" in text(driver, "text"), "the question whether to go")
        assert all(each in text(driver, "lines") for each in WORDS)
        typed(driver, "G-005")  # scanned too early: no answer
        until(lambda: "answers nothing" in text(driver, "hint"), "that a number is no answer")
        assert answers.empty()
        picture(driver, "station-go")
        with screen(driver, 390, 800):
            assert driver.execute_script("return document.documentElement.scrollWidth") <= 390
        answered_go = driver.find_element(By.CSS_SELECTOR, "#buttons .go")
        typed(driver, "go")
        assert answers.get(timeout=30) is True
        until(lambda: replaced(answered_go), "the next question")
        assert not driver.find_element(By.CSS_SELECTOR, "#buttons .go").is_enabled()
        driver.find_element(By.ID, "clear").click()
        driver.find_element(By.CSS_SELECTOR, "#buttons .go").click()
        assert answers.get(timeout=30) is True
        until(lambda: not driver.find_element(By.ID, "ask").is_displayed(), "that nothing is asked")

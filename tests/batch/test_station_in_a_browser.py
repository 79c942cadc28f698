"""The station's page in a real browser, with its own keyboard. Look at its pictures in build/page."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from queue import SimpleQueue

import pytest
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement

from rig.batch.batch_state import BatchPart, Begun, PartBegun, PartEnded, state_of
from rig.batch.operators import Operator
from rig.batch.page_operator import open_page
from rig.batch.status import Now, Present
from rig.motion.steps import Rest
from rig.page.server.control import STOP_REASON
from rig.page.server.serving import PageAddress
from rig.station.events import Interrupted, Progress, SamplesTaken, SensorSamples
from support.page.browser import legible, needs_browser, picture, screen, set_theme, text, type_line
from support.processes.waiting import PATIENCE_S, wait_for

pytestmark = [pytest.mark.slow, needs_browser, pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere")]

AT = "2026-11-25T08:00:00+00:00"
TRAY = (("G-001", "pass"), ("G-002", "fail"), ("<b>G-003</b>", "open"))
NOW = Now("checking", "<b>G-003</b>", "", None, "A. Person", "W-17", True, {"pass": 1, "fail": 1}, TRAY)
WORDS = ("The arm at 127.0.0.2 will move for 29 s.", "Nobody and nothing may be within its reach.")


FILLED = "return document.querySelector('main').lastElementChild.getBoundingClientRect().bottom / innerHeight"


@contextmanager
def answered(asked: Operator, *questions: str) -> Iterator["SimpleQueue[object]"]:
    """The station's side, which asks one after the other."""
    answers = SimpleQueue[object]()

    def ask() -> None:
        for kind in questions:
            answers.put(asked.next_part([]) if kind == "number" else asked.agrees(WORDS, "start"))

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    yield answers
    thread.join(PATIENCE_S)


def replaced(button: WebElement) -> bool:
    """Whether the next question has taken the place of the one that the button belongs to."""
    try:
        button.is_enabled()
    except StaleElementReferenceException:
        return True
    return False


def has_theme(driver: Chrome, theme: str) -> bool:
    return bool(driver.execute_script("return document.documentElement.dataset.theme") == theme)


def test_a_number_is_scanned_and_go_is_typed_or_ticked(driver: Chrome) -> None:
    questions = "number", "go", "go"
    with open_page(Present(NOW), PageAddress(port=0)) as (voice, url), answered(Operator(voice), *questions) as answers:
        driver.get(url)
        wait_for(lambda: "serial number" in text(driver, "text"), "the question for a number")
        assert text(driver, "part") == "<b>G-003</b>" and "A. Person" in text(driver, "who")
        assert [element.text for element in driver.find_elements(By.CSS_SELECTOR, "#tray li strong")] == ["✓", "✗", "◉"]
        for theme in ("light", "dark"):
            set_theme(driver, dark=theme == "dark")
            wait_for(partial(has_theme, driver, theme), f"a {theme} page")
            legible(driver)
        picture(driver, "station-number")
        send = driver.find_element(By.ID, "send")
        assert send.text == "End the batch"  # what an empty answer does
        driver.find_element(By.ID, "said").send_keys("G")
        assert send.text == "Enter"
        type_line(driver, "-004")
        assert answers.get(timeout=PATIENCE_S) == "G-004"
        wait_for(lambda: "Type go" in text(driver, "text"), "the question whether to go")
        assert all(word in text(driver, "lines") for word in WORDS)
        type_line(driver, "G-005")  # scanned too early: no answer
        wait_for(lambda: "does not answer" in text(driver, "hint"), "that a number is no answer")
        assert answers.empty()
        picture(driver, "station-go")
        with screen(driver, 390, 800):
            assert driver.execute_script("return document.documentElement.scrollWidth") <= 390
        answered_go = driver.find_element(By.CSS_SELECTOR, "#buttons .go")
        type_line(driver, "go")
        assert answers.get(timeout=PATIENCE_S) is True
        wait_for(lambda: replaced(answered_go), "the next question")
        assert not driver.find_element(By.CSS_SELECTOR, "#buttons .go").is_enabled()
        driver.find_element(By.ID, "clear").click()
        driver.find_element(By.CSS_SELECTOR, "#buttons .go").click()
        assert answers.get(timeout=PATIENCE_S) is True
        wait_for(lambda: not driver.find_element(By.ID, "ask").is_displayed(), "that nothing is asked")


def test_a_run_shows_its_progress_and_a_verdict_stands_until_the_next_number(driver: Chrome) -> None:
    present = Present(NOW)
    with open_page(present, PageAddress(port=0)) as (_, url):
        driver.get(url)
        present.event(Progress(2, 4, Rest("rest", 10.0), 0.5, 15.0, 45.0, 1.0471975511965976))
        present.event(SamplesTaken((SensorSamples("gyro", 200, 1, {}),)))
        wait_for(lambda: "200 samples, 1 lost" in text(driver, "rates"), "the samples")
        assert "25 %" in text(driver, "rates") and "60 °/s" in text(driver, "rates")
        picture(driver, "station-running")
        for size in ((1280, 800), (1920, 1080), (768, 1024)):
            with screen(driver, *size):
                assert 0.9 < driver.execute_script(FILLED) <= 1, size
        begun = PartBegun("G-003", "03-G-003", AT)
        present.batch(state_of([Begun("", "", AT), begun, PartEnded("fail", AT, "gyro.bias is too large")]))
        wait_for(lambda: "FAIL" in text(driver, "verdict"), "the verdict")
        assert (text(driver, "part"), text(driver, "why")) == ("G-003", "gyro.bias is too large")
        assert not driver.find_element(By.ID, "run").is_displayed()
        part_px, verdict_px = (
            float(driver.find_element(By.ID, name).value_of_css_property("font-size")[:-2])
            for name in ("part", "verdict")
        )
        assert verdict_px > part_px
        with screen(driver, 390, 800):
            assert driver.execute_script("return document.documentElement.scrollWidth") <= 390
        picture(driver, "station-verdict")


def test_after_a_stop_the_page_says_that_and_not_that_there_is_no_news(driver: Chrome) -> None:
    present = Present(NOW)
    with pytest.raises(KeyboardInterrupt), open_page(present, PageAddress(port=0)) as (voice, url):
        driver.get(url)
        wait_for(lambda: "checks" in text(driver, "state"), "what the station does")
        stop = driver.find_element(By.ID, "halt")
        try:
            threading.Timer(0, stop.click).start()
            Operator(voice, asking=present.asking).is_mounted(
                BatchPart(1, "G-003", "01-G-003", "2026-11-25T08:00:00+00:00")
            )
        except KeyboardInterrupt as interrupt:
            present.event(Interrupted(f"{interrupt} between two parts"))
            raise
    wait_for(lambda: text(driver, "link-words") == "the page has ended", "that the line is closed")
    assert text(driver, "state") == "■ stopped" and text(driver, "doing") == f"{STOP_REASON} between two parts"
    shown = [each for each in ("stale", "halt", "ask") if driver.find_element(By.ID, each).is_displayed()]
    assert not shown
    picture(driver, "station-stopped")

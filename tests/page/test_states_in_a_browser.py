"""Every state of the page in a real browser, of runs that nobody made. Look at its pictures in build/page."""

import re
import socket
from collections.abc import Callable, Iterable
from functools import partial
from importlib import resources
from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By

from rig.errors import Fault, Refused
from rig.page.page_state import PageState
from rig.page.server.control import Control
from rig.page.server.feed import Feed
from rig.page.server.serving import PageAddress, serving
from rig.station.events import Answered, Crashed, Failed, Interrupted, PhaseRecorded, Prompt, RunEvent, SensorSamples
from support.page import scripted_runs
from support.page.browser import (
    TABLET,
    kind,
    legible,
    list_requested_hosts,
    needs_browser,
    picture,
    set_theme,
    severe,
    text,
)
from support.page.scripted_page import showing
from support.page.scripted_runs import ABOUT, before_it_moves, judge, moving, plan_demo
from support.processes.waiting import wait_for

pytestmark = [pytest.mark.slow, needs_browser, pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere")]

ANNOUNCED = (
    "The arm at 127.0.0.2 will move for 66 s.",
    "Nobody and nothing may be within its reach; the sensor's cable needs slack for a whole turn either way.",
)


def in_state(driver: Chrome, state: str) -> bool:
    return kind(driver) == state


WHILE_IT_RUNS = ["connecting", "connected", "ready", "moving", "measuring", "resting", "judging"]
STOPPED = "stopped from the page; the arm stands still; the data are kept in a run. Go on with: rig resume 'a run'"
REFUSED = Refused("speed_slider", "the speed slider is at 50 %", "Set it to 100 %")
GONE = Fault("board_link_lost", "the board on /dev/ttyACM0 has gone", "Check its cable")
TRACEBACK = "Traceback (most recent call last):\n  …\nZeroDivisionError: division by zero\n"
ENDINGS: dict[str, tuple[str, str, Callable[[Path], Iterable[RunEvent]]]] = {
    "failed": ("FAIL", "4 of 5 checks passed", lambda folder: judge(folder, passed=False)),
    "refused": ("Refused", str(REFUSED), lambda _: [Failed(REFUSED)]),
    "fault": ("Fault", str(GONE), lambda _: [Failed(GONE)]),
    "defect": ("Fault", "A defect of the program: ZeroDivisionError: division by zero", lambda _: [Crashed(TRACEBACK)]),
    "stopped": ("Stopped", STOPPED, lambda _: [Interrupted(STOPPED)]),
}


def test_no_state_is_without_a_picture() -> None:
    script = (resources.files("rig.page") / "static" / "page.js").read_text(encoding="utf-8")
    words = script[script.index("const WORDS") : script.index("};", script.index("const WORDS"))]
    elsewhere = "by_hand"  # in test_by_hand_in_a_browser.py
    assert {*WHILE_IT_RUNS, *ENDINGS, "asking", "passed", elsewhere} == {*re.findall(r"(\w+): \[", words), "defect"}


def test_every_state_of_a_run_has_its_word_and_its_sign(driver: Chrome, tmp_path: Path) -> None:
    plan, recorded = plan_demo(), PhaseRecorded((SensorSamples("gyro", 14280, 0, {"rate": (0.0, 0.0, 0.0)}),), 0)
    connected, *until_asked = before_it_moves(plan)
    before: dict[str, list[RunEvent]] = {
        "connecting": [],
        "connected": [connected, until_asked[0]],
        "ready": until_asked[1:],
    }
    moves = {"moving": moving(plan, 1.0), "measuring": moving(plan, 7.0), "resting": moving(plan, 10.0)}
    with showing(driver, tmp_path) as tell:
        for state, events in (*before.items(), *moves.items(), ("judging", [recorded])):
            tell(*events)
            wait_for(partial(in_state, driver, state), state)
            wait_for(lambda: all(text(driver, part) for part in ("state-word", "sign", "state-text")), "word and sign")
            picture(driver, state)


CUT_PANELS = """return [...document.querySelectorAll("details")]
  .filter((panel) => panel.checkVisibility() && panel.scrollWidth > panel.clientWidth + 1)
  .map((panel) => panel.querySelector("h2").textContent)"""


def test_a_run_is_shown_from_the_question_to_the_verdict(driver: Chrome, tmp_path: Path) -> None:
    plan = plan_demo()
    (tmp_path / "certificate.html").write_text("<title>Certificate</title>", encoding="utf-8")

    with showing(driver, tmp_path) as tell:
        tell(*before_it_moves(plan), Prompt(ANNOUNCED))
        tell.word("Your answer is needed")
        assert text(driver, "prompt-words").splitlines() == list(ANNOUNCED)
        assert driver.switch_to.active_element.get_attribute("id") == "prompt-title"
        legible(driver)
        picture(driver, "prompt-dark")
        newest = driver.find_elements(By.CSS_SELECTOR, "#lines li")[-1]
        tell(Answered(agreed=True), *moving(plan, 52.0))
        tell.look(4)
        tell.word("Resting")
        lines = driver.find_elements(By.CSS_SELECTOR, "#lines li")
        assert newest in lines and newest != lines[-1]  # still the same one: it is not read out again
        assert not driver.find_element(By.ID, "prompt").is_displayed()
        wait_for(lambda: "Step 13 of 16" in text(driver, "step-number"), "the step")
        assert text(driver, "left").startswith("0:15")
        assert driver.find_element(By.ID, "bar").get_attribute("aria-valuetext") == "step 13 of 16, 0:15 left"
        plots = driver.find_elements(By.CSS_SELECTOR, ".plot canvas")
        assert [re.split(" over", plot.get_attribute("aria-label") or "")[0] for plot in plots] == [
            "gyro, rate", "reference, rate", "reference, acceleration",
        ]  # fmt: skip
        assert scripted_runs.SATURATED in text(driver, "observations") and "0.90661" in text(driver, "observations")
        assert all(words in text(driver, "dwells") for words in ("at -90 -90 0, +z up", "9.8142", scripted_runs.SHAKEN))
        assert "no scale factors yet" in text(driver, "parameters") and "0.00064" in text(driver, "parameters")
        assert "3 ⚠" in text(driver, "samples") and not driver.execute_script(CUT_PANELS)
        picture(driver, "moving-dark")
        picture(driver, "moving-dark-whole", whole=True)
        legible(driver)
        set_theme(driver, dark=False)
        legible(driver)
        picture(driver, "moving-light")
        driver.set_window_size(800, 1280)
        picture(driver, "moving-light-upright", whole=True)
        assert driver.execute_script("return document.documentElement.scrollWidth <= innerWidth")
        driver.set_window_size(*TABLET)
        set_theme(driver, dark=True)
        tell.look(6)
        tell(*judge(tmp_path, passed=True))
        tell.word("PASS")
        assert text(driver, "state-text") == "5 of 5 checks passed" and "✓ passed" in text(driver, "checks")
        assert not driver.find_element(By.ID, "halt").is_displayed()
        picture(driver, "pass-dark")
        driver.find_element(By.ID, "certificate").click()
        wait_for(lambda: len(driver.window_handles) == 2, "the certificate")
        driver.switch_to.window(driver.window_handles[1])
        wait_for(lambda: driver.title == "Certificate", "the certificate")
        driver.close()
        driver.switch_to.window(driver.window_handles[0])
    wait_for(lambda: "this is its last state" in text(driver, "link"), "the end of the line")
    tell.word("PASS")


@pytest.mark.one_in(3)  # a run that failed and a defect; a stopped one ends in test_page_in_a_browser.py
@pytest.mark.parametrize("ending", ENDINGS)
def test_other_endings_say_why(driver: Chrome, tmp_path: Path, ending: str) -> None:
    plan = plan_demo()
    word, why, last = ENDINGS[ending]
    set_theme(driver, dark=ending != "failed")
    with showing(driver, tmp_path) as tell:
        tell(*before_it_moves(plan), *moving(plan, 30.0), *last(tmp_path))
        tell.word(word)
        assert text(driver, "state-text") == why
        assert not driver.find_element(By.ID, "halt").is_displayed()
        picture(driver, ending)


ELSEWHERE = {True: "Answer it at the terminal, not here.", False: "This address lacks its token"}


@pytest.mark.parametrize("token", ELSEWHERE)
def test_a_question_for_somebody_else_has_no_buttons(driver: Chrome, tmp_path: Path, token: bool) -> None:
    with showing(driver, tmp_path, token=token, may_answer=not token) as tell:
        tell(*before_it_moves(plan_demo()), Prompt(ANNOUNCED))
        tell.word("Your answer is needed")
        assert text(driver, "prompt-elsewhere").startswith(ELSEWHERE[token])
        assert not driver.find_element(By.ID, "yes").is_displayed()
        assert driver.find_element(By.ID, "halt").is_displayed() == token
        picture(driver, "asked-at-the-terminal" if token else "asked-without-token")


def test_a_line_that_is_lost_makes_all_of_it_old(driver: Chrome, tmp_path: Path) -> None:
    plan = plan_demo()
    with showing(driver, tmp_path) as tell:
        tell(*before_it_moves(plan), *moving(plan, 52.0))
        tell.word("Resting")
        assert text(driver, "link-words") == "connected"
    wait_for(lambda: text(driver, "link-words") == "no connection: the values shown are old", "that the line is down")
    picture(driver, "line-lost")
    driver.get("about:blank")  # so that it asks no longer
    assert all("ERR_CONNECTION_REFUSED" in entry for entry in severe(driver))


@pytest.mark.thorough
def test_an_address_of_this_computer_without_its_token_shows_nothing_and_says_so(
    driver: Chrome, tmp_path: Path
) -> None:
    host = own_address()
    severe(driver), list_requested_hosts(driver)  # of before
    feed = Feed(PageState(ABOUT))
    feed.event(Prompt(ANNOUNCED))
    address = PageAddress(host, 0, "a-token-of-forty-characters-and-no-other")
    with serving(feed, Control(may_answer=True), tmp_path, address) as url:
        driver.get(url.split("#")[0])
        wait_for(lambda: "lacks its token" in text(driver, "link-words"), "what is missing")
        assert text(driver, "state-word") == "Not shown" and text(driver, "state-text") == text(driver, "link-words")
        picture(driver, "without-token")
        assert [("403" in entry, "/events" in entry) for entry in severe(driver)] == [(True, True)]  # it asks but once
        driver.get(url)
        wait_for(lambda: text(driver, "state-word") == "Your answer is needed", "the question")
        assert text(driver, "prompt-tick") == Prompt(ANNOUNCED).to_tick
        assert list_requested_hosts(driver) == {host}


def own_address() -> str:
    """An address of this computer that is not loopback. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        try:
            asking.connect(("192.0.2.200", 9))
        except OSError:
            pytest.skip("this computer has no address but loopback")
        return str(asking.getsockname()[0])

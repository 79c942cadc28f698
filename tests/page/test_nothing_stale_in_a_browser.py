"""What is over, or what nobody tells any more, does not look as if it went on."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from selenium.webdriver import Chrome

from rig.errors import Fault
from rig.motion.turner_state import ArmState, RuntimeState
from rig.station.events import ArmSeen, Failed, Interrupted, PhaseRecorded, RunEvent, SensorSamples
from support.page.browser import kind, legible, needs_browser, picture, severe, text
from support.page.scripted_page import showing
from support.page.scripted_runs import before_it_moves, judge, moving, plan_demo
from support.paths import ROOT
from support.processes.waiting import wait_for

pytestmark = [pytest.mark.slow, needs_browser, pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere")]

STOPPED = "stopped from the page; the arm is stopped and at rest; the data are kept in a run"
GONE = Fault("arm_link_lost", "the arm at 127.0.0.2 has been silent for 0.8 s", "Look at the arm")
# Everything that is to be read or heard on the page but for the list of what was said, place by place.
TEXTS = """
const seen = [["title", document.title]], clock = document.querySelector("#clock");
if (clock.checkVisibility()) seen.push(["clock", clock.textContent]);
const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_ELEMENT);
while (texts.nextNode()) {
  const e = texts.currentNode;
  if (!e.checkVisibility() || e.closest("#lines, noscript, .skip, thead, [hidden]")) continue;
  const own = [...e.childNodes].filter((n) => n.nodeType === 3).map((n) => n.textContent.trim()).join(" ").trim();
  for (const words of [own, e.getAttribute("aria-label"), e.getAttribute("aria-valuetext")])
    if (words) seen.push([e.id || e.parentElement.id || e.className || e.tagName, words]);
}
return seen;
"""
# Nothing that is over says this: that it moves, that it is now, how long it lasts yet, that somebody is there.
ALIVE = re.compile(r"\bnow\b|playing|^(Moving|Measuring|Resting)|^connected$|\d ?left|▸|^Step \d")
SPEED = re.compile(r"[1-9]\d*\.\d °/s")  # of an arm that turns


def says(driver: Chrome) -> list[tuple[str, str]]:
    return [(place, words) for place, words in driver.execute_script(TEXTS)]


def contradictions(driver: Chrome) -> list[tuple[str, str]]:
    """What is said as if it went on: by state, clock, step, light, title, readings, arm and joints."""
    found = [(place, words) for place, words in says(driver) if ALIVE.search(words)]
    found += [("arm", words) for words in [text(driver, "arm-facts")] if SPEED.search(words)]
    speeds = driver.execute_script(
        "return [...document.querySelectorAll('#joints td:last-child')].map((e) => e.textContent)"
    )
    found += [("joint", speed) for speed in speeds if re.search("[1-9]", speed)]
    ages = driver.execute_script("return [...document.querySelectorAll('.plot .age')].map((e) => e.textContent)")
    assert len(ages) == 3
    return found + [("age", "none") for age in ages if not age]


def let_go(events: list[RunEvent]) -> ArmSeen:
    """The arm where it was seen last, at rest, and its program ended."""
    seen = [event.state for event in events if isinstance(event, ArmSeen)][-1]
    assert isinstance(seen, ArmState)
    return ArmSeen(replace(seen, qd_rad_s=(0.0,) * 6, runtime_state=RuntimeState.STOPPED), 0)


def sweeping() -> list[RunEvent]:
    return [*before_it_moves(plan_demo()), *moving(plan_demo(), 7.0)]


def test_a_run_that_goes_on_is_alive_by_the_same_reading(driver: Chrome, tmp_path: Path) -> None:
    """Or the tests below would find nothing for want of looking."""
    with showing(driver, tmp_path) as tell:
        tell(*sweeping())
        tell.word("Measuring")
        places = {place for place, words in says(driver) if ALIVE.search(words)}
        assert {"title", "link-words", "state-word", "clock", "bar", "step-number"} <= places
        wait_for(lambda: SPEED.search(text(driver, "arm-facts")), "the arm's speed")
        assert "playing" in text(driver, "arm-facts")
        assert not driver.execute_script("return document.querySelector('.plot .age').textContent")
        assert contradictions(driver) and not driver.find_element("id", "stale").is_displayed()


@pytest.mark.one_in(4)  # of a run that was judged, test_first_screen_in_a_browser.py holds it too
@pytest.mark.parametrize("how", ["stopped", "passed", "failed", "arm lost"])
def test_after_the_end_no_text_says_that_it_goes_on(driver: Chrome, tmp_path: Path, how: str) -> None:
    moved = sweeping()
    recorded = PhaseRecorded((SensorSamples("gyro", 14280, 0, {"rate": (0.0, 0.0, 0.0)}),), 0)
    ends: dict[str, list[RunEvent]] = {
        "stopped": [let_go(moved), Interrupted(STOPPED)],
        "passed": [recorded, let_go(moved), *judge(tmp_path, passed=True)],
        "failed": [recorded, let_go(moved), *judge(tmp_path, passed=False)],
        "arm lost": [Failed(GONE)],
    }
    with showing(driver, tmp_path) as tell:
        tell(*moved)
        tell.word("Measuring")
        tell(*ends[how])
        wait_for(lambda: kind(driver) == {"arm lost": "fault"}.get(how, how), how)
        wait_for(lambda: "as at " in text(driver, "readings"), "when that was")
        consistent(driver)
        assert re.fullmatch(r"the run ended at [\d:]{8}", text(driver, "link-words"))
        speed, program = facts(driver)["speed"], facts(driver)["program"]
        assert (speed, program) == (("–", "–") if how == "arm lost" else ("0.0 °/s", "stopped"))
        picture(driver, f"over-{how.replace(' ', '-')}")
        legible(driver)
        driver.refresh()  # who comes later is told the same
        wait_for(lambda: "as at " in text(driver, "readings"), "when that was")
        consistent(driver)
    wait_for(lambda: "this is its last state" in text(driver, "link"), "the end of the line")
    consistent(driver)


def consistent(driver: Chrome) -> None:
    """What is drawn and named at the next frame is as what is written at once."""
    wait_for(lambda: not contradictions(driver), f"that nothing contradicts it: {contradictions(driver)}")


FACTS = """
return [...document.querySelectorAll("#arm-facts > div")].map((e) => [...e.children].map((c) => c.textContent));
"""


def facts(driver: Chrome) -> dict[str, str]:
    return dict(driver.execute_script(FACTS))


def test_while_it_is_solved_the_readings_have_their_age(driver: Chrome, tmp_path: Path) -> None:
    moved = sweeping()
    recorded = PhaseRecorded((SensorSamples("gyro", 14280, 0, {"rate": (0.0, 0.0, 0.0)}),), 0)
    with showing(driver, tmp_path) as tell:
        tell(*moved, recorded, let_go(moved))
        tell.word("Solving")
        wait_for(lambda: re.search(r"\d s ago", text(driver, "readings")), "their age")
        assert facts(driver)["speed"] == "0.0 °/s" and facts(driver)["program"] == "stopped"
        assert not driver.find_element("id", "stale").is_displayed()


def test_a_run_that_falls_silent_while_it_moves_is_not_to_be_trusted(driver: Chrome, tmp_path: Path) -> None:
    with showing(driver, tmp_path) as tell:
        tell(*sweeping())
        tell.word("Measuring")
        tell.silent.set()
        untrusted(driver)
        assert driver.find_element("id", "halt").is_displayed()


def test_a_line_that_is_lost_says_nothing_of_now(driver: Chrome, tmp_path: Path) -> None:
    with showing(driver, tmp_path) as tell:
        tell(*sweeping())
        tell.word("Measuring")
    untrusted(driver)
    wait_for(lambda: text(driver, "link-words").startswith("no connection"), "the light")
    driver.get("about:blank")  # so that it asks no longer
    assert all("ERR_CONNECTION_REFUSED" in entry for entry in severe(driver))


@pytest.fixture
def page_of_its_own() -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """A process that moves on a page, and the page's address."""
    paths = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
    process = subprocess.Popen(
        [sys.executable, "-m", "support.page.scripted_page"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": paths},
    )
    assert process.stdout is not None
    yield process, process.stdout.readline().strip()
    process.kill()
    process.communicate()


def test_a_process_that_is_halted_is_not_to_be_trusted_until_it_goes_on(
    driver: Chrome, page_of_its_own: tuple["subprocess.Popen[str]", str]
) -> None:
    process, url = page_of_its_own
    driver.get(url)
    wait_for(lambda: text(driver, "state-word") in ("Moving", "Measuring", "Resting"), "motion")
    process.send_signal(signal.SIGSTOP)
    untrusted(driver)
    process.send_signal(signal.SIGCONT)
    wait_for(lambda: text(driver, "state-word") in ("Moving", "Measuring", "Resting"), "motion again")
    wait_for(lambda: not driver.find_element("id", "stale").is_displayed(), "that it is trusted again")
    driver.get("about:blank")


def untrusted(driver: Chrome) -> None:
    """The bar stands there, and nothing beside it says otherwise."""
    said = r"No news for \d+ s\s+– do not trust this page, look at the arm"
    wait_for(lambda: re.search(said, text(driver, "stale")), "the bar")
    consistent(driver)
    assert text(driver, "state-word") == "No news" and facts(driver)["speed"] == "–"
    assert text(driver, "state-text").startswith("Last message: ")
    picture(driver, "no-news")
    legible(driver)

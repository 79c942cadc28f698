"""The operator's page in a real browser. Its pictures lie in build/page and are meant to be looked at."""

import json
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from rig.arm.state import REST_SPEED_RAD_S
from rig.data.run_file import read_run
from rig.errors import Refused
from rig.page.control import Control
from rig.page.feed import Feed
from rig.page.serving import Address, serving
from rig.page.shown import Shown
from rig.station.events import Answered, Failed, Interrupted, Prompt
from support import told_runs
from support.browser import TABLET, asked_hosts, browser, needs_browser, picture, set_theme, severe
from support.commands import configuration, rig
from support.told_runs import ABOUT, before_it_moves, judged, look, moving, planned
from support.worlds import World, hardware

pytestmark = [pytest.mark.slow, needs_browser]

ANNOUNCED = (
    "The arm at 127.0.0.2 will move for 66 s.",
    "Nobody and nothing may be within its reach; the sensor's cable needs slack for a whole turn either way.",
)


@pytest.fixture(scope="module")
def driver() -> Iterator[Chrome]:
    with browser(dark=True) as found:
        yield found


@pytest.fixture(autouse=True)
def nothing_severe_and_nothing_from_elsewhere(driver: Chrome) -> Iterator[None]:
    driver.set_window_size(*TABLET)
    yield
    assert severe(driver) == [] and asked_hosts(driver) <= {"127.0.0.1"}


def text(driver: Chrome, element: str) -> str:
    return driver.find_element(By.ID, element).text


def until(true: Callable[[], Any], what: str, within_s: float = 120.0) -> Any:
    deadline_s = time.monotonic() + within_s
    while not (found := true()):
        assert time.monotonic() < deadline_s, f"never: {what}"
        time.sleep(0.05)
    return found


def kind(driver: Chrome) -> str:
    return str(driver.execute_script("return document.body.dataset.kind"))


def test_every_state_has_its_word_its_sign_and_its_picture(driver: Chrome, tmp_path: Path) -> None:
    plan, feed = planned(), Feed(Shown(ABOUT))
    (tmp_path / "certificate.html").write_text("<title>Certificate</title>", encoding="utf-8")

    def tell(*events: Any) -> None:
        for event in events:
            feed.event(event)

    def word(expected: str) -> None:
        until(lambda: text(driver, "state-word") == expected, f"{expected}, not {text(driver, 'state-word')}")
        assert text(driver, "sign")

    with serving(feed, Control(may_answer=True), tmp_path, Address(port=0)) as url:
        driver.get(url)
        tell(*before_it_moves(plan), Prompt(ANNOUNCED))
        word("Your answer is needed")
        assert text(driver, "prompt-words").splitlines() == list(ANNOUNCED)
        assert driver.switch_to.active_element.get_attribute("id") == "prompt-title"
        picture(driver, "prompt-dark")
        tell(Answered(agreed=True), *moving(plan, 52.0))
        feed.look(look(plan, 4))
        word("Resting")
        assert not driver.find_element(By.ID, "prompt").is_displayed()
        until(lambda: "Step 13 of 16" in text(driver, "step-number"), "the step")
        assert text(driver, "left").startswith("0:15")
        assert driver.find_element(By.ID, "bar").get_attribute("aria-valuetext") == "step 13 of 16, 0:15 left"
        plots = driver.find_elements(By.CSS_SELECTOR, ".plot canvas")
        assert [re.split(" over", plot.get_attribute("aria-label") or "")[0] for plot in plots] == [
            "gyro, rate", "reference, rate", "reference, acceleration",
        ]  # fmt: skip
        assert told_runs.SATURATED in text(driver, "observations") and "0.90661" in text(driver, "observations")
        assert all(words in text(driver, "dwells") for words in ("at -90 -90 0, +z up", "9.8142", told_runs.SHAKEN))
        assert "no scale factors yet" in text(driver, "parameters") and "0.00064" in text(driver, "parameters")
        assert "3 ⚠" in text(driver, "samples")
        picture(driver, "moving-dark")
        picture(driver, "moving-dark-whole", whole=True)
        set_theme(driver, dark=False)
        picture(driver, "moving-light")
        driver.set_window_size(800, 1280)
        picture(driver, "moving-light-upright", whole=True)
        assert driver.execute_script("return document.documentElement.scrollWidth <= innerWidth")
        driver.set_window_size(*TABLET)
        set_theme(driver, dark=True)
        feed.look(look(plan, 6))
        tell(*judged(tmp_path, passed=True))
        word("PASS")
        assert text(driver, "state-text") == "5 of 5 checks passed" and "✓ passed" in text(driver, "checks")
        assert not driver.find_element(By.ID, "halt").is_displayed()
        picture(driver, "pass-dark")
        driver.find_element(By.ID, "certificate").click()
        until(lambda: len(driver.window_handles) == 2, "the certificate")
        driver.switch_to.window(driver.window_handles[1])
        until(lambda: driver.title == "Certificate", "the certificate")
        driver.close()
        driver.switch_to.window(driver.window_handles[0])
    until(lambda: "this is how it ended" in text(driver, "link"), "the end of the line")
    word("PASS")


@pytest.mark.parametrize("ending", ["fail", "refused", "stopped"])
def test_other_endings_say_why(driver: Chrome, tmp_path: Path, ending: str) -> None:
    plan, feed = planned(), Feed(Shown(ABOUT))
    refusal = Refused("slider_below_100", "the speed slider stands at 50 %", "Set it to 100 %")
    stopped = "stopped from the page; the arm stands still; the data are kept in a run. Go on with: rig resume 'a run'"
    events: dict[str, list[Any]] = {
        "fail": [*moving(plan, 100.0), *judged(tmp_path, passed=False)],
        "refused": [Failed(refusal)],
        "stopped": [*moving(plan, 30.0), Interrupted(stopped)],
    }
    words = {"fail": "FAIL", "refused": "Refused", "stopped": "Stopped"}
    reasons = {"fail": "4 of 5 checks passed", "refused": str(refusal), "stopped": stopped}
    set_theme(driver, dark=ending != "fail")
    with serving(feed, Control(may_answer=False), tmp_path, Address(port=0)) as url:
        driver.get(url)
        for event in [*before_it_moves(plan), *events[ending]]:
            feed.event(event)
        until(lambda: text(driver, "state-word") == words[ending], words[ending])
        assert text(driver, "state-text") == reasons[ending]
        picture(driver, ending)


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Callable[..., tuple["subprocess.Popen[str]", str]]]:
    """Starts `rig … --page` and gives the process and the page's address."""
    running: list[subprocess.Popen[str]] = []

    def start(*arguments: str | Path) -> tuple["subprocess.Popen[str]", str]:
        command = [sys.executable, "-m", "rig", *map(str, arguments), "--page-address", "127.0.0.1:0"]
        told = tmp_path / f"stderr-{len(running)}"
        with told.open("w", encoding="utf-8") as errors:
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors, text=True
            )
        running.append(process)
        found = until(lambda: re.search(r"^page: (\S+)$", told.read_text(encoding="utf-8"), re.M), "the address")
        return process, found[1]

    yield start
    for process in running:
        process.kill()
        process.communicate()


def test_a_run_is_agreed_to_followed_and_stopped_on_the_page_and_resumed(
    driver: Chrome, tmp_path: Path, world: World, page: Any
) -> None:
    laboratory = world({"procedure": {"speed_deg_s": 150, "rest_s": 0.5}, "world": {"time_scale": 2}})
    out = tmp_path / "run"
    config = hardware(laboratory.config_path, tmp_path)
    process, url = page("run", config, "--out", out, "--page", "--confirm-on-page")
    driver.get(url)
    until(lambda: kind(driver) == "asking", "the question")
    assert "The arm at" in text(driver, "prompt-words") and not driver.find_element(By.ID, "yes").is_enabled()
    # By the keyboard alone: on from the question's heading to the box, a tick, on to the button.
    driver.switch_to.active_element.send_keys(Keys.TAB)
    driver.switch_to.active_element.send_keys(Keys.SPACE)
    driver.switch_to.active_element.send_keys(Keys.TAB)
    assert driver.switch_to.active_element.get_attribute("id") == "yes"
    driver.switch_to.active_element.send_keys(Keys.ENTER)
    until(lambda: kind(driver) in ("moving", "measuring"), "motion")
    until(lambda: int(re.findall(r"\d+", text(driver, "step-number"))[0]) >= 5, "the fifth step")
    rate = driver.find_element(By.CSS_SELECTOR, "#plot-gyro-rate_rad_s canvas").get_attribute("aria-label")
    assert rate is not None and "now x" in rate
    until(lambda: "0." in text(driver, "observations"), "an observation")
    until(lambda: kind(driver) == "measuring", "a sweep")
    picture(driver, "run-moving")
    driver.find_element(By.ID, "halt").click()
    clicked_s = time.monotonic()
    assert process.wait(60) == 130
    states = read_run(out / "run.h5").arm
    moved = states["time_s"][abs(states["qd_rad_s"]).max(axis=1) > REST_SPEED_RAD_S]
    at_the_click = np.interp(clicked_s, states["host_time_s"], states["time_s"])
    assert len(moved) and moved[-1] - at_the_click < 1.0  # of the controller's time
    assert max(map(abs, laboratory.state()["qd_rad_s"])) < REST_SPEED_RAD_S
    until(lambda: kind(driver) == "stopped", "that it was stopped")
    assert "stopped from the page" in text(driver, "state-text") and "rig resume" in text(driver, "state-text")
    picture(driver, "run-stopped")
    resumed = rig("resume", out, "--yes")
    assert resumed.returncode in (0, 1) and "verdict:" in resumed.stdout, resumed.stderr


def test_a_run_goes_on_to_its_verdict_while_browsers_stall_and_is_replayed(
    driver: Chrome, tmp_path: Path, page: Any
) -> None:
    config, out = configuration(tmp_path, {"world": {"time_scale": 6}}), tmp_path / "run"
    process, url = page("run", config, "--out", out, "--page")
    stalled = [stalling(url) for _ in range(5)]
    driver.get(url)
    until(lambda: kind(driver) == "passed", "the verdict", 200)
    picture(driver, "run-passed")
    assert process.wait(60) == 0
    for one in stalled:
        one.close()
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    run = read_run(out / "run.h5")
    sequence = run.samples["gyro"]["sequence"]
    assert (sequence == range(len(sequence))).all(), "samples are lost"
    shown = text(driver, "parameters")
    assert f"{result['sensors']['gyro']['scale'][0]:.5f}" in shown and "combined" in shown
    assert f"{len(result['checks'])} of {len(result['checks'])} checks passed" == text(driver, "state-text")

    watching, url = page("watch", out, "--speed", "40")
    driver.get(url)
    until(lambda: kind(driver) == "passed", "the verdict again", 100)
    assert f"{result['sensors']['gyro']['scale'][0]:.5f}" in text(driver, "parameters")
    assert len(driver.find_elements(By.CSS_SELECTOR, "#observations tbody tr")) == 6
    assert not driver.find_element(By.ID, "halt").is_displayed()
    watching.send_signal(signal.SIGINT)
    assert watching.wait(60) == 0


def stalling(url: str) -> socket.socket:
    """A browser that asks for the stream and never reads it."""
    place = urlsplit(url).netloc
    host, port = place.split(":")
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.connect((host, int(port)))
    connection.sendall(f"GET /events HTTP/1.1\r\nHost: {place}\r\n\r\n".encode())
    return connection

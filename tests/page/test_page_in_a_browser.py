"""The operator's page in a real browser. Its pictures lie in build/page and are meant to be looked at."""

import json
import re
import signal
import socket
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from rig.data.recording.run_file import read_run
from rig.motion.turner_state import REST_SPEED_RAD_S
from support.laboratories.commands import configuration, rig
from support.laboratories.worlds import World, hardware
from support.page.browser import kind, needs_browser, picture, text
from support.processes.waiting import PATIENCE_S, wait_for
from support.processes.warm import start_module

pytestmark = [pytest.mark.slow, needs_browser, pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere")]


@pytest.fixture
def page(tmp_path: Path) -> Iterator[Callable[..., tuple["subprocess.Popen[str]", str]]]:
    """Starts `rig … --page` and gives the process and the page's address."""
    running: list[subprocess.Popen[str]] = []

    def start(*arguments: str | Path) -> tuple["subprocess.Popen[str]", str]:
        words = (*arguments, "--page-address", "127.0.0.1:0")
        told = tmp_path / f"stderr-{len(running)}"
        with told.open("w", encoding="utf-8") as errors:
            process = start_module(*words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors, text=True)
        running.append(process)
        found = wait_for(lambda: re.search(r"^page: (\S+)$", told.read_text(encoding="utf-8"), re.M), "the address")
        return process, found[1]

    yield start
    for process in running:
        process.kill()
        process.communicate()


@pytest.mark.proof
def test_a_run_is_agreed_to_followed_and_stopped_on_the_page_and_resumed(
    driver: Chrome, tmp_path: Path, world: World, page: Any, thorough: bool
) -> None:
    """In `make test` a stopped run is resumed by tests/commands/test_practise_a_fault.py, here by `make proof`."""
    quick = {"speed_deg_s": 160, "acceleration_deg_s2": 700, "rest_s": 0.5}
    laboratory = world({"procedure": quick, "world": {"time_scale": 4}})
    out = tmp_path / "run"
    config = hardware(laboratory.config_path, tmp_path)
    process, url = page("run", config, "--out", out, "--page", "--confirm-on-page")
    driver.get(url)
    wait_for(lambda: kind(driver) == "asking", "the question")
    assert "The arm at" in text(driver, "prompt-words") and not driver.find_element(By.ID, "yes").is_enabled()
    # By the keyboard alone: on from the question's heading to the box, a tick, on to the button.
    driver.switch_to.active_element.send_keys(Keys.TAB)
    driver.switch_to.active_element.send_keys(Keys.SPACE)
    driver.switch_to.active_element.send_keys(Keys.TAB)
    assert driver.switch_to.active_element.get_attribute("id") == "yes"
    laboratory.control({"do": "pace", "time_scale": 2})  # the run takes a quarter of a minute: a slow browser sees it
    driver.switch_to.active_element.send_keys(Keys.ENTER)
    wait_for(lambda: kind(driver) in ("moving", "measuring"), "motion")
    wait_for(lambda: re.match(r"\D*([3-9]|\d\d)\b", text(driver, "step-number")), "the end of the first sweep")
    laboratory.control({"do": "pace", "time_scale": 0.1})  # the run lasts until a busy computer has observed a sweep
    rate = driver.find_element(By.CSS_SELECTOR, "#plot-gyro-rate_rad_s canvas")
    wait_for(lambda: "now x" in (rate.get_attribute("aria-label") or ""), "the rate of now")
    wait_for(lambda: "0." in text(driver, "observations"), "an observation")
    laboratory.control({"do": "pace", "time_scale": 0.5})  # a sweep lasts five seconds: a slow browser misses none
    wait_for(lambda: kind(driver) == "measuring", "a sweep")
    laboratory.control({"do": "pace", "time_scale": 0.05})  # the stop arrives in this sweep, however slow the click is
    picture(driver, "run-moving")
    swept = (out / "log.txt").read_text(encoding="utf-8").count("done: sweep")
    driver.find_element(By.ID, "halt").click()
    assert process.wait(PATIENCE_S) == 130
    assert (out / "log.txt").read_text(encoding="utf-8").count("done: sweep") <= swept + 1
    wait_for(lambda: max(map(abs, laboratory.state()["qd_rad_s"])) < REST_SPEED_RAD_S, "an arm at rest")
    laboratory.control({"do": "pace", "time_scale": 12.0})
    wait_for(lambda: kind(driver) == "stopped", "that it was stopped")
    assert "stopped from the page" in text(driver, "state-text") and "rig resume" in text(driver, "state-text")
    picture(driver, "run-stopped")
    if not thorough:
        return
    resumed = rig("resume", out, "--yes")
    assert resumed.returncode in (0, 1) and "verdict:" in resumed.stdout, resumed.stderr


@pytest.mark.thorough
def test_a_run_goes_on_to_its_verdict_while_browsers_stall_and_is_replayed(
    driver: Chrome, tmp_path: Path, page: Any
) -> None:
    config, out = configuration(tmp_path, {"world": {"time_scale": 6}}), tmp_path / "run"
    process, url = page("run", config, "--out", out, "--page")
    stalled = [stalling(url) for _ in range(5)]
    driver.get(url)
    wait_for(lambda: kind(driver) == "passed", "the verdict")
    picture(driver, "run-passed")
    assert process.wait(PATIENCE_S) == 0
    for one in stalled:
        one.close()
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    run = read_run(out / "run.h5")
    sequence = run.samples["gyro"]["sequence"]
    assert (sequence == range(len(sequence))).all(), "samples are lost"
    shown = text(driver, "parameters")
    assert f"{result['gyroscopes']['gyro']['scale'][0]:.5f}" in shown and "combined" in shown
    assert f"{len(result['checks'])} of {len(result['checks'])} checks passed" == text(driver, "state-text")

    watching, url = page("watch", out, "--speed", "40")
    driver.get(url)
    wait_for(lambda: kind(driver) == "passed", "the verdict again")
    assert f"{result['gyroscopes']['gyro']['scale'][0]:.5f}" in text(driver, "parameters")
    assert len(driver.find_elements(By.CSS_SELECTOR, "#observations tbody tr")) == 6
    assert not driver.find_element(By.ID, "halt").is_displayed()
    watching.send_signal(signal.SIGINT)
    assert watching.wait(PATIENCE_S) == 0


def stalling(url: str) -> socket.socket:
    """A browser that asks for the stream and never reads it."""
    place = urlsplit(url).netloc
    host, port = place.split(":")
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.connect((host, int(port)))
    connection.sendall(f"GET /events HTTP/1.1\r\nHost: {place}\r\n\r\n".encode())
    return connection

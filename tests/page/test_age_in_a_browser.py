"""The page in a real browser says how old readings are, and of those that arrive nothing, whatever turns and reads."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By

from rig.config.load import load
from rig.motion.steps import Plan
from rig.motion.turner_state import Report
from rig.page.about import About
from rig.page.arm import built
from rig.station.events import ArmConnected, ArmSeen, HandSeen, PhaseStarted, RunEvent, SamplesTaken, SensorSamples
from rig.turners.turner_registry import kind_of, load_turner_kinds, sections
from support.laboratories.command_with_a_page import start_with_page
from support.laboratories.commands import configuration
from support.laboratories.servo_runs import configure
from support.laboratories.worlds import fresh_host, merge
from support.page.browser import needs_browser, picture
from support.page.scripted_page import showing
from support.page.scripted_runs import report, servo_report, servo_state, state
from support.paths import CONFIGS
from support.processes.waiting import alive, wait_for

pytestmark = [pytest.mark.slow, needs_browser, pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere")]

HOME = (0.0,) * 6
HAND = HandSeen(5.0, "resting", 0.8, 0.0, 0.0, 8.0, None, (), (), (), 0)
ARM_SEEN, SERVO_SEEN = state(1.0, HOME, HOME), servo_state(1.0, 0.1)
# A configuration whose turner turns, what reads, how the turner is connected, and how it is seen then.
TURNERS: dict[str, tuple[str, str, Report, RunEvent]] = {
    "hand": ("by_hand.yaml", "lsm9ds1", load_turner_kinds()["hand"].look(load_turner_kinds()["hand"].section()), HAND),
    "arm": ("demo.yaml", "lsm9ds1", report(HOME), ArmSeen(ARM_SEEN, 0)),
    "servo": ("servo.yaml", "lsm9ds1", servo_report(SERVO_SEEN), ArmSeen(SERVO_SEEN, 0)),
    "lines": ("by_hand.yaml", "lines", load_turner_kinds()["hand"].look(load_turner_kinds()["hand"].section()), HAND),
}
SLOW = {"world": {"time_scale": 0.5}}  # a busy computer must show the page before the run's end
WATCHED_MS = 4000  # twice what the page takes for old: an age that nothing renews has been said by then


def ages(driver: Chrome) -> list[str]:
    """How old the page says that the readings are, and whether they are of now."""
    shown = driver.find_elements(By.CSS_SELECTOR, ".plot .age")
    plots = driver.find_elements(By.CSS_SELECTOR, ".plot canvas")
    labels = [(plot.get_attribute("aria-label") or "").partition("; ")[2] for plot in plots]
    return [*(each.text for each in shown), *("" if label.startswith("now ") else label for label in labels)]


def of_now(driver: Chrome) -> bool:
    found = ages(driver)
    return bool(found) and not any(found)


@pytest.mark.one_in(4)  # tests/page/test_feed.py holds the age for each of them
@pytest.mark.parametrize("what", TURNERS)
def test_readings_that_arrive_are_of_now_and_those_told_again_are_not(
    driver: Chrome, tmp_path: Path, what: str
) -> None:
    config, part, connected, seen = TURNERS[what]
    turner = load(CONFIGS / config, turners=sections()).config.turner
    arm = built(kind_of(turner).describe_configured(turner).kinematics)
    about = About("runs/age", "a procedure", parts={"gyro": f"{part} AGE-1"}, arm=arm)
    samples = SamplesTaken((SensorSamples("gyro", 10, 0, {"rate": (0.1, 0.0, 0.0)}),))
    with showing(driver, tmp_path, about=about) as tell:
        tell(ArmConnected(connected), PhaseStarted("a procedure", Plan((), (), ()), {"gyro": "raw"}), samples, seen)
        wait_for(lambda: tell.times > 15, "three seconds of readings")
        wait_for(lambda: of_now(driver), "that they are of now")
        tell.repeating.set()
        wait_for(lambda: any(re.search(r"\d s ago", age) for age in ages(driver)), "their age")
        picture(driver, f"age-{what}")


def by_hand(folder: Path) -> Path:
    """configs/by_hand.yaml at an address of its own, without haste."""
    return written(folder, "by_hand.yaml", {"board": {"port": f"socket://{fresh_host()}:7321"}})


def of_lines(folder: Path) -> Path:
    """configs/own_port/lines.yaml so."""
    host = fresh_host()
    port = {"serial": {"port": f"socket://{host}:7341"}}
    return written(folder, "own_port/lines.yaml", {"arm": {"host": host}, "sensors": {"imu": port}})


def written(folder: Path, name: str, changes: dict[str, Any]) -> Path:
    document = yaml.safe_load(load(CONFIGS / name, turners=sections()).text)
    path = folder / Path(name).name
    path.write_text(yaml.safe_dump(merge(merge(document, changes), SLOW)))
    return path


RUNS: dict[str, Callable[[Path], Path]] = {
    "hand": by_hand,
    "lines": of_lines,
    "servo": lambda folder: configure(folder, {}),  # at the pace of this computer's clock, as its driver measures time
    "arm": lambda folder: configuration(folder, SLOW),
}


@pytest.mark.thorough  # what they are of is asked of events above, and by tests/page/test_feed.py
@pytest.mark.parametrize("what", RUNS)
def test_while_a_run_goes_on_its_readings_are_of_now(driver: Chrome, tmp_path: Path, what: str) -> None:
    command = ("run", RUNS[what](tmp_path), "--out", tmp_path / "run", "--yes", "--page")
    with start_with_page(tmp_path / "told.txt", *command, "--page-address", "127.0.0.1:0") as (process, url):
        driver.get(url)
        wait_for(lambda: driver.find_elements(By.CSS_SELECTOR, ".plot canvas"), "readings", meanwhile=alive(process))
        began_ms = driver.execute_script("return performance.now()")
        late = "return performance.now() > arguments[0]"
        wait_for(lambda: driver.execute_script(late, began_ms + WATCHED_MS), "that it is not the first moment")
        wait_for(lambda: of_now(driver), "that they are of now", meanwhile=alive(process))
        driver.get("about:blank")

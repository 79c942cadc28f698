"""What matters is in the first screen, with one sensor and with six; nothing is wider than a telephone."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from rig.cli import main
from rig.data.run_folder import RESULT, TRUTH_FILE
from rig.errors import Fault
from rig.station.events import DocumentWritten, Failed, Prompt
from support.page.browser import TABLET, kind, legible, needs_browser, picture, screen, set_theme, text
from support.page.scripted_page import Telling, showing
from support.page.scripted_runs import before_it_moves, judge, look, moving, plan_demo
from support.page.scripted_six_sensors import IMU, PARTS, SIX, six_found, six_judged, six_moving
from support.paths import RECORDINGS
from support.processes.waiting import wait_for

pytestmark = [pytest.mark.slow, needs_browser, pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere")]

SIZES = [(1280, 800), (1920, 1080), (768, 1024)]
TELEPHONE = (390, 844)
# Of elements that match, those that are not to be seen whole without scrolling.
BELOW = """
return [...document.querySelectorAll(arguments[0])].filter((e) => {
  const { left, right, top, bottom, width } = e.getBoundingClientRect();
  return !width || left < 0 || top < 0 || right > innerWidth || bottom > innerHeight;
}).map((e) => `${e.id || e.className} ${e.textContent.slice(0, 40)} ${Math.round(e.getBoundingClientRect().bottom)}`);
"""
# Elements that reach beyond the screen's right edge, but for what scrolls within its panel.
WIDE = """
const scrolls = (e) => getComputedStyle(e).overflowX === "auto";
const within = (e) => e.parentElement && (scrolls(e.parentElement) || within(e.parentElement));
const beyond = (e) => e.checkVisibility() && e.getBoundingClientRect().right > innerWidth + 0.5;
return [...document.body.querySelectorAll("*")]
  .filter((e) => beyond(e) && !within(e) && !e.closest(".skip, .unseen"))
  .map((e) => `${e.tagName} ${e.id} ${e.className}`);
"""
# Panels, tables and serial numbers whose content is wider than they are.
SCROLLING = """
return [...document.querySelectorAll(".panel, #found .wide, .plot h2 small")]
  .filter((e) => e.checkVisibility() && e.scrollWidth > e.clientWidth + 1)
  .map((e) => e.className + e.textContent.slice(0, 40));
"""
AFTER = "#state-word, #state-text, #found summary, #certificate, #next-command, #tags .tag, #parts"
DURING = "#state-word, #state-text, #left, #step-number, #bar, #halt, #tags .tag, .plot, .plot .now"


def below(driver: Chrome, what: str, count: int) -> list[str]:
    assert len(driver.find_elements(By.CSS_SELECTOR, what)) >= count
    found: list[str] = driver.execute_script(BELOW, what)
    return found


def wide(driver: Chrome) -> list[str]:
    assert driver.execute_script("return document.documentElement.scrollWidth <= innerWidth")
    found: list[str] = driver.execute_script(WIDE)
    return found + [f"cut: {each}" for each in driver.execute_script(BELOW, "#tags .tag") if "simulated" in each]


@pytest.fixture
def six(driver: Chrome, tmp_path: Path) -> Iterator[Telling]:
    with showing(driver, tmp_path, about=SIX) as tell:
        tell(*before_it_moves(plan_demo()), *six_moving(7.0))
        tell.word("Measuring")
        yield tell
        driver.get("about:blank")  # so that it asks no longer


@pytest.mark.one_in(3)
@pytest.mark.parametrize("size", SIZES)
def test_six_sensors_are_measured_and_judged_without_scrolling(
    driver: Chrome, tmp_path: Path, six: Telling, size: tuple[int, int]
) -> None:
    name = f"{size[0]}x{size[1]}"
    with screen(driver, *size):
        wait_for(lambda: len(driver.find_elements(By.CSS_SELECTOR, ".plot")) == 6, "six plots")
        picture(driver, f"six-measuring-{name}")
        assert below(driver, DURING, 13) == [] and driver.execute_script(SCROLLING) == []
        six(*six_judged(tmp_path))
        wait_for(lambda: "E_n" in text(driver, "found"), "the comparison")
        picture(driver, f"six-passed-{name}")
        assert below(driver, AFTER, 11) == []
        for dark in (False, True):
            set_theme(driver, dark=dark)
            legible(driver)


def test_one_sensor_has_each_value_with_its_u_in_the_first_screen(driver: Chrome, tmp_path: Path) -> None:
    with showing(driver, tmp_path) as tell:
        tell(*before_it_moves(plan_demo()), *moving(plan_demo(), 7.0), DocumentWritten(IMU / RESULT))
        tell(*judge(tmp_path, passed=True))
        tell.word("PASS")
        for size in SIZES:
            with screen(driver, *size):
                picture(driver, f"one-passed-{size[0]}x{size[1]}")
                assert below(driver, f"{AFTER}, #found tbody tr", 10) == [], size
                assert driver.execute_script(SCROLLING) == [], size


def test_what_was_found_is_in_print_as_the_certificate_has_it(driver: Chrome, tmp_path: Path, six: Telling) -> None:
    six(*six_judged(tmp_path))
    wait_for(lambda: "E_n" in text(driver, "found"), "the comparison")
    rows = [row.text for row in driver.find_elements(By.CSS_SELECTOR, "#found summary")]
    assert len(rows) == 6
    assert all(
        PARTS[name].split()[1] in rows[n] and f"{name}, accelerometer" in rows[n + 3] for n, name in enumerate(PARTS)
    )
    x = six_found().gyroscopes["lsm9ds1"].scale[0]
    assert f"{x:.4f}" in rows[0] and "± 0.0013" in rows[0] and "rad/s" in rows[0] and "m/s²" in rows[3]
    assert "kz changed since no 8, 2026-11-20" in rows[0]
    assert (
        "nothing changed since no 9, 2026-11-20 (kz: E_n 0.4)" in rows[1]
        and "first calibration of this part" in rows[2]
    )
    assert text(driver, "next-command") == "rig history LSM9DS1-003"
    # The rest of a row comes on demand, by the keyboard too.
    first = driver.find_element(By.CSS_SELECTOR, "#found summary")
    assert not driver.find_element(By.CSS_SELECTOR, "#found table").is_displayed()
    first.send_keys(Keys.ENTER)
    wait_for(lambda: driver.find_element(By.CSS_SELECTOR, "#found table").is_displayed(), "the rest")
    cells = [td.text for td in driver.find_elements(By.CSS_SELECTOR, "#found tbody tr:nth-child(3) td")]
    assert cells[3] == "2.4" and len(driver.find_elements(By.CSS_SELECTOR, "#found details:first-child td svg")) == 6


def test_no_column_of_a_result_is_hidden_beside_its_previous_one_and_the_simulated_truth(
    driver: Chrome, tmp_path: Path, six: Telling
) -> None:
    true = {"scale": [1.17, 1.16, 1.14], "bias_rad_s": [0.008, -0.01, -0.005]}
    document: dict[str, object] = {
        "schema": "rig.truth/1",
        "simulated": True,
        "gyroscopes": {"lsm9ds1": true},
        "accelerometers": {},
    }
    (tmp_path / TRUTH_FILE).write_text(json.dumps(document), encoding="utf-8")
    six(*six_judged(tmp_path), DocumentWritten(tmp_path / TRUTH_FILE))
    wait_for(lambda: "E_n" in text(driver, "found"), "the comparison")
    driver.find_element(By.CSS_SELECTOR, "#found summary").send_keys(Keys.ENTER)
    wait_for(lambda: "simulated truth" in text(driver, "found"), "the truth")
    for size in (*SIZES, TELEPHONE):
        with screen(driver, *size):
            picture(driver, f"truth-{size[0]}")
            assert wide(driver) == [] and driver.execute_script(SCROLLING) == [], size


def test_a_run_that_failed_says_what_failed_and_what_to_do(driver: Chrome, tmp_path: Path, six: Telling) -> None:
    six(*six_judged(tmp_path, passed=False))
    wait_for(lambda: kind(driver) == "failed", "the verdict")
    assert text(driver, "failed").splitlines() == ["✗ lsm9ds1.scale_deviation 0.177, allowed 0.1"]
    assert "the part is beyond its limits" in text(driver, "next-words")
    assert text(driver, "next-command") == f"rig show {SIX.folder} --all"
    first = driver.find_element(By.CSS_SELECTOR, "#checks tbody tr")
    assert "✗ failed" in (first.get_attribute("textContent") or "")
    picture(driver, "six-failed")


def test_of_a_run_of_six_that_failed_the_first_screen_has_the_verdict_and_what_failed(
    driver: Chrome, tmp_path: Path, six: Telling
) -> None:
    with screen(driver, *TABLET):
        six(*six_judged(tmp_path, broken=("scale_deviation", "bias", "residuals")))
        wait_for(lambda: kind(driver) == "failed" and "E_n" in text(driver, "found"), "the verdict and the comparison")
        picture(driver, "six-failed-1280x800")
        assert below(driver, f"{AFTER}, #failed li", 15) == []
        said = text(driver, "failed").splitlines()
        assert len(said) == 4 and said[-1] == "and 6 more, below"
        assert all(each.startswith("✗ ") and ", allowed " in each for each in said[:-1])
        assert text(driver, "state-word") == "FAIL"
        for dark in (False, True):
            set_theme(driver, dark=dark)
            legible(driver)


def test_a_certificate_is_no_wider_than_a_telephone(driver: Chrome, tmp_path: Path) -> None:
    assert main(["report", str(RECORDINGS / "imu"), "--out", str(tmp_path)]) == 0
    with screen(driver, *TELEPHONE):
        driver.get((tmp_path / "certificate.html").as_uri())
        assert wide(driver) == []


@pytest.mark.one_in(2)
def test_nothing_is_wider_than_a_telephone(driver: Chrome, tmp_path: Path, six: Telling) -> None:
    with screen(driver, *TELEPHONE):
        wait_for(lambda: len(driver.find_elements(By.CSS_SELECTOR, ".plot")) == 6, "six plots")
        picture(driver, "six-measuring-telephone")
        assert wide(driver) == [] and driver.execute_script(SCROLLING) == []
        six.silent.set()
        wait_for(lambda: driver.find_element(By.ID, "stale").is_displayed(), "the bar")
        assert wide(driver) == []
        six(Prompt(("The arm at 127.0.0.2 will move for 66 s.", "Nobody may be within its reach.")))
        wait_for(lambda: kind(driver) == "asking", "the question")
        assert wide(driver) == []
        six(Failed(Fault("arm_link_lost", "the arm at 127.0.0.2 has been silent for 0.8 s", "Look at it")))
        wait_for(lambda: kind(driver) == "fault", "the fault")
        assert wide(driver) == []
        six(*six_judged(tmp_path))
        wait_for(lambda: kind(driver) == "passed", "the verdict")
        for element in driver.find_elements(By.CSS_SELECTOR, "#found summary"):
            element.send_keys(Keys.ENTER)
        picture(driver, "six-passed-telephone")
        assert wide(driver) == []
        assert driver.execute_script(SCROLLING) == []  # no table hides a column


def test_after_the_end_no_reading_stands_beside_the_result_and_no_panel_promises_more(
    driver: Chrome, tmp_path: Path, six: Telling
) -> None:
    def shown(what: str) -> list[str]:
        return [each.text for each in driver.find_elements(By.CSS_SELECTOR, what) if each.is_displayed()]

    assert len(shown(".plot .now")) == 6 and shown("#arm-facts") and "speed °/s" in shown(".joints thead th")
    assert shown("#observations-title")  # the first appears after the first sweep
    six(*six_judged(tmp_path))
    wait_for(lambda: kind(driver) == "passed" and not shown(".plot .now"), "the end")
    assert not shown("#arm-facts dd") and "speed °/s" not in shown(".joints thead th")
    assert not shown("#observations-title") and not shown(".none")
    label = driver.find_element(By.CSS_SELECTOR, ".plot canvas").get_attribute("aria-label")
    assert label == "lsm9ds1, rate over the last minute of the run"


@pytest.mark.thorough
def test_an_oblique_turn_is_held_against_the_part_of_it_that_an_axis_feels(driver: Chrome, tmp_path: Path) -> None:
    """0.727 rad/s of 1.047 is what an axis reads that lies 46° off; their ratio of 0.69 looked like a fault."""
    seen = look(plan_demo(), 1)
    row = {**seen.observations[0], "mean_rad_s": [0.6303, 0.63, 0.0], "axis": "x", "sign": 1, "along": 0.694}
    with showing(driver, tmp_path) as tell:
        tell(*before_it_moves(plan_demo()), *moving(plan_demo(), 1.0))
        tell.observed([row])
        wait_for(lambda: "0.72676" in text(driver, "observations"), "what is expected")
        assert "0.86728" in text(driver, "observations")
        driver.get("about:blank")

"""The documentation becomes a site without a warning, and its search finds what the program offers."""

import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from urllib.parse import quote

import pytest
from selenium.webdriver.common.by import By

from support.page.browser import browser, needs_browser, screen
from support.paths import DOCS, ROOT
from support.processes.waiting import wait_for

pytestmark = [pytest.mark.slow, pytest.mark.thorough]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site as `make docs` builds it, but for the notebook, which tests/notebook/test_first_look.py executes."""
    folder = tmp_path_factory.mktemp("docs")
    command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet", "-c", str(DOCS / "site")]
    command += ["-D", "nb_execution_mode=off", "-d", str(folder / "doctrees"), str(ROOT), str(folder / "site")]
    made = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert made.returncode == 0, made.stderr
    return folder / "site"


def test_the_site_is_built_without_a_warning(site: Path) -> None:
    assert "README.html" in (site / "index.html").read_text(encoding="utf-8")
    assert "rig.load" in (site / "docs" / "how-to" / "with-code" / "api.html").read_text(encoding="utf-8")


@needs_browser
def test_the_search_answers_questions_and_finds_names(site: Path) -> None:
    answers = {
        "how do I stop the arm": "docs/how-to/at-the-rig/operators-page.html#stop-the-arm-stop-the-run",
        "stop the arm": "docs/how-to/at-the-rig/operators-page.html#stop-the-arm-stop-the-run",
        "no hardware": "docs/how-to/start/ten-minutes.html",
        "export to matlab": "docs/how-to/finished-runs/export.html",
        "tab completion": "docs/commands.html#completion-by-the-tab-key",
        "calibrate by hand": "docs/how-to/without-an-arm/by-hand.html",
        "arm does not move": "docs/how-to/start/failed.html#the-arm-does-not-move",
        "board not found": "docs/board.html#the-board-is-not-found-or-something-else-is-wrong",
        "change the rest": "docs/configuration.html#change-a-value-for-one-run-the-rest-the-speed",
        "compare two runs": "docs/how-to/finished-runs/check-standards.html#compare-two-runs",
        "uncertainty too large": "docs/how-to/start/failed.html#the-uncertainty-is-too-large",
        "run again one sweep": "docs/how-to/at-the-rig/resume-and-repeat.html#repeat-one-sweep-run-it-again",
        "print certificate pdf": "docs/how-to/finished-runs/read-a-certificate.html#print-the-certificate-again",
        "temperature missing": "docs/how-to/at-the-rig/lines.html#the-temperature-is-missing",
        "How long does a run take": "docs/how-to/at-the-rig/no-longer-than-needed.html#how-long-does-a-run-take",
        "resume an interrupted run": "docs/how-to/at-the-rig/resume-and-repeat.html",
        "arm_moved": "docs/errors.html#error-arm-moved",
        "scale_changed": "docs/checks.html#check-scale-changed",
        "rig verify": "docs/commands.html#rig-verify",
        "arm.payload_kg": "docs/configuration.html#key-arm-payload-kg",
    }
    with browser() as driver:
        for question, page in answers.items():
            driver.get(f"{(site / 'search.html').as_uri()}?q={quote(question)}")
            first = wait_for(
                partial(driver.find_elements, By.CSS_SELECTOR, "#search-results ul.search li > a"), "a result"
            )[0]
            wait_for(lambda: "found" in driver.find_element(By.CLASS_NAME, "search-summary").text, "all results")
            assert page in (first.get_attribute("href") or "").replace("?highlight=", ""), question
    for page, name in (("errors", "error-arm-moved"), ("checks", "check-bias"), ("configuration", "key-arm-host")):
        assert f'id="{name}"' in (site / "docs" / f"{page}.html").read_text(encoding="utf-8")


@needs_browser
@pytest.mark.parametrize("name", ["README", "docs/errors", "docs/configuration", "docs/how-to/finished-runs/export"])
def test_no_screen_shows_a_table_that_scrolls_sideways_and_a_telephone_shows_cards(site: Path, name: str) -> None:
    widest = "Math.max(...[...document.querySelectorAll('.table-wrapper')].map(t => t.scrollWidth - t.clientWidth))"
    with browser() as driver:
        driver.get((site / f"{name}.html").as_uri())
        for size in ((1920, 1080), (1280, 800), (768, 1024), (390, 844)):
            with screen(driver, *size):
                assert driver.execute_script(f"return {widest}") <= 1, size
        with screen(driver, 390, 844):
            cell = driver.find_element(By.CSS_SELECTOR, "table:has(th:nth-child(3)) td:nth-child(2)")
            heading = driver.find_element(By.CSS_SELECTOR, "table:has(th:nth-child(3)) th:nth-child(2)")
            before = driver.execute_script("return getComputedStyle(arguments[0], '::before').content", cell)
            assert before.startswith(f'"{heading.get_property("textContent")}')

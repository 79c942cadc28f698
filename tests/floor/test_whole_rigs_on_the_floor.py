"""Five rigs on one PostgreSQL, as a browser shows them: one is killed, of one the board is unplugged.

Each is a `rig station` with a laboratory of its own. Two of them measure; the others wait for an operator.
"""

import signal
from contextlib import ExitStack
from pathlib import Path

import pytest
from selenium.webdriver import Chrome

from support.history.postgres import postgresql
from support.laboratories.command_with_a_page import start_with_page
from support.laboratories.commands import configuration
from support.laboratories.scanner import Scanner, station
from support.laboratories.station_laboratory import Laboratory
from support.page.browser import needs_browser, picture, text
from support.processes.stopwatch import time_block, times_in_words
from support.processes.waiting import wait_for

UNPLUGGED, KILLED, WAITS, MOUNTS, AGREES = RIGS = ("unplugged", "killed", "waits", "mounts", "agrees")
AT_WORK = {UNPLUGGED: "running", KILLED: "running", WAITS: "waiting", MOUNTS: "asking", AGREES: "asking"}
pytestmark = [
    pytest.mark.slow, pytest.mark.proof, pytest.mark.thorough, needs_browser,
    pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere"),
]  # fmt: skip


def states(driver: Chrome) -> dict[str, str]:
    """The state of each rig that the page shows, in one go: its cards are made anew every second."""
    each = "[each.querySelector('span').innerText, each.dataset.state]"
    return dict(driver.execute_script(f"return [...document.querySelectorAll('.rig')].map((each) => {each})"))


def card(driver: Chrome, rig: str) -> str:
    """What the card of a rig says."""
    script = "return [...document.querySelectorAll('.rig')].map((each) => each.innerText)"
    return next(str(each) for each in driver.execute_script(script) if str(each).startswith(rig))


def mounted(at: Scanner) -> None:
    """The part that was named is mounted; it is checked without moving."""
    at.waits_for("then Enter")
    at.types("")
    at.waits_for("Type go to start, or no: ")


def test_five_rigs_at_once_of_which_one_is_killed_and_one_unplugged_are_shown_as_they_are(
    driver: Chrome, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with postgresql() as url, ExitStack() as stack:
        monkeypatch.setenv("RIG_HISTORY", url)
        configs = dict[str, Path]()
        for rig in RIGS:
            (tmp_path / rig).mkdir()
            configs[rig] = configuration(tmp_path / rig, {"history": {"rig": rig}, "world": {"time_scale": 1}})
        _, page = stack.enter_context(start_with_page(tmp_path / "told.txt", "floor", "--history", url))
        at = {rig: stack.enter_context(station(configs[rig], "--out", tmp_path / rig / "batch")) for rig in RIGS}
        driver.get(page)
        for rig in RIGS:
            at[rig].waits_for("serial number (Enter alone ends): ")
        for rig in (UNPLUGGED, KILLED, MOUNTS, AGREES):
            at[rig].types(f"{rig}-1")
        for rig in (UNPLUGGED, KILLED, AGREES):
            mounted(at[rig])
        for rig in (UNPLUGGED, KILLED):
            at[rig].types("go")
        wait_for(lambda: states(driver) == AT_WORK, "all at work")

        shown = list[float]()
        with time_block(shown):
            at[KILLED].process.kill()
            Laboratory(configs[UNPLUGGED])("unplug_board")
            wait_for(lambda: states(driver)[UNPLUGGED] == "fault" and states(driver)[KILLED] == "dead", "both")
        print("both are shown after", times_in_words(shown))
        wait_for(lambda: states(driver) == {**AT_WORK, UNPLUGGED: "fault", KILLED: "dead"}, "the others as before")
        assert "board_link_lost" in card(driver, UNPLUGGED) and f"{UNPLUGGED}-1" in card(driver, UNPLUGGED)
        assert "no sign of life" in card(driver, KILLED)
        picture(driver, "floor-of-five")
        assert not Laboratory(configs[UNPLUGGED])("state")["moving"]

        at[WAITS].types("")
        at[MOUNTS].process.send_signal(signal.SIGINT)
        said = {WAITS: "ended", MOUNTS: "stopped", UNPLUGGED: "fault", KILLED: "dead", AGREES: "asking"}
        wait_for(lambda: states(driver) == said, "how two others have ended")
        assert not driver.find_element("id", "stale").is_displayed() and text(driver, "link-words") == "connected"
        driver.get("about:blank")  # a page whose server ends would complain of it

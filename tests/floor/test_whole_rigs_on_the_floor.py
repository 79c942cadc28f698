"""Five rigs on one PostgreSQL, two of them whole ones at work: one is killed, of one the board is unplugged."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from rig.floor.feed import looking
from rig.history.place import place
from rig.history.store import open_history
from support.beating_station import beating
from support.commands import configuration
from support.floor_seen import sections, until
from support.postgres import postgresql
from support.station_laboratory import Laboratory

WITHIN_S = 5.0
BUSY_S, BEGUN_S = 120.0, 900.0  # the patience with a machine whose processors are all taken
pytestmark = [pytest.mark.slow, pytest.mark.proof, pytest.mark.thorough]


@contextmanager
def whole(folder: Path, url: str, rig: str) -> Iterator[tuple["subprocess.Popen[bytes]", Path]]:
    """A station at work on three parts without questions, and its configuration."""
    folder.mkdir()
    config = configuration(folder, {"history": {"rig": rig}, "world": {"time_scale": 1}})
    parts = folder / "parts.csv"
    parts.write_text("".join(f"{rig}-{number}\n" for number in (1, 2, 3)), encoding="utf-8")
    words = "station", config, "--series", parts, "--out", folder / "batch"
    command, env = [sys.executable, "-m", "rig", *map(str, words)], {**os.environ, "RIG_HISTORY": url}
    with (
        (folder / "told.txt").open("wb") as told,
        subprocess.Popen(command, stdout=told, stderr=told, env=env) as process,
    ):
        try:
            yield process, config
        finally:
            process.kill()


def seen_at_work(*rigs: str) -> Callable[[dict[str, str]], bool]:
    """Whether each of these has been seen running; on a busy machine one may be silent for a while."""
    seen = set[str]()

    def all_seen(states: dict[str, str]) -> bool:
        seen.update(rig for rig, state in states.items() if state == "running")
        return seen.issuperset(rigs)

    return all_seen


@pytest.mark.timeout(1800)
def test_five_rigs_of_which_two_are_whole_are_shown_as_they_are(tmp_path: Path) -> None:
    with postgresql() as url, ExitStack() as stack:
        stack.enter_context(open_history(url))
        others = {name: stack.enter_context(beating(url, name)) for name in ("3", "4", "5")}
        unplugged, config = stack.enter_context(whole(tmp_path / "one", url, "1"))
        killed, _ = stack.enter_context(whole(tmp_path / "two", url, "2"))
        feed = stack.enter_context(looking(place(url)))
        until(feed, seen_at_work("1", "2", *others), within_s=BEGUN_S)
        until(feed, lambda states: (states.get("1"), states.get("2")) == ("running", "running"), within_s=BEGUN_S)
        within_s = WITHIN_S if os.getloadavg()[0] <= (os.cpu_count() or 1) + 1 else BUSY_S
        killed.kill()
        Laboratory(config)("unplug_board")
        began_s = time.monotonic()
        until(feed, lambda states: (states.get("1"), states.get("2")) == ("fault", "dead"), within_s=within_s)
        print(f"a killed and an unplugged rig are shown after {time.monotonic() - began_s:.1f} s")
        cards = {each["rig"]: each for each in sections(feed)["rigs"]}
        assert cards["1"]["doing"].startswith("board_link_lost") and cards["1"]["part"] == "1-1"
        until(feed, seen_at_work(*others), within_s=BUSY_S)
        assert unplugged.wait(BUSY_S) == 3

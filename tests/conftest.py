"""What every test has: simulated laboratories, and a Hypothesis without a stopwatch."""

import atexit
import gc
import os
import re
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

from support.laboratories.worlds import world
from support.processes.warm import nursery, readers_forked, readers_of_system

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

__all__ = ["world"]

# What is made until the tests are collected stays: to look it through for garbage takes a second of each worker.
gc.disable()

# Without a deadline: a shared machine stalls now and then, which is no failure.
settings.register_profile("test", deadline=None, max_examples=30)
settings.register_profile("proof", deadline=None, max_examples=300)
settings.load_profile("test")

# Rooms whose tests wait for a laboratory. Several laboratories at a time cost each other processor time, and one alone
# leaves a processor idle: their files alternate with those that compute, of which there are some left for the end.
WAITING = {"runner", "world", "turners", "page", "batch", "floor", "sensors"}
WAITING_UNTIL = 0.75  # of the files

# A file with this line has slow tests only.
ALL_SLOW = re.compile(r"^pytestmark = \[?\s*pytest\.mark\.slow\b", re.MULTILINE)

NURSERY = "rig's nursery"  # of what xdist hands to the processes that run tests

# Nothing that a test runs enters the history of whoever runs the tests, or is known as a run of theirs.
os.environ["RIG_HISTORY"] = "off"
_share = tempfile.TemporaryDirectory(prefix="rig-share-")
atexit.register(_share.cleanup)
os.environ["XDG_DATA_HOME"] = _share.name

# Ctrl-C ends the tests, and what they start, also where the shell that started them had it ignored (`make test &`).
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--proof", action="store_true", help="statistical acceptance over all seeds, not over a few")


def pytest_configure(config: pytest.Config) -> None:
    nursery.closed = bool(config.getoption("--proof"))
    if nursery.closed:
        settings.load_profile("proof")
    else:
        nursery.addresses = getattr(config, "workerinput", {}).get(NURSERY)
        readers_forked()
        # Readers do not interrupt a laboratory at each packet that it sends, which costs much processor time.
        if hasattr(os, "SCHED_BATCH"):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Processes that run tests fork others from the same one, which the process that gives them their tests starts."""
    if not nursery.closed:
        nursery.addresses = nursery.addresses or nursery.begin()
        node.workerinput[NURSERY] = nursery.addresses


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Where slow tests are left out, files that have no others are not imported, with all that they stand on."""
    is_file = config.option.markexpr == "not slow" and collection_path.match("test_*.py")
    return True if is_file and ALL_SLOW.search(collection_path.read_text(encoding="utf-8")) else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """What `make test` has no time for is left to `make proof`: what is marked `thorough`, and of what is marked
    `one_in(n)` all cases but the first of every n."""
    places = place_files(dict.fromkeys(item.path for item in items))
    items.sort(key=lambda item: places[item.path])
    if config.getoption("--proof"):
        return
    cases = Counter[str]()

    def taken(item: pytest.Item) -> bool:
        if item.get_closest_marker("thorough"):
            return False
        if mark := item.get_closest_marker("one_in"):
            function = item.nodeid.partition("[")[0]
            cases[function] += 1
            return (cases[function] - 1) % int(mark.args[0]) == 0
        return True

    chosen: list[pytest.Item] = []
    left_out: list[pytest.Item] = []
    for item in items:
        (chosen if taken(item) else left_out).append(item)
    config.hook.pytest_deselected(items=left_out)
    items[:] = chosen


def pytest_collection_finish() -> None:
    """Garbage is looked for again, among what tests make."""
    gc.freeze()
    gc.enable()


def pytest_sessionfinish() -> None:
    """The firmware's executed lines are written while the process is sure to live: xdist kills one that ends slowly.

    What nobody closed is looked for here once: the two looks of pytest then find little to go through.
    """
    if host_board := sys.modules.get("support.board.host_board"):
        host_board.write_coverage()
    gc.collect()
    gc.freeze()


def place_files(files: Collection[Path]) -> dict[Path, float]:
    """Return the places of test files in their new order, from 0 to 1."""
    is_waiting = {file: file.relative_to(Path(__file__).parent).parts[0] in WAITING for file in files}
    waiting, computing = ([file for file in files if is_waiting[file] == kind] for kind in (True, False))
    places = {file: WAITING_UNTIL * number / len(waiting) for number, file in enumerate(waiting)}
    return places | {file: (number + 0.5) / len(computing) for number, file in enumerate(computing)}


@pytest.fixture
def thorough(request: pytest.FixtureRequest) -> bool:
    """Whether a test marked `proof` goes through all its seeds (`make proof`) or through a few (`make test`)."""
    return bool(request.config.getoption("--proof"))


@pytest.fixture
def no_crowd(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rig takes this machine for one that nobody else uses, and stretches none of its limits."""
    monkeypatch.setattr("firmware_host.computer_load.load_factor", lambda: 1.0)


@pytest.fixture
def read_by_system() -> Iterator[None]:
    """Run files are read by processes that the system starts, for what is asked of those themselves."""
    with readers_of_system():
        yield


@pytest.fixture(scope="session")
def driver() -> Iterator["Chrome"]:
    """A real browser: one for all pages that this process looks at, as it takes long to start."""
    from support.page.browser import browser  # with Selenium, which few tests need

    with browser(dark=True) as found:
        yield found


@pytest.fixture
def nothing_severe_and_nothing_from_elsewhere(driver: "Chrome") -> Iterator[None]:
    """What is asked of every page, whatever it shows."""
    from support.page.browser import TABLET, list_requested_hosts, set_theme, severe

    driver.get("about:blank")  # a page of before may still ask for a server that is gone
    severe(driver)
    list_requested_hosts(driver)
    set_theme(driver, dark=True)
    driver.set_window_size(*TABLET)
    yield
    assert severe(driver) == [] and list_requested_hosts(driver) <= {"127.0.0.1"}

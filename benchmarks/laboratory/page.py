"""The load of a core by the operator's page: `python benchmarks/laboratory/page.py [seconds]`.

A run with two sensors sends its events fifty times a second: first to no listener, which measures this program alone;
then to a page without browsers; to one with five browsers that read ten frames a second; and with five more that never
read. The browsers are processes of their own. Also prints the longest wait of the run's thread for the page, and the
largest memory.
"""

import multiprocessing
import resource
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import islice
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path
from urllib.parse import urlsplit

from rig.page.page_state import PageState
from rig.page.server.control import Control
from rig.page.server.feed import Feed
from rig.page.server.serving import PageAddress, serving
from rig.station.events import RunEvent

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names
from support.page.scripted_runs import ABOUT, before_it_moves, moving, plan_demo

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

BROWSERS, STALLED = 5, 5
PERIOD_S = 0.02  # between two looks at the arm, as in a run
EVENTS = 3  # in each


def open_stream(url: str) -> socket.socket:
    """Return a connection that has requested the event stream."""
    address = urlsplit(url)
    connection = socket.create_connection((address.hostname or "", address.port or 0))
    connection.sendall(f"GET /events HTTP/1.1\r\nHost: {address.netloc}\r\n\r\n".encode())
    return connection


def browser(url: str, frames: "Synchronized[int]") -> None:
    """Read the event stream as a browser does, and count the frames."""
    connection = open_stream(url)
    while chunk := connection.recv(1 << 16):
        with frames.get_lock():
            frames.value += chunk.count(b"event: ")


def feed_events(events: Iterator[RunEvent], listener: Callable[[RunEvent], None], seconds: float) -> float:
    """Pass events to the listener for `seconds`; return the longest time that one event took, s."""
    longest_s, end_s = 0.0, time.monotonic() + seconds
    while time.monotonic() < end_s:
        for event in islice(events, EVENTS):
            began_s = time.perf_counter()
            listener(event)
            longest_s = max(longest_s, time.perf_counter() - began_s)
        time.sleep(PERIOD_S)
    return longest_s


def make_events(seconds: float) -> Iterator[RunEvent]:
    """Return the events of a run that lasts longer than `seconds`, all made beforehand."""
    return iter([*islice(moving(plan_demo(), 1e9, step_s=PERIOD_S), int(2 * EVENTS * seconds / PERIOD_S))])


def measure(events: Iterator[RunEvent], listener: Callable[[RunEvent], None], seconds: float) -> tuple[float, float]:
    """Return the load of a core, %, and the longest wait, s."""
    used_s, began_s = time.process_time(), time.monotonic()
    longest_s = feed_events(events, listener, seconds)
    return 100 * (time.process_time() - used_s) / (time.monotonic() - began_s), longest_s


def measure_with_page(seconds: float, reading: int, stalled: int) -> tuple[float, float, float]:
    """Return the load of a core, %, the longest wait, s, and the frames per second that one browser read."""
    spawning, feed, events = multiprocessing.get_context("spawn"), Feed(PageState(ABOUT)), make_events(seconds)
    frames = spawning.Value("l", 0)
    for event in before_it_moves(plan_demo()):
        feed.event(event)
    with (
        tempfile.TemporaryDirectory() as folder,
        serving(feed, Control(may_answer=False), Path(folder), PageAddress(port=0)) as url,
    ):
        browsers = [spawning.Process(target=browser, args=(url, frames), daemon=True) for _ in range(reading)]
        for process in browsers:
            process.start()
        silent = [open_stream(url) for _ in range(stalled)]
        while frames.value < reading:  # each has the page
            time.sleep(PERIOD_S)
        before = frames.value
        core_percent, longest_s = measure(events, feed.event, seconds)
        read = (frames.value - before) / seconds / max(reading, 1)
        for connection in silent:
            connection.close()
        for process in browsers:
            process.terminate()
    return core_percent, longest_s, read


def main() -> None:
    """Print the load without and with the page."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    alone, _ = measure(make_events(seconds), lambda event: None, seconds)
    print(f"{'without listeners':30} {alone:5.2f} % of a core")
    for load, reading, stalled in (
        ("a page, nobody looks", 0, 0),
        (f"{BROWSERS} browsers", BROWSERS, 0),
        (f"{BROWSERS} browsers and {STALLED} stalled", BROWSERS, STALLED),
    ):
        core_percent, longest_s, read = measure_with_page(seconds, reading, stalled)
        if reading and not stalled:
            record("operator's page, five browsers", core_percent - alone, "% of a core")
        page = f"the page {core_percent - alone:5.2f} %, {read:4.1f} frames/s read"
        print(f"{load:30} {core_percent:5.2f} % of a core, {page}, longest wait {1e3 * longest_s:.2f} ms")
    print(f"largest memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()

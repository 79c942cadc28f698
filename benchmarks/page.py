"""What the operator's page takes of a core: `python benchmarks/page.py [seconds]`.

A run's events fifty times a second, two sensors' worth of them; five browsers read ten frames a second, five more never
read. Printed beside it: what the same events take while nobody looks, the longest that the run's thread waited for the
page, and the largest memory.
"""

import resource
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from urllib.parse import urlsplit

from rig.page.control import Control
from rig.page.feed import Feed
from rig.page.serving import Address, serving
from rig.page.shown import Shown
from rig.station.events import RunEvent

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1]))  # before the tests' folders of the same names
from support.told_runs import ABOUT, before_it_moves, moving, planned

BROWSERS, STALLED = 5, 5
PERIOD_S = 0.02  # between two looks at the arm, as in a run
EVENTS = 3  # in each


def asking(url: str) -> socket.socket:
    """A connection that has asked for the stream."""
    place = urlsplit(url)
    connection = socket.create_connection((place.hostname or "", place.port or 0))
    connection.sendall(f"GET /events HTTP/1.1\r\nHost: {place.netloc}\r\n\r\n".encode())
    return connection


def reader(connection: socket.socket, taken: list[int]) -> Callable[[], None]:
    """Takes whatever comes and counts it; its work is this process's and counts as the page's."""

    def read() -> None:
        while piece := connection.recv(1 << 16):
            taken.append(len(piece))

    return read


def told(feed: Feed, seconds: float) -> float:
    """Tell a run for so long; the longest that one event took, s."""
    events: list[RunEvent] = list(moving(planned(), 1e9, step_s=PERIOD_S))
    longest_s, end_s = 0.0, time.monotonic() + seconds
    following = iter(events)
    while time.monotonic() < end_s:
        for event in islice(following, EVENTS):
            began_s = time.perf_counter()
            feed.event(event)
            longest_s = max(longest_s, time.perf_counter() - began_s)
        time.sleep(PERIOD_S)
    return longest_s


def main() -> None:
    """Print what it takes, without and with the page."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    for browsers in (False, True):
        feed = Feed(Shown(ABOUT))
        for event in before_it_moves(planned()):
            feed.event(event)
        with (
            tempfile.TemporaryDirectory() as folder,
            serving(feed, Control(may_answer=False), Path(folder), Address(port=0)) as url,
        ):
            taken: list[list[int]] = [[] for _ in range(BROWSERS)]
            connections = [asking(url) for _ in range((BROWSERS + STALLED) * browsers)]
            for connection, sizes in zip(connections, taken, strict=False):
                threading.Thread(target=reader(connection, sizes), daemon=True).start()
            used_s, began_s = time.process_time(), time.monotonic()
            longest_s = told(feed, seconds)
            used, passed_s = time.process_time() - used_s, time.monotonic() - began_s
            frames = sum(map(len, taken)) / passed_s
            for connection in connections:
                connection.shutdown(socket.SHUT_RDWR)
        what = f"{BROWSERS} browsers and {STALLED} stalled" if browsers else "nobody looks"
        share, wait_ms = 100 * used / passed_s, 1e3 * longest_s
        print(f"{what:28} {share:5.1f} % of a core, {frames:5.1f} reads/s, longest wait {wait_ms:.2f} ms")
    print(f"largest memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()

"""A station's heartbeat in a process of its own, for tests that kill it: `python -m support.beating_station URL RIG`.

A line on its standard input is the name of an error that ends its run.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rig.batch.batch import Begun, PartBegun, state_of
from rig.batch.now import Now, Present
from rig.errors import Fault
from rig.floor.heartbeat import heartbeat
from rig.history.place import place
from rig.station.events import Failed, SamplingStarted


@contextmanager
def beating(url: str, rig: str) -> Iterator["subprocess.Popen[str]"]:
    """The process of one, for the length of the `with` block."""
    command = [sys.executable, "-m", "support.beating_station", url, rig]
    found = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(command, env=found, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def main(url: str, rig: str) -> None:
    begun = Begun("A. Person", "W-17", "2026-11-25T08:00:00+00:00")
    with heartbeat(rig, place(url), Now()) as heart:
        present = Present(Now(), (heart.hear,))
        present.batch(state_of([begun, PartBegun(f"{rig}-001", "01", begun.at_utc)]))
        present.event(SamplingStarted())
        print("beats", flush=True)
        for line in sys.stdin:
            present.event(Failed(Fault(line.strip(), "the cable was pulled out", "Plug it in")))


if __name__ == "__main__":
    main(*sys.argv[1:3])

"""Users of a history during a test, each a process: `python -m support.history.history_users WHO …`.

`station FOLDER RIG PAUSE_S SEED` makes a station's accesses to the history named by RIG_HISTORY: its heartbeat, and for
each part the queries before the run and the entries after it, by the program's own functions. The last part follows
when its standard input has ended. `notebook SECONDS` looks calibrations up and keeps a history open meanwhile. Each
line on stdout is JSON.
"""

import json
import os
import random
import sys
import threading
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from support.paths import CONFIGS, RECORDINGS

FIRST = datetime(2026, 1, 1, tzinfo=UTC)
PARTS = 4


def tell(**said: object) -> None:
    print(json.dumps(said), flush=True)


def run_folder(folder: Path, serial_number: str, second: int) -> Path:
    """Make a finished run of a sensor, with a short result and a recording that is not solved; return its folder."""
    folder.mkdir(parents=True)
    result = json.loads((RECORDINGS / "six_observation" / "result.json").read_text(encoding="utf-8"))
    result["gyroscopes"]["gyro"] |= {"serial_number": serial_number, "observations": [], "rests": []}
    moment = (FIRST + timedelta(seconds=second)).isoformat()
    result["provenance"] |= {"started_utc": moment, "solved_utc": moment}
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    (folder / "run.h5").write_text(serial_number, encoding="ascii")
    return folder


def station(folder: Path, rig: str, pause_s: float, seed: int) -> None:
    """Enter parts as a station does."""
    from rig.batch.status import Now
    from rig.commands.history.remember import remember
    from rig.commands.history.run_serials import recall_sensors
    from rig.config.load import load
    from rig.floor.heartbeat import heartbeat
    from rig.history.storage.address import resolve_address
    from rig.station.events import Remembered

    drawn, config, over = random.Random(seed), load(CONFIGS / "ci.yaml").config, threading.Event()

    def listen() -> None:
        sys.stdin.read()
        over.set()

    threading.Thread(target=listen, daemon=True).start()
    now = Now(rig=rig)
    with heartbeat(rig, resolve_address(os.environ["RIG_HISTORY"]), now) as heart:
        tell(state="begun")
        for number in range(PARTS):
            if number == PARTS - 1:
                over.wait()
            serial_number = f"{rig}-{number}"
            heart.hear(replace(now, state="running", part=serial_number))
            silent = recall_sensors(config, frozenset()).silent
            time.sleep(drawn.uniform(0, pause_s))
            event, _ = remember(run_folder(folder / serial_number, serial_number, seed * 100 + number), config.history)
            if isinstance(event, Remembered):
                tell(serial_number=serial_number, numbers=event.numbers, silent=silent)
            else:
                tell(not_remembered=getattr(event, "why", str(event)), silent=silent)
            heart.hear(replace(now, state="waiting"))
            time.sleep(drawn.uniform(0, pause_s))


def notebook(seconds: float) -> None:
    """Keep the history open for `seconds`, and read it repeatedly."""
    import rig
    from rig.notebook.notebook_history import calibrations

    address = os.environ["RIG_HISTORY"]
    with rig.open_history(address) as history:
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            tell(there=len(calibrations(history=address)), here=len(history.calibrations()))


if __name__ == "__main__":
    who, *words = sys.argv[1:]
    if who == "station":
        station(Path(words[0]), words[1], float(words[2]), int(words[3]))
    else:
        notebook(float(words[0]))

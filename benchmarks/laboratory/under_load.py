"""Whether runs succeed on a busy machine: `python benchmarks/laboratory/under_load.py [--demos N] [--busy N]`.

Runs the demonstration alone, then N times, two at a time, with busy loops, each on a loopback address of its own.
Prints the number of runs with a verdict, the faults and refusals of the others by name, the number of missed arm
states, and how much longer a run took than alone. `--keep DIR` keeps the folders of runs that did not pass, with their
logs.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np

from rig.config.load import load
from rig.data.recording.run_file import read_run

DEMO = Path(__file__).parents[2] / "configs" / "demo.yaml"
TIMEOUT_S = 900.0
BUSY_LOOP = "while True: pass"
VERDICTS = {0: "pass", 1: "fail"}


@dataclass(frozen=True, slots=True)
class Demo:
    """A run's end, the verdict or the error's name and message, and the numbers of recorded and missing arm states."""

    ending: str
    message: str
    exit_status: int
    wall_s: float
    states: int
    missed: int


def run_demo(config: Path, folder: Path, keep: Path | None, number: int) -> Demo:
    """Run `config` in a folder and on a loopback address that belong to `number` alone; move what failed to `keep`."""
    host, out = f"127.40.{number // 250 + 1}.{number % 250 + 1}", folder / str(number)
    began_s = time.perf_counter()
    ended = subprocess.run(
        [
            *(sys.executable, "-m", "rig", "run", str(config), "--out", str(out)),
            *("--set", f"arm.host={host}", "--set", f"board.port=socket://{host}:7321"),
        ],
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )
    wall_s = time.perf_counter() - began_s
    errors = re.findall(r"^rig: (\w+): (.*)", ended.stderr, re.MULTILINE)
    name, message = errors[-1] if errors else ("no error", ended.stderr[-200:])
    ending, message = (VERDICTS[ended.returncode], "") if ended.returncode in VERDICTS else (name, f": {message}")
    if ending == "fail":
        checks = json.loads((out / "result.json").read_text(encoding="utf-8"))["checks"]
        message = ": " + ", ".join(f"{check['name']} {check['value']}" for check in checks if not check["passed"])
    states, missed = count_states(out / "run.h5", load(config).config.arm.state_rate_hz)
    if keep is not None and ending != "pass" and out.exists():
        shutil.move(out, keep / str(number))
    return Demo(ending, message, ended.returncode, wall_s, states, missed)


def count_states(recording: Path, state_rate_hz: float) -> tuple[int, int]:
    """Return the numbers of a recording's arm states and of those missing in between; 0 without a recording."""
    if not recording.exists():
        return 0, 0
    time_s = read_run(recording).states["time_s"]
    missed = np.round(np.diff(time_s) * state_rate_hz).astype(int) - 1
    return len(time_s), int(missed.clip(min=0).sum())


@contextmanager
def busy_loops(number: int) -> Iterator[None]:
    """Run `number` processes that never wait, during the `with` block."""
    loops = [subprocess.Popen([sys.executable, "-c", BUSY_LOOP]) for _ in range(number)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


def main() -> int:
    """Run the demonstration alone and with busy loops; print how runs end; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("config", type=Path, nargs="?", default=DEMO, help="a configuration with a world: section")
    parser.add_argument("--demos", type=int, default=40, metavar="N", help="how many runs beside the busy loops")
    parser.add_argument("--at-once", type=int, default=2, metavar="N", help="how many of them at a time")
    parser.add_argument("--busy", type=int, default=3, metavar="N", help="how many busy loops")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="an existing folder for the runs that did not pass")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        run = partial(run_demo, options.config, Path(folder), options.keep)
        quiet = run(0)
        print(f"alone: {quiet.ending} after {quiet.wall_s:.1f} s, {quiet.missed} of {quiet.states} arm states missed")
        with busy_loops(options.busy), ThreadPoolExecutor(options.at_once) as pool:
            demos: list[Demo] = []
            for demo in pool.map(run, range(1, options.demos + 1)):
                demos.append(demo)
                print(
                    f"{len(demos):3}: {demo.ending}, {demo.wall_s:.1f} s, {demo.missed} missed{demo.message}",
                    flush=True,
                )
    endings = Counter(demo.ending for demo in demos)
    verdicts = sum(demo.exit_status in VERDICTS for demo in demos)
    states, missed = sum(demo.states for demo in demos), sum(demo.missed for demo in demos)
    wall_s = [demo.wall_s for demo in demos]
    print(f"{verdicts} verdicts of {len(demos)} demos, {options.at_once} at a time beside {options.busy} busy loops")
    print("endings: " + ", ".join(f"{name} {count}" for name, count in endings.most_common()))
    print(f"arm states missed: {missed} of {states + missed}, {missed / max(1, states + missed):.4%}")
    print(f"slowdown against a run alone: {median(wall_s) / quiet.wall_s:.1f} (worst {max(wall_s) / quiet.wall_s:.1f})")
    return 0 if verdicts == len(demos) else 1


if __name__ == "__main__":
    sys.exit(main())

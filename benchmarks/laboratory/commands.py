"""The time that commands take: `python benchmarks/laboratory/commands.py [--rounds N]`.

`rig solve`, `show`, `plan`, `check` and `--help`, each in a process of its own, by the demonstration's configuration
and a frozen recording of six sweeps. Prints wall time and processor time (user and system, child processes included),
the least of all rounds. The table has the processor time, because wall time depends on other programs too.
"""

import argparse
import resource
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

ROOT = Path(__file__).parents[2]
DEMO = str(ROOT / "configs" / "demo.yaml")
RUN = str(ROOT / "tests" / "fixtures" / "recordings" / "six_observation")
COMMANDS = {
    "rig solve RUN": ("solve", RUN),
    "rig show RUN": ("show", RUN),
    "rig plan CONFIG": ("plan", DEMO),
    "rig check CONFIG": ("check", DEMO),
    "rig --help": ("--help",),
}


def took_s(*arguments: str) -> tuple[float, float]:
    """Return wall and processor time of a command, s."""
    before, began_s = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, "-m", "rig", *arguments], cwd=ROOT, capture_output=True, check=True)
    wall_s, after = time.perf_counter() - began_s, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall_s, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, metavar="N")
    rounds = parser.parse_args().rounds
    for what, arguments in COMMANDS.items():
        walls_s, processor_s = zip(*(took_s(*arguments) for _ in range(rounds)), strict=True)
        print(f"{what:20} {min(walls_s):6.2f} s, {min(processor_s):6.2f} s of a processor")
        record(what, min(processor_s), "s of a processor")


if __name__ == "__main__":
    main()

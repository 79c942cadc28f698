"""Errors and stated uncertainties in new laboratories: `python benchmarks/laboratory/hidden_worlds.py FOLDER`.

Draws laboratories (tests/support/laboratories/hidden_worlds.py). On a UR10e: 60 with a quiet LSM9DS1, 40 with a noisy
one, 20 with a quiet one and an ADIS16465, 20 `imu` with three parts, 10 with a KVH 1775, 6 with an autopilot. On each
of four other arms: 6 with a quiet LSM9DS1. On arms that ripple by any order of the turn: 100 pairs and 40 `imu`. Runs
`rig run` in each, and keeps its recording in FOLDER/family/seed; existing ones are not repeated.

Then all are solved. A table states for each family, part and parameter, with u the standard and U the expanded
uncertainty: the RMS of error/u, the share within U, the largest error/U, the spread of u, and the undamaged runs that
were refused, with the reason. `--solve-only` runs nothing. `--family NAME` and `--count N` select fewer.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names

from support.laboratories.hidden_results import Judged, compare_with_truth, solve
from support.laboratories.hidden_worlds import FAMILIES, WORLDS, first_seed, record


def table(family: str, runs: list[Judged]) -> None:
    """Print the table of a family's runs."""
    refused = {run.folder.name: run.refused for run in runs if run.refused}
    print(f"{family}: {len(runs)} runs, {len(refused)} refused")
    for (part, parameter), line in compare_with_truth(runs).items():
        print(f"  {part:10} {parameter:20} {line}")
    for seed, names in refused.items():
        print(f"  refused: {seed}: {', '.join(names)}")


def main() -> None:
    """Draw, run and solve the laboratories, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--family", action="append", choices=list(FAMILIES))
    parser.add_argument("--count", type=int)
    parser.add_argument("--solve-only", action="store_true")
    arguments = parser.parse_args()
    for family in arguments.family or FAMILIES:
        first, count = first_seed(family), min(arguments.count or WORLDS[family], WORLDS[family])
        folders = [arguments.folder / family / str(seed) for seed in range(first, first + count)]
        for folder in folders:
            if not arguments.solve_only and not folder.exists():
                record(family, int(folder.name), folder)
        finished = [folder for folder in folders if (folder / "status").exists()]
        if finished:
            table(family, [solve(folder) for folder in finished])


if __name__ == "__main__":
    main()

"""Whether what is stated holds in laboratories that nobody has seen: `python benchmarks/hidden_worlds.py FOLDER`.

Draws 60 laboratories with a quiet LSM9DS1, 40 with a noisy one, 20 with an ADIS16465 beside a quiet one, 20 of `imu`
with three parts and 10 with a KVH 1775 (tests/support/hidden_worlds.py), runs `rig run` in each, and keeps its
recording in FOLDER/family/seed; those that are there are not made again. Then all are solved, and a table says of each
family, part and parameter: RMS of error over u, the share within U, the largest error over U, the spread of u, and
which undamaged runs were refused and by what. `--solve-only` runs nothing. `--family NAME` and `--count N` take fewer.
"""

import argparse
import subprocess
import sys
from pathlib import Path

import yaml

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[1]))  # before the tests' folders of the same names

from support.hidden_results import Judged, held, solved
from support.hidden_worlds import FAMILIES, WORLDS, at_address, first_seed

TIMEOUT_S = 3000.0


def recorded(family: str, seed: int, folder: Path) -> None:
    """`rig run` in `folder`, which keeps its configuration, its run folder and what it said."""
    folder.mkdir(parents=True)
    config = folder / "config.yaml"
    document = at_address(FAMILIES[family](seed), f"127.{100 + seed // 1000}.{seed % 1000 // 200 + 1}.{seed % 200 + 1}")
    config.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    command = [sys.executable, "-m", "rig", "run", str(config), "--out", str(folder / "run")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    (folder / "said").write_text(done.stdout + done.stderr, encoding="utf-8")
    (folder / "status").write_text(f"{done.returncode}\n", encoding="utf-8")


def table(family: str, runs: list[Judged]) -> None:
    """Printed."""
    refused = {run.folder.name: run.refused for run in runs if run.refused}
    print(f"{family}: {len(runs)} runs, {len(refused)} refused")
    for (part, parameter), line in held(runs).items():
        print(f"  {part:10} {parameter:20} {line}")
    for seed, names in refused.items():
        print(f"  refused: {seed}: {', '.join(names)}")


def main() -> None:
    """As the module says."""
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
                recorded(family, int(folder.name), folder)
        finished = [folder for folder in folders if (folder / "status").exists()]
        if finished:
            table(family, [solved(folder) for folder in finished])


if __name__ == "__main__":
    main()

"""Hundreds of calibrations in one laboratory: `python benchmarks/laboratory/long_life.py [--runs N] [--out DIR]`.

One world and one board that is never reset; three runs of four in one rig process, the fourth in a process of its own;
every tenth calibration is stored on the board. After the second run the laboratory waits for an hour of its own time,
so that the board's counter of microseconds wraps in the middle of the third. Prints one line a run, then memory, open
files, and the course of each parameter. It fails if memory has grown by more than 5 % after the first tenth, if a file,
a thread or a process remains, if a parameter drifts by more than three standard uncertainties of its slope, or if its
scatter contradicts the stated uncertainty.
"""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names
from support.laboratories.long_life import Calibration, Life, complaints, courses, live

ROOT = Path(__file__).parents[2]


def report(run: Calibration) -> None:
    """Print one line of progress."""
    kept = " ".join(
        f"{name} {resources.rss / 2**20:.1f} MiB {sum(resources.files.values())} files"
        for name, resources in (("world", run.world), ("station", run.station))
        if resources is not None
    )
    location = "station" if run.in_station else "own process"
    print(f"{run.number:3} {location}: status {run.status}, {run.wall_s:.1f} s, wraps {run.wraps}; {kept}", flush=True)


def conclude(life: Life, warm_up: int) -> int:
    """Print the results; return 1 if there are defects, else 0."""
    defects = complaints(life, warm_up)
    passed = [run for run in life.runs if run.status == 0]
    worst_u = max(run.error_u for run in passed)
    print(f"{len(passed)} of {len(life.runs)} runs passed, the worst {worst_u:.1f} U from the truth")
    _, after = life.board
    print(
        f"the board ran {after.uptime_s / 60:.0f} min since its reset ({after.reset_cause}); its counter wrapped "
        f"{life.wraps} times, {sum(run.wraps for run in passed)} of them while it sampled"
    )
    for name in ("world", "station"):
        first, warm, last = (getattr(passed[index], name) for index in (0, warm_up, -1))
        print(
            f"{name}: {first.rss / 2**20:.1f} MiB after the first run, {warm.rss / 2**20:.1f} after {warm_up + 1}, "
            f"{last.rss / 2**20:.1f} in the end ({last.rss / warm.rss - 1:+.1%}); files {sum(warm.files.values())} and "
            f"{sum(last.files.values())}, threads {warm.threads} and {last.threads}, "
            f"children {warm.children} and {last.children}"
        )
    for course in courses(passed):
        print(
            f"{course.name}: mean {course.mean:.6f}, slope {course.slope:+.1e} ± {course.slope_std:.1e} a run "
            f"({course.slope / course.slope_std:+.1f} σ), χ² {course.chi2:.0f} of {course.dof}"
        )
    commit = subprocess.run(
        ["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    )
    print("\n".join(defects) or "nothing grew, nothing drifted, nothing was left open")
    print(f"at commit {commit.stdout.strip() or 'unknown'}")
    return 1 if defects else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=200, metavar="N")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "long_life", metavar="DIR", help="made afresh")
    options = parser.parse_args()
    shutil.rmtree(options.out, ignore_errors=True)
    options.out.mkdir(parents=True)
    for event in live(options.out, options.runs):
        if isinstance(event, Life):
            return conclude(event, max(3, options.runs // 10))
        report(event)
    return 1


if __name__ == "__main__":
    sys.exit(main())

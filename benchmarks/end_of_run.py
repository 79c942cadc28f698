"""What the end of a run costs: `python benchmarks/end_of_run.py [RUN_FOLDER | --fixture] [--rounds N]`.

Observe, solve, judge, compare and write, of a verified run recorded at commit af3b9f0, by the rig of that commit and by
this one, in turn, each in a process of its own. The run is the paper's experiment, recorded first by that rig (some
minutes); one recorded earlier (RUN_FOLDER); or the small one the tests have (--fixture).

Printed is CPU time, user and system, child processes included: the least of all rounds, and the ratios without and with
reading the recordings. Both have loaded SciPy's interpolation before, as a run has; matplotlib they load themselves.
"""

import argparse
import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
FIXTURE = ROOT / "tests" / "fixtures" / "recordings" / "verified"
EXPERIMENT = Path("configs") / "lsm9ds1_adis16465.yaml"
BEFORE = "af3b9f0"

# As `Session.calibrate` of that commit ended a run, and as `Run.carry_out` of this one does.
OLD = """
from rig.recording import read_run
from rig.report.outcome import outcome_of, write_outcome

def end(runs, repeated, folder):
    outcome_of(runs)
    list(write_outcome(folder, outcome_of(runs, repeated)))
"""
NEW = """
import rig.cli
from rig.analysis.analyses import calibrated, verified
from rig.data.run_file import read_run
from rig.report.writers import write_outcome

def end(runs, repeated, folder):
    list(write_outcome(folder, verified(calibrated(runs), repeated)))
"""
MEASURE = """
import json, resource, sys
from pathlib import Path
import scipy.interpolate

def cpu_s():
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)

recorded, folder = map(Path, sys.argv[1:])
began_s = cpu_s()
runs, repeated = [read_run(recorded / "run.h5")], [read_run(recorded / "verify.h5")]
read_s = cpu_s()
end(runs, repeated, folder)
print(json.dumps([cpu_s() - read_s, read_s - began_s]))
"""


def measure(program: str, house: Path, recorded: Path) -> tuple[float, float]:
    """CPU seconds of the end of a run and of reading its recordings, by the rig that lies in `house`."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", program + MEASURE, str(recorded), folder],
            env={**os.environ, "PYTHONPATH": str(house)},
            cwd=house,
            stdout=subprocess.PIPE,
            check=True,
        )
        assert (Path(folder) / "result.json").exists()
    end_s, read_s = json.loads(done.stdout)
    return end_s, read_s


def record(house: Path, folder: Path) -> None:
    """Record the paper's experiment in `folder`, by the rig that lies in `house`."""
    command = [sys.executable, "-m", "rig", "run", str(house / EXPERIMENT), "--out", str(folder)]
    environment = {**os.environ, "PYTHONPATH": str(house)}
    subprocess.run(command, env=environment, cwd=house, stdout=subprocess.DEVNULL, check=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    recorded = parser.add_mutually_exclusive_group()
    recorded.add_argument("run_folder", nargs="?", type=Path)
    recorded.add_argument("--fixture", action="store_true")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        earlier, run_folder = Path(folder) / BEFORE, FIXTURE if options.fixture else options.run_folder
        archive = subprocess.run(["git", "archive", BEFORE], cwd=ROOT, stdout=subprocess.PIPE, check=True).stdout
        with tarfile.open(fileobj=io.BytesIO(archive)) as files:
            files.extractall(earlier, filter="data")
        if run_folder is None:
            run_folder = Path(folder) / "experiment"
            record(earlier, run_folder)
        houses = {BEFORE: (OLD, earlier), "now": (NEW, ROOT)}
        rounds = [
            {name: measure(program, house, run_folder.resolve()) for name, (program, house) in houses.items()}
            for _ in range(options.rounds)
        ]
    least_s = {name: [min(each[name][part] for each in rounds) for part in range(2)] for name in houses}
    for name, (end_s, read_s) in least_s.items():
        told = ", ".join(f"{sum(each[name]):.2f}" for each in rounds)
        print(f"{name:8} end of run {end_s:.2f} s CPU, reading {read_s:.2f} s (rounds, both: {told})")
    (end_s, read_s), (end_before_s, read_before_s) = least_s["now"], least_s[BEFORE]
    print(f"ratio {end_s / end_before_s:.2f}; with reading {(end_s + read_s) / (end_before_s + read_before_s):.2f}")


if __name__ == "__main__":
    main()

"""The processor time of a run's end: `python benchmarks/laboratory/end_of_run.py [RUN_FOLDER] [--rounds N]`.

A verified run (by default the tests' frozen one) is observed and solved, then judged, compared and written as at a
run's end, in turn, each in a process of its own. Prints the processor time (user and system, child processes included),
the least of all rounds, and the ratio. Both have loaded SciPy's special functions before, as a run has; only the end
loads matplotlib.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

ROOT = Path(__file__).parents[2]
FIXTURE = ROOT / "tests" / "fixtures" / "recordings" / "verified"

SOLVE = "calibrate(runs)"
END = "list(write_outcome(folder, verify_calibration(calibrate(runs), repeated)))"
MEASURE = """
import resource, sys
from pathlib import Path
import scipy.special
import rig.cli
from rig.analysis.analyses import calibrate, verify_calibration
from rig.data.recording.run_file import read_run
from rig.report.writers import write_outcome

def cpu_s():
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)

recorded, folder = map(Path, sys.argv[1:])
runs, repeated = [read_run(recorded / "run.h5")], [read_run(recorded / "verify.h5")]
began_s = cpu_s()
{what}
print(cpu_s() - began_s)
"""


def measure(what: str, recorded: Path) -> float:
    """Return the processor time of the Python expression `what`, s, for a recorded run."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", MEASURE.format(what=what), str(recorded), folder]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True)
    return float(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run_folder", nargs="?", type=Path, default=FIXTURE)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    rounds = [[measure(what, options.run_folder.resolve()) for what in (SOLVE, END)] for _ in range(options.rounds)]
    solve_s, end_s = (min(seconds) for seconds in zip(*rounds, strict=True))
    record("end of a run, more than its solve", end_s - solve_s, "s")
    print(f"solve {solve_s:.2f} s, end of run {end_s:.2f} s of a processor; ratio {end_s / solve_s:.2f}")


if __name__ == "__main__":
    main()

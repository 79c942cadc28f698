"""The processor time of a history: `python benchmarks/laboratory/history.py [--calibrations N]`.

Prints three times, each measured together with its comparison: to look up one serial number among N calibrations,
compared with a hundredth of them; what certificate and entry add to the end of a run, in a new process with a run's
modules loaded; and `rig --help`, compared with a Python that imports nothing.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
import timeit
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from rig.history.entered.finished_run import FinishedRun, read_finished_run
from rig.history.store import History, Selection, open_history

ROOT = Path(__file__).parents[2]
FIXTURE = ROOT / "tests" / "fixtures" / "recordings" / "six_observation"
OF_EACH = 20  # calibrations
FIRST = datetime(2025, 1, 1, tzinfo=UTC)

END_OF_RUN = """
import sys, time
from pathlib import Path
import rig.commands.measure.carry_out
from rig.commands.history.remember import remember
from rig.config.judging.judging_sections import HistorySection
from rig.data.result_file import read_result
from rig.report.certificate.certificate_page import write_certificate

folder = Path(sys.argv[1])
document = read_result(folder)
began_s = time.perf_counter()
write_certificate(None, document, folder)
between_s = time.perf_counter()
event, _ = remember(folder, HistorySection())
assert type(event).__name__ == "Remembered", event
print(between_s - began_s, time.perf_counter() - between_s)
"""


def make_runs(count: int) -> list[FinishedRun]:
    """Return `count` runs of `count / OF_EACH` sensors, in turn."""
    first = read_finished_run(FIXTURE)
    (sensor,) = first.document.gyroscopes.values()
    slim = sensor.model_copy(update={"observations": (), "rests": ()})
    results = []
    for i in range(count):
        started = (FIRST + timedelta(hours=i)).isoformat()
        run = slim.model_copy(update={"serial_number": f"S-{i % (count // OF_EACH)}"})
        provenance = first.document.provenance.model_copy(update={"started_utc": started})
        document = first.document.model_copy(update={"provenance": provenance, "gyroscopes": {"gyro": run}})
        results.append(replace(first, text=document.text(), document=document))
    return results


def measure_look_up_s(history: History) -> float:
    """Return the median time of many look-ups, s."""
    selection = Selection(serial_number="S-0")
    assert len(history.calibrations(selection)) == OF_EACH
    return float(np.median(timeit.repeat(lambda: history.calibrations(selection), number=1, repeat=200)))


def measure_process_s(*arguments: str) -> float:
    """Return the shortest time, s, of several Python processes with these arguments."""
    least = np.inf
    for _ in range(5):
        began_s = time.perf_counter()
        subprocess.run([sys.executable, *arguments], stdout=subprocess.DEVNULL, check=True)
        least = min(least, time.perf_counter() - began_s)
    return float(least)


def main() -> None:
    """Print the times to enter and look up calibrations, to end a run, and to print the help."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calibrations", type=int, default=10_000, metavar="N")
    count = parser.parse_args().calibrations
    with tempfile.TemporaryDirectory() as folder:
        results = {}
        for size in (count // 100, count):
            with open_history(str(Path(folder) / f"{size}.sqlite")) as history:
                began_s = time.perf_counter()
                for finished in make_runs(size):
                    history.enter(finished)
                entered_s = time.perf_counter() - began_s
                results[size] = measure_look_up_s(history)
            look_up = f"{1e3 * results[size]:.2f} ms to look up {OF_EACH} of one sensor"
            print(f"{size} calibrations: {1e3 * entered_s / size:.1f} ms to make and enter each, {look_up}")
        print(f"ratio {results[count] / results[count // 100]:.2f}")
        run = Path(folder) / "run"
        run.mkdir()
        for file in FIXTURE.iterdir():
            (run / file.name).write_bytes(file.read_bytes())
        environment = {**os.environ, "RIG_HISTORY": str(Path(folder) / f"{count}.sqlite")}
        command = [sys.executable, "-c", END_OF_RUN, str(run)]
        times = []
        for _ in range(3):
            done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=True)
            times.append(list(map(float, done.stdout.split())))
    certificate_s, entry_s = np.min(times, axis=0)
    total = f"both {certificate_s + entry_s:.2f} s"
    print(f"end of a run: certificate {certificate_s:.2f} s, history {entry_s:.2f} s, {total}")
    bare_s, help_s = measure_process_s("-c", ""), measure_process_s("-m", "rig", "--help")
    print(f"rig --help {help_s:.2f} s, a Python that imports nothing {bare_s:.2f} s, ratio {help_s / bare_s:.1f}")


if __name__ == "__main__":
    main()

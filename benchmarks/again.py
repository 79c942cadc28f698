"""How much faster two workers solve a history than one: `python benchmarks/again.py [--recordings N] [--rounds N]`.

A history of N copies of a small recording is solved one by one in this process, by one Dask worker, and by two, each
worker a process with one thread. One and two workers take turns, round by round. Printed is the
least time of each, and the ratio. The answers of all three must be equal, to the last digit. Needs the extra `dask` and
two processors that nobody else uses.
"""

import argparse
import shutil
import tempfile
import time
from pathlib import Path

from rig.commands.again_work import Task, solved_again
from rig.commands.spread import Cluster, one_by_one, spread
from rig.data.settings import RECKONING
from rig.history.again import Answer
from rig.history.finished import recording_of

ROOT = Path(__file__).parents[1]
FIXTURE = ROOT / "tests" / "fixtures" / "af3b9f0" / "calibration"


def tasks(count: int, folder: Path) -> list[Task]:
    """As many recordings, each in a folder of its own."""
    found = []
    for i in range(count):
        run = folder / f"run {i}"
        run.mkdir()
        shutil.copy(FIXTURE / "run.h5", run)
        places = (("this", str(run)),)
        found.append(Task(str(i), (recording_of(run / "run.h5"),), places, (f"reckoning={RECKONING}",), None))
    return found


def on_a_cluster(todo: list[Task], workers: int) -> tuple[float, dict[str, Answer]]:
    """Seconds from the first recording to the last, once the workers have solved one each; and the answers."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None) as local,  # type: ignore[no-untyped-call]
        Client(local) as client,  # type: ignore[no-untyped-call]
    ):
        client.run(solved_again, todo[0])  # so that all is imported
        began_s = time.perf_counter()
        answers = {task.key: answer for task, answer in spread(todo, solved_again, Cluster(client))}
        return time.perf_counter() - began_s, answers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=300, metavar="N")
    parser.add_argument("--rounds", type=int, default=3, metavar="N")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        todo = tasks(options.recordings, Path(folder))
        began_s = time.perf_counter()
        alone = {task.key: answer for task, answer in one_by_one(todo, solved_again)}
        print(f"{len(todo)} recordings, one by one in this process: {time.perf_counter() - began_s:.1f} s", flush=True)
        least_s: dict[int, float] = {}
        for _ in range(options.rounds):
            for workers in (1, 2):
                took_s, answers = on_a_cluster(todo, workers)
                assert answers == alone, "the numbers depend on who solves"
                least_s[workers] = min(took_s, least_s.get(workers, took_s))
                print(f"{workers} worker(s): {took_s:.1f} s", flush=True)
    print(f"one worker {least_s[1]:.1f} s, two {least_s[2]:.1f} s, ratio {least_s[1] / least_s[2]:.2f}")


if __name__ == "__main__":
    main()

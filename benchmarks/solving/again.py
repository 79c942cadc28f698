"""How much faster two workers solve a history: `python benchmarks/solving/again.py [--recordings N] [--rounds N]`.

A history of N recordings is solved one by one in this process, by one Dask worker, and by two, each worker a process
with one thread. One and two workers take turns, round by round. The recordings are copies of the frozen ones of six
sweeps, each in a folder and under a number of its own; what is solved does not know that there are others like it.
Printed is the least time of each, and the ratio. The answers of all three must be equal, to the last digit.

Needs the extra `dask` and two processors that nobody else uses. Where others use them, the processor time tells what
the ratio would be: solving is divided among the workers, while handing out is done by one process, this one.
"""

import argparse
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from rig.commands.history.recompute_worker import Task, solve_task
from rig.commands.history.worker_pools import Cluster, distribute, solve_one_by_one
from rig.history.entered.finished_run import recording_of
from rig.history.recompute.result_comparison import Answer

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

FROZEN = Path(__file__).parents[2] / "tests" / "fixtures" / "recordings"
KINDS = ("six_observation", "resumed", "speeds")


@dataclass(frozen=True, slots=True)
class Took:
    """Seconds from the first recording to the last, and of a processor: for solving, and for handing out."""

    wall_s: float
    solving_s: float
    handing_out_s: float


def tasks(count: int, folder: Path) -> list[Task]:
    """As many recordings, each in a folder of its own."""
    found = []
    for i in range(count):
        run = folder / f"run {i}"
        run.mkdir()
        shutil.copy(FROZEN / KINDS[i % len(KINDS)] / "run.h5", run)
        places = (("this", str(run)),)
        found.append(Task(str(i), (recording_of(run / "run.h5"),), places, (), None))
    return found


def on_a_cluster(todo: list[Task], workers: int) -> tuple[Took, dict[str, Answer]]:
    """What it took once the workers have solved one of each kind, so that all is imported; and the answers."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None) as local,  # type: ignore[no-untyped-call]
        Client(local) as client,  # type: ignore[no-untyped-call]
    ):
        for each in todo[: len(KINDS)]:
            client.run(solve_task, each)
        solving_s, here_s, began_s = client.run(time.process_time), time.process_time(), time.perf_counter()
        answers = {task.key: answer for task, answer in distribute(todo, solve_task, Cluster(client))}
        wall_s, here_s = time.perf_counter() - began_s, time.process_time() - here_s
        solved_s = sum(client.run(time.process_time).values()) - sum(solving_s.values())
        return Took(wall_s, solved_s, here_s), answers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=300, metavar="N")
    parser.add_argument("--rounds", type=int, default=1, metavar="N")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        todo = tasks(options.recordings, Path(folder))
        began_s, here_s = time.perf_counter(), time.process_time()
        alone = {task.key: answer for task, answer in solve_one_by_one(todo, solve_task)}
        alone_took = f"{time.perf_counter() - began_s:.1f} s, {time.process_time() - here_s:.1f} s of a processor"
        record("solve of a recording, again", len(todo) / (time.process_time() - here_s), "recordings/s")
        print(f"{len(todo)} recordings, one by one in this process: {alone_took}", flush=True)
        least_s: dict[int, float] = {}
        for _ in range(options.rounds):
            for workers in (1, 2):
                took, answers = on_a_cluster(todo, workers)
                assert answers == alone, "the numbers depend on who solves"
                least_s[workers] = min(took.wall_s, least_s.get(workers, took.wall_s))
                of_a_processor = f"solving {took.solving_s:.1f} s, handing out {took.handing_out_s:.1f} s"
                print(f"{workers} worker(s): {took.wall_s:.1f} s; of a processor: {of_a_processor}", flush=True)
    print(f"one worker {least_s[1]:.1f} s, two {least_s[2]:.1f} s, ratio {least_s[1] / least_s[2]:.2f}")


if __name__ == "__main__":
    main()

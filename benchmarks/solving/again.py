"""The gain of a second worker in solving a history: `python benchmarks/solving/again.py [--recordings N] [--rounds N]`.

A history of N recordings is solved one by one in this process, by one Dask worker, and by two, each worker a process
with one thread. One and two workers take turns, round by round. The recordings are copies of the frozen ones of six
sweeps, each in a folder and under its own number; the solver does not exploit that they are alike. Prints the shortest
time of each, and the ratio. The answers of all three must be equal to the last digit.

Needs the extra `dask` and two idle processors. If others use them, the processor time shows the ratio without them: the
workers share the solving, while this one process distributes the tasks.
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
class Duration:
    """Seconds from the first recording to the last, and processor seconds for solving and for distributing."""

    wall_s: float
    solving_s: float
    handing_out_s: float


def make_tasks(count: int, folder: Path) -> list[Task]:
    """Return `count` tasks, each with its own copy of a recording."""
    task_list = []
    for i in range(count):
        run = folder / f"run {i}"
        run.mkdir()
        shutil.copy(FROZEN / KINDS[i % len(KINDS)] / "run.h5", run)
        folders = (("this", str(run)),)
        task_list.append(Task(str(i), (recording_of(run / "run.h5"),), folders, (), None))
    return task_list


def solve_on_cluster(tasks_to_solve: list[Task], workers: int) -> tuple[Duration, dict[str, Answer]]:
    """Return duration and answers, after every worker has imported all modules by a task of each kind."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None) as local,
        Client(local) as client,
    ):
        for task in tasks_to_solve[: len(KINDS)]:
            client.run(solve_task, task)
        solving_s, own_s, began_s = client.run(time.process_time), time.process_time(), time.perf_counter()
        answers = {task.key: answer for task, answer in distribute(tasks_to_solve, solve_task, Cluster(client))}
        wall_s, own_s = time.perf_counter() - began_s, time.process_time() - own_s
        solved_s = sum(client.run(time.process_time).values()) - sum(solving_s.values())
        return Duration(wall_s, solved_s, own_s), answers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=300, metavar="N")
    parser.add_argument("--rounds", type=int, default=1, metavar="N")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tasks_to_solve = make_tasks(options.recordings, Path(folder))
        began_s, own_s = time.perf_counter(), time.process_time()
        answers_alone = {task.key: answer for task, answer in solve_one_by_one(tasks_to_solve, solve_task)}
        duration_alone = f"{time.perf_counter() - began_s:.1f} s, {time.process_time() - own_s:.1f} s of a processor"
        record("solve of a recording, again", len(tasks_to_solve) / (time.process_time() - own_s), "recordings/s")
        print(f"{len(tasks_to_solve)} recordings, one by one in this process: {duration_alone}", flush=True)
        shortest_s: dict[int, float] = {}
        for _ in range(options.rounds):
            for workers in (1, 2):
                duration, answers = solve_on_cluster(tasks_to_solve, workers)
                assert answers == answers_alone, "the numbers depend on who solves"
                shortest_s[workers] = min(duration.wall_s, shortest_s.get(workers, duration.wall_s))
                processor_times = f"solving {duration.solving_s:.1f} s, handing out {duration.handing_out_s:.1f} s"
                print(f"{workers} worker(s): {duration.wall_s:.1f} s; of a processor: {processor_times}", flush=True)
    print(f"one worker {shortest_s[1]:.1f} s, two {shortest_s[2]:.1f} s, ratio {shortest_s[1] / shortest_s[2]:.2f}")


if __name__ == "__main__":
    main()

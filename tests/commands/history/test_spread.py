"""Who solves where: a worker that dies costs what it had in hand and no other; a cluster that goes away is named."""

import os
from pathlib import Path

import pytest

from rig.commands.history.worker_pools import Cluster, Processes, connect_client, distribute, solve_one_by_one
from rig.data.run_folder import RESULT
from rig.errors import Fault
from rig.history.recompute.result_comparison import RecomputedResult, Unsolved
from support.history.recompute_stand_ins import DEADLY, WAITING, answer_at_once, deadly, failing, task, waiting
from support.processes.clusters import local_cluster

NAMES = (*(f"before {i}" for i in range(3)), DEADLY, *(f"after {i}" for i in range(4)))
TASKS = [task(name) for name in NAMES]


@pytest.mark.slow
def test_a_process_that_dies_costs_its_recording_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "1")  # as the command line says it
    with Processes(2) as hands:
        answers = {task.key: answer for task, answer in distribute(TASKS, deadly, hands)}
    assert isinstance(lost := answers.pop(DEADLY), Unsolved) and lost.state == "lost"
    assert sorted(answers) == sorted(set(NAMES) - {DEADLY})
    assert all(isinstance(answer, RecomputedResult) and answer.verdict == key for key, answer in answers.items())
    workers = {answer.failed for answer in answers.values() if isinstance(answer, RecomputedResult)}
    assert {threads for _, threads in workers} == {"1"}
    assert str(os.getpid()) not in {number for number, _ in workers}


def test_a_defect_at_one_recording_costs_no_other_here() -> None:
    answers = {task.key: answer for task, answer in solve_one_by_one(TASKS, failing)}
    assert answers.pop(DEADLY) == Unsolved("failed", "ZeroDivisionError: a defect")
    assert all(isinstance(answer, RecomputedResult) for answer in answers.values()) and len(answers) == len(NAMES) - 1


@pytest.mark.thorough
@pytest.mark.slow
def test_workers_of_a_cluster_work_in_processes_of_their_own_and_one_that_dies_costs_no_other(tmp_path: Path) -> None:
    with local_cluster(n_workers=2, processes=True) as cluster, connect_client(cluster.scheduler_address) as client:
        tasks = [*(task(name) for name in NAMES if name != DEADLY), task(f"{WAITING} 1", tmp_path)]
        killed = False
        answers = {}
        for each, answer in distribute(tasks, waiting, Cluster(client)):
            answers[each.key] = answer
            if not killed:
                pids = client.run(os.getpid)
                os.kill(next(iter(pids.values())), 9)
                (tmp_path / RESULT).touch()
                killed = True
    assert sorted(answers) == sorted(each.key for each in tasks)
    assert all(isinstance(answer, RecomputedResult) and answer.verdict == key for key, answer in answers.items())
    workers = {answer.failed for answer in answers.values() if isinstance(answer, RecomputedResult)}
    assert str(os.getpid()) not in {number for number, _ in workers} and {threads for _, threads in workers} == {"1"}


@pytest.mark.slow
def test_a_cluster_without_workers_is_waited_for_and_then_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.commands.history.worker_pools.NEW_WORKERS_S", 0.5)
    with (
        local_cluster(n_workers=0, processes=False) as cluster,
        connect_client(cluster.scheduler_address) as client,
        pytest.raises(Fault, match="no worker for"),
    ):
        list(distribute(TASKS, answer_at_once, Cluster(client)))

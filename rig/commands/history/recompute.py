"""`rig history recompute`: solve a history's recordings by today's method, report changes, overwrite nothing."""

import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from rich.console import Console

from rig.commands.history.history_answer import await_answer
from rig.commands.history.history_queries import open_named_history
from rig.commands.history.recompute_worker import Task, solve_task
from rig.commands.history.worker_pools import Cluster, Processes, Solve, SolvedTask, distribute, solve_one_by_one
from rig.commands.report_folder import refuse_unwritable
from rig.config.files.safe_writing import write_new
from rig.data.recording.settings import find_setting
from rig.data.run_folder import refuse_links
from rig.data.version import VERSION
from rig.errors import Fault, Refused
from rig.history.recompute.recompute_journal import JOURNAL, RecomputeJournal, RecomputeQuestion
from rig.history.recompute.recompute_report import CSV, PAGE, counts, notable_table, recompute_csv, recompute_page
from rig.history.recompute.result_comparison import (
    Answer,
    RecomputeOutcome,
    StatedResult,
    match_answers,
    pending_recordings,
)
from rig.history.recompute.selection import list_stated_results
from rig.history.store import Selection
from rig.station.plain_text import say

CHANGED_STATUS = 1
MAX_LINES = 20  # on the terminal; the page has them all


def recompute_history(options: Namespace, solve: Solve = solve_task) -> int:
    """Solve the chosen recordings again and write the report into `--out`.

    Return 1 if a result needs attention. Raise Refused `bad_option`, `unknown_setting`, `unknown_estimator`,
    `not_in_history`, `another_question`, `report_folder`, and what `open_named_history`, `refuse_links` and
    `connect_client` raise; Fault `cluster_lost`, after a report of the recordings solved until then.
    """
    question = _question(options)
    selection = Selection(options.serial_number, options.part, options.since, options.rig)
    label, stated = await_answer(lambda: _load_stated(options, selection))
    out: Path = options.out
    refuse_links(*(out / name for name in (JOURNAL, CSV, PAGE)))
    with refuse_unwritable(out):
        out.mkdir(parents=True, exist_ok=True)
    with RecomputeJournal(out, question) as journal:
        answers = dict(journal.solved)
        remaining = pending_recordings(stated, answers)
        if len(remaining) < len(stated):
            say(f"{len(stated) - len(remaining)} of {len(stated)} are already solved in {out / JOURNAL}", sys.stderr)
        tasks = [
            Task(result.content_sha256, result.recordings, result.places, question.overrides, question.estimator)
            for result in remaining
        ]
        lost = _solve_all(tasks, options, solve, journal, answers)
    outcome = match_answers(stated, answers, options.u_fraction)
    with refuse_unwritable(out):
        write_new(out / CSV, recompute_csv(outcome))
        write_new(out / PAGE, recompute_page(outcome, question, label))
    _print(outcome, out)
    if lost is not None:
        raise lost
    return 0 if outcome.same else CHANGED_STATUS


def _question(options: Namespace) -> RecomputeQuestion:
    """Return the program, settings and estimator of the recomputation. Raise Refused for an unusable option."""
    from rig.analysis.estimator_names import find_estimator

    if options.jobs < 1:
        raise Refused("bad_option", f"--jobs {options.jobs} is too small", "Give 1 or more")
    if not options.u_fraction > 0:
        raise Refused(
            "bad_option",
            f"--u-fraction {options.u_fraction} is not a fraction of U",
            "Give a number above 0, such as 0.1",
        )
    for item in options.overrides:
        find_setting(item)
    if options.estimator is not None:
        find_estimator(options.estimator)
    return RecomputeQuestion(VERSION, tuple(options.overrides), options.estimator)


def _load_stated(options: Namespace, selection: Selection) -> tuple[str, tuple[StatedResult, ...]]:
    with open_named_history(options) as history:
        results = list_stated_results(history, selection)
        label = history.engine.url.render_as_string()
    if not results:
        raise Refused("not_in_history", "no calibration in the history matches", "List all with `rig history`")
    return label, results


def _solve_all(
    tasks: Sequence[Task], options: Namespace, solve: Solve, journal: RecomputeJournal, answers: dict[str, Answer]
) -> Fault | None:
    """Solve all tasks and record each answer. Return the fault if the cluster was lost, else None."""
    try:
        with _solve_by_workers(tasks, options, solve) as answers_by_task:
            for task, answer in _track_progress(answers_by_task, len(tasks)):
                answers[task.key] = answer
                journal.note(task.key, answer)
    except Fault as lost:
        return lost
    except KeyboardInterrupt:
        raise KeyboardInterrupt("interrupted; the solved results are kept, and the same command continues") from None
    return None


@contextmanager
def _solve_by_workers(tasks: Sequence[Task], options: Namespace, solve: Solve) -> Iterator[Iterable[SolvedTask]]:
    """Yield the answers of this process, of several processes or of a Dask cluster, as the options request."""
    with ExitStack() as stack:
        if not tasks:
            yield ()
        elif options.dask is not None:
            from rig.commands.history.worker_pools import connect_client

            cluster = Cluster(stack.enter_context(connect_client(options.dask)))
            for worker, threads in cluster.threads().items():
                if threads > 1:
                    one = "dask worker --nworkers auto --nthreads 1 is faster"
                    say(
                        f"{worker} has {threads} threads in one process; only one works at a time: {one}",
                        sys.stderr,
                    )
            yield distribute(tasks, solve, cluster)
        elif options.jobs > 1:
            yield distribute(tasks, solve, stack.enter_context(Processes(min(options.jobs, len(tasks)))))
        else:
            yield solve_one_by_one(tasks, solve)


def _track_progress(answers_by_task: Iterable[SolvedTask], total: int) -> Iterable[SolvedTask]:
    from rich.progress import track

    console = Console(stderr=True)
    return track(answers_by_task, total=total, description="solving", console=console, disable=not console.is_terminal)


def _print(outcome: RecomputeOutcome, out: Path) -> None:
    if outcome.notable:
        Console(highlight=False).print(notable_table(outcome, MAX_LINES))
    count = sum(max(1, len(row.stated.calibrations)) for row in outcome.notable)
    if count > MAX_LINES:
        say(f"and {count - MAX_LINES} more in {out / PAGE}")
    for line in counts(outcome):
        say(line)
    for name in (CSV, PAGE):
        say(f"written: {out / name}", sys.stderr)

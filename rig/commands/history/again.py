"""`rig history recompute`: all recordings of a history by today's method, and what that changes. Overwrites nothing."""

import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from rich.console import Console

from rig.commands.history.again_work import Task, solved_again
from rig.commands.history.questions import opened
from rig.commands.history.spread import Answered, Cluster, Processes, Solve, one_by_one, spread
from rig.commands.history.waiting import answer_of
from rig.config.files.written_file import write_new
from rig.data.recording.settings import find_setting
from rig.data.run_folder import refuse_links
from rig.data.version import VERSION
from rig.errors import Fault, Refused
from rig.history.again.answer import Answer, RecomputeOutcome, StatedResult, compared, to_solve
from rig.history.again.done import JOURNAL, RecomputeJournal, RecomputeQuestion
from rig.history.again.plan import list_stated_results
from rig.history.again.report import CSV, PAGE, again_csv, again_page, counts, notable_table
from rig.history.store import Selection
from rig.station.plain_text import say

CHANGED = 1
MOST_SHOWN = 20  # lines on the terminal; the page has them all


def again(options: Namespace, solve: Solve = solved_again) -> int:
    """Solve again what was chosen, and write the report into `--out`. Returns 1 when anything is to be looked at.

    Raises Refused `bad_option`, `unknown_setting`, `unknown_estimator`, `not_in_history`, `another_question`,
    `report_folder`, and as `opened`, `refuse_links` and `client_of`; Fault `cluster_lost`, with a report of what was
    solved until then.
    """
    question = _question(options)
    selection = Selection(options.serial_number, options.part, options.since, options.rig)
    label, stated = answer_of(lambda: _stated(options, selection))
    out: Path = options.out
    refuse_links(*(out / name for name in (JOURNAL, CSV, PAGE)))
    with _written(out):
        out.mkdir(parents=True, exist_ok=True)
    with RecomputeJournal(out, question) as journal:
        answers = dict(journal.solved)
        left = to_solve(stated, answers)
        if len(left) < len(stated):
            say(f"{len(stated) - len(left)} of {len(stated)} are solved in {out / JOURNAL} already", sys.stderr)
        tasks = [
            Task(each.content_sha256, each.recordings, each.places, question.overrides, question.estimator)
            for each in left
        ]
        lost = _solve_all(tasks, options, solve, journal, answers)
    outcome = compared(stated, answers, options.u_fraction)
    with _written(out):
        write_new(out / CSV, again_csv(outcome))
        write_new(out / PAGE, again_page(outcome, question, label))
    _print(outcome, out)
    if lost is not None:
        raise lost
    return 0 if outcome.same else CHANGED


def _question(options: Namespace) -> RecomputeQuestion:
    from rig.analysis.estimators import find_estimator

    if options.jobs < 1:
        raise Refused("bad_option", f"--jobs {options.jobs} is too small", "Give 1 or more")
    if not options.u_fraction > 0:
        raise Refused(
            "bad_option", f"--u-fraction {options.u_fraction} is no part of U", "Give a number above 0, as 0.1"
        )
    for item in options.overrides:
        find_setting(item)
    if options.estimator is not None:
        find_estimator(options.estimator)
    return RecomputeQuestion(VERSION, tuple(options.overrides), options.estimator)


def _stated(options: Namespace, selection: Selection) -> tuple[str, tuple[StatedResult, ...]]:
    with opened(options) as history:
        found = list_stated_results(history, selection)
        label = history.engine.url.render_as_string()
    if not found:
        raise Refused("not_in_history", "no calibration in the history fits", "Look with `rig history`")
    return label, found


def _solve_all(
    tasks: Sequence[Task], options: Namespace, solve: Solve, journal: RecomputeJournal, answers: dict[str, Answer]
) -> Fault | None:
    """Have all solved and note each answer; the fault with which a cluster went away."""
    try:
        with _answered(tasks, options, solve) as answered:
            for task, answer in _bar(answered, len(tasks)):
                answers[task.key] = answer
                journal.note(task.key, answer)
    except Fault as lost:
        return lost
    except KeyboardInterrupt:
        raise KeyboardInterrupt("interrupted; what is solved is kept, and the same command goes on") from None
    return None


@contextmanager
def _answered(tasks: Sequence[Task], options: Namespace, solve: Solve) -> Iterator[Iterable[Answered]]:
    with ExitStack() as stack:
        if not tasks:
            yield ()
        elif options.dask is not None:
            from rig.commands.history.cluster import client_of

            cluster = Cluster(stack.enter_context(client_of(options.dask)))
            for worker, threads in cluster.threads().items():
                if threads > 1:
                    one = "dask worker --nworkers auto --nthreads 1 is faster"
                    say(
                        f"{worker} has {threads} threads in one process, of which one works at a time: {one}",
                        sys.stderr,
                    )
            yield spread(tasks, solve, cluster)
        elif options.jobs > 1:
            yield spread(tasks, solve, stack.enter_context(Processes(min(options.jobs, len(tasks)))))
        else:
            yield one_by_one(tasks, solve)


def _bar(answered: Iterable[Answered], total: int) -> Iterable[Answered]:
    from rich.progress import track

    console = Console(stderr=True)
    return track(answered, total=total, description="solving", console=console, disable=not console.is_terminal)


@contextmanager
def _written(out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise Refused("report_folder", f"{out} cannot be written: {error}", "Choose another with --out") from error


def _print(outcome: RecomputeOutcome, out: Path) -> None:
    if outcome.notable:
        Console(highlight=False).print(notable_table(outcome, MOST_SHOWN))
    lines = sum(max(1, len(each.stated.calibrations)) for each in outcome.notable)
    if lines > MOST_SHOWN:
        say(f"and {lines - MOST_SHOWN} more in {out / PAGE}")
    for line in counts(outcome):
        say(line)
    for name in (CSV, PAGE):
        say(f"written: {out / name}", sys.stderr)

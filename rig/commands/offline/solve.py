"""`rig solve`: recompute a recording, or solve samples of other programs with their sweeps or attitudes."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from rig.commands.config_arguments import add_json, add_run, add_set
from rig.commands.offline import solve_external
from rig.errors import Refused
from rig.station.plain_text import say, say_on_terminal

SAMPLE_SUFFIXES = {".csv", ".tsv", ".txt", ".ulg", ".db3", ".mcap"}  # of files that are no recordings of the rig


def add(solve: ArgumentParser) -> None:
    """Add the arguments of `rig solve`."""
    add_run(
        solve,
        "run",
        "a run folder or its run.h5; with --sweeps, --attitudes or --turns, samples of another program: CSV, a bag, "
        ".ulg, .mat",
    )
    motion = solve.add_mutually_exclusive_group()
    motion.add_argument(
        "--sweeps", type=Path, metavar="CSV", help="file of the sweeps, for samples that another program recorded"
    )
    motion.add_argument(
        "--attitudes", type=Path, metavar="CSV", help="the attitudes in which the samples were recorded"
    )
    motion.add_argument(
        "--turns",
        action="store_true",
        help="samples of a sensor turned by hand on a table, whose motion the samples give",
    )
    solve.add_argument(
        "--estimator",
        metavar="NAME",
        help="vector (default), newton, levenberg_marquardt, or algorithm_1 (as published); with --sweeps also "
        "increments (default for turns from rest to rest); with --attitudes increments (gyroscope), "
        "attitude_weighted, maximum_likelihood, or as_published; with --turns there is no choice",
    )
    judge = "judge by another threshold or limit than recorded, for example observation.max_lost_fraction=0.01"
    add_set(solve, judge, metavar="NAME=VALUE")
    solve.add_argument(
        "--script",
        type=Path,
        metavar="FILE",
        help="the script that recorded it, if it is another user's; it is executed",
    )
    shown = solve.add_mutually_exclusive_group()
    add_json(shown)
    shown.add_argument("--all", action="store_true", help="every table: values, budgets, checks")
    solve_external.add(solve)


def run(options: Namespace) -> int:
    """Solve a recording, or samples with sweeps or attitudes, print the result, and return the exit status.

    For a recording, write nothing. Raise Refused `bad_option`, `unknown_setting`, and the errors of the solution.
    """
    if options.sweeps is None and options.attitudes is None and not options.turns:
        if options.out is not None:
            raise Refused("bad_option", "--out is for samples with their motion", "Use rig report RUN --out DIR")
        _refuse_samples(options.run)
        solve_external.refuse_for_recording(options)
        return _solve_recording(options)
    if options.overrides:
        raise Refused("unknown_setting", "samples of another program have no settings", "Leave out --set")
    return solve_external.run(options)


def _refuse_samples(path: Path) -> None:
    """Raise Refused `bad_option` for a file of samples without an option that gives the sensor's motion."""
    if path.is_file() and path.suffix.lower() in SAMPLE_SUFFIXES:
        raise Refused(
            "bad_option",
            f"{path} holds samples, but no option states how the sensor was turned",
            "Give --turns (by hand on a table), --sweeps CSV or --attitudes CSV; for a sensor at rest: rig allan",
        )


def _solve_recording(options: Namespace) -> int:
    """Recompute the result of a run folder or a run file.

    Return 0 if it passed, else 1. `--set` changes the settings for the judgement, such as `limits.scale_std`.
    `--script` names the script of another user's recording.
    """
    from rig.data.recording.run_reading import reading_ahead

    with reading_ahead(options.run) as begun:
        from rig.plans.recorded_run import describe_omission, judge_phases, open_run
        from rig.report.document import document_of
        from rig.report.terminal.result_table import print_outcome

        run = open_run(options.run, options.script, begun=begun).override_settings(options.overrides)
    say_on_terminal("solving")
    outcome = judge_phases(run, options.estimator)
    if (omission := describe_omission(run)) is not None:
        say(omission, sys.stderr)
    folder = options.run if options.run.is_dir() else options.run.parent
    print_outcome(document_of(outcome), as_json=options.json, whole=options.all, folder=folder)
    return 0 if outcome.passed else 1

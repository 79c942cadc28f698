"""`rig solve`: a recording once more, or samples recorded elsewhere, with their sweeps or attitudes."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from rig.commands.config_arguments import add_json, add_set
from rig.errors import Refused
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.station.plain_text import say


def add(solve: ArgumentParser) -> None:
    """The arguments of `rig solve`."""
    solve.add_argument(
        "run", type=Path, metavar="RUN", help="a run folder or its run.h5; with --sweeps or --attitudes, samples as CSV"
    )
    elsewhere = solve.add_mutually_exclusive_group()
    elsewhere.add_argument("--sweeps", type=Path, metavar="CSV", help="the sweeps, for samples recorded elsewhere")
    elsewhere.add_argument("--attitudes", type=Path, metavar="CSV", help="the attitudes, for samples recorded in them")
    solve.add_argument(
        "--estimator",
        metavar="NAME",
        help="vector (default), newton, levenberg_marquardt, or algorithm_1, as published; with --sweeps increments "
        "too (default for turns from rest to rest); with --attitudes increments (gyroscope), attitude_weighted, "
        "maximum_likelihood, or as_published",
    )
    judge = "judge by another threshold or limit than was recorded, for example observation.max_lost_fraction=0.01"
    add_set(solve, judge, metavar="NAME=VALUE")
    solve.add_argument(
        "--script", type=Path, metavar="FILE", help="the script it was recorded by, where that is another's; executed"
    )
    add_json(solve)
    place = solve.add_argument_group("with --attitudes")
    place.add_argument(
        "--gravity-m-s2",
        type=float,
        default=STANDARD_GRAVITY_M_S2,
        metavar="G",
        help="size of gravity at the place (default: the standard 9.80665); scale factors are relative to it",
    )
    place.add_argument(
        "--up",
        default="+z",
        choices=("+x", "-x", "+y", "-y", "+z", "-z"),
        help="axis of the table that points upwards, roughly (default: +z)",
    )
    place.add_argument("--field-t", type=float, metavar="B", help="size of the magnetic field, for a magnetometer")
    place.add_argument("--field-upwards", action="store_true", help="the magnetic field rises from the ground")
    place.add_argument("--any-mounting", action="store_true", help="the sensor's axes need not lie along the body's")
    place.add_argument(
        "--find-clock",
        action="store_true",
        help="the attitudes are on a clock of their own: find it by the turning that both files show",
    )
    place.add_argument(
        "--exact-rates",
        action="store_true",
        help="the attitudes' rates are exact, as a rate table's are: solve the gyroscope by them, not by increments",
    )
    place.add_argument(
        "--window-s",
        type=float,
        metavar="SECONDS",
        help="over which attitudes are averaged for a gyroscope's increments (default: 1, less for short recordings)",
    )
    place.add_argument("--second-order", action="store_true", help="find the accelerometer's second-order terms too")


def run(options: Namespace) -> int:
    """Solve a recording, samples with sweeps, or samples with attitudes, and print the result; writes nothing."""
    if options.sweeps is None and options.attitudes is None:
        return _recording(options)
    if options.overrides:
        raise Refused("unknown_setting", "samples as CSV come without settings", "Leave out --set")
    if options.sweeps is not None:
        from rig.commands.solve_csv import solve_sweeps

        return solve_sweeps(options.run, options.sweeps, options.estimator, as_json=options.json)
    for name, value in (
        ("--gravity-m-s2", options.gravity_m_s2),
        ("--field-t", options.field_t),
        ("--window-s", options.window_s),
    ):
        if value is not None and not 0 < value < float("inf"):
            raise Refused("bad_option", f"{name} is {value:g}", "Give its size, in SI units")
    from rig.analysis.attitudes import Surrounding
    from rig.commands.solve_attitudes import solve_attitudes

    return solve_attitudes(
        options.run,
        options.attitudes,
        options.estimator,
        Surrounding(options.gravity_m_s2, options.field_t, options.up, options.field_upwards, options.any_mounting),
        second_order=options.second_order,
        find_clock=options.find_clock,
        exact_rates=options.exact_rates,
        window_s=options.window_s,
        as_json=options.json,
    )


def _recording(options: Namespace) -> int:
    """Recompute the result of a run folder or a run file. Returns as `rig run` does.

    `--set` changes what it is judged by, see `RunSettings.with_overrides`. `--script` is the one it was recorded by,
    where that is another's.
    """
    from rig.analysis.calibration import DEFAULT_ESTIMATOR
    from rig.plans.recorded import judged, left_out, open_run
    from rig.report.document import document_of
    from rig.report.table import print_outcome

    run = open_run(options.run, options.script).judged_by(options.overrides)
    outcome = judged(run, options.estimator or DEFAULT_ESTIMATOR)
    if (said := left_out(run)) is not None:
        say(said, sys.stderr)
    print_outcome(document_of(outcome), as_json=options.json)
    return 0 if outcome.passed else 1

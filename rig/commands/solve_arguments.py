"""What `rig solve` takes, and which of the three ways of solving it means. Nothing heavy is imported for the help."""

import argparse
from pathlib import Path

from rig.errors import Refused
from rig.estimation.earth import STANDARD_GRAVITY_M_S2


def add_arguments(solve: argparse.ArgumentParser) -> None:
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
    solve.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        dest="overrides",
        help="judge by another threshold or limit than was recorded, for example observation.max_lost_fraction=0.01",
    )
    solve.add_argument(
        "--script", type=Path, metavar="FILE", help="the script it was recorded by, where that is another's; executed"
    )
    solve.add_argument("--json", action="store_true", help="for machines")
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


def solve(options: argparse.Namespace) -> int:
    """A recording, samples with sweeps, or samples with attitudes."""
    if options.sweeps is None and options.attitudes is None:
        from rig.analysis.calibration import DEFAULT_ESTIMATOR
        from rig.commands.solve import solve

        return solve(
            options.run,
            options.estimator or DEFAULT_ESTIMATOR,
            options.overrides,
            script=options.script,
            as_json=options.json,
        )
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

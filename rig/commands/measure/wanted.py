"""`rig plan CONFIG --target-uncertainty …`: the shortest run for an uncertainty, and the configuration of it."""

import json
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import Refused
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.analysis.design.shortest import Planned, TargetUncertainty

# What may be wanted, and how `rig.analysis.design.shortest.TargetUncertainty` calls it.
NAMES = {
    "scale": "scale",
    "bias": "bias_rad_s",
    "acceleration_scale": "acceleration_scale",
    "acceleration_bias": "acceleration_bias_m_s2",
}
EXAMPLE = "Give for example --target-uncertainty scale=5e-4 --target-uncertainty bias=1e-4"


def add_wanted(parser: ArgumentParser) -> None:
    """`--target-uncertainty`, any number of times, with what belongs to it."""
    parser.add_argument(
        "--target-uncertainty",
        action="append",
        default=[],
        metavar="scale=U",
        help="the shortest run that is predicted to reach this expanded uncertainty (k = 2): scale=U, bias=U in rad/s, "
        "acceleration_scale=U, acceleration_bias=U in m/s²",
    )
    parser.add_argument("--max-duration-s", type=float, metavar="S", help="… in so many seconds")
    parser.add_argument("--write", type=Path, metavar="FILE", help="write the configuration of that run, a new file")


def print_shortest_run(options: Namespace) -> int:
    """Print the shortest run for what is wanted, and write its configuration; returns 1 where there is none.

    Raises Refused `bad_option`, `configuration_not_written`, `not_foretold`, and as `configured`.
    """
    say("rig plan: looking for the shortest run …", file=sys.stderr)
    from rig.commands.configured import configured
    from rig.plans.shortest import shortest_run
    from rig.report.terminal.shortest_words import print_shortest

    wanted = wanted_of(options.target_uncertainty, options.max_duration_s)
    if options.table or options.script is not None:
        raise Refused(
            "bad_option", "--target-uncertainty goes with no --table and no --script", "Write the configuration first"
        )
    if options.write is not None and options.write.exists():
        raise _not_written(options.write, "it is there already")
    config = configured(options.config, options.overrides).loaded.config
    found = shortest_run(config, wanted)
    print_shortest(found, config.procedure, as_json=options.json)
    if found.best is None:
        return 1
    if options.write is not None:
        _write(options, found.best)
    return 0


def wanted_of(options: Sequence[str], at_most_s: float | None) -> "TargetUncertainty":
    """What the words `scale=U`, `bias=U` and the like say. Raises Refused `bad_option`."""
    from rig.analysis.design.shortest import TargetUncertainty

    sizes: dict[str, float] = {}
    for each in options:
        name, _, value = each.partition("=")
        try:
            sizes[name] = float(value)
        except ValueError:
            raise Refused("bad_option", f"--target-uncertainty {each} is no size", EXAMPLE) from None
        if name not in NAMES or not 0 < sizes[name] < inf:
            raise Refused("bad_option", f"--target-uncertainty {each} is no uncertainty of {', '.join(NAMES)}", EXAMPLE)
    if not sizes:
        raise Refused("bad_option", "--max-duration-s and --write are for a run with --target-uncertainty", EXAMPLE)
    if at_most_s is not None and not (isfinite(at_most_s) and at_most_s > 0):
        raise Refused("bad_option", f"--max-duration-s is {at_most_s:g}", "Give a time above 0, in seconds")
    wanted = {NAMES[name]: size for name, size in sizes.items()}
    return TargetUncertainty(**wanted, at_most_s=inf if at_most_s is None else at_most_s)


def _write(options: Namespace, best: "Planned") -> None:
    """The configuration of a run, as `rig run` takes it: what the file says, with the procedure that was found."""
    from rig.commands.configured import configured
    from rig.config.files.written_file import write_new
    from rig.report.terminal.shortest_words import changed_keys

    section = configured(options.config, options.overrides).loaded.config.procedure
    changed = changed_keys(section, best.candidate.procedure)
    overrides = [f"procedure.{key}={json.dumps(value)}" for key, value in changed.items()]
    loaded = configured(options.config, [*options.overrides, *overrides]).loaded
    reached = best.reached
    predicted = ", ".join(f"{name} {size:.3g}" for name, each in NAMES.items() if (size := getattr(reached, each)) > 0)
    predicted = f"{best.candidate.duration_s:.1f} s, U: {predicted} (SI units)"
    said = f"# Made by rig plan --target-uncertainty. Predicted: {predicted}.\n"
    try:
        write_new(options.write, said + loaded.text)
    except OSError as error:
        raise _not_written(options.write, str(error.strerror or error)) from error


def _not_written(path: Path, why: str) -> Refused:
    return Refused("configuration_not_written", f"{path} cannot be written: {why}", "Name a new file with --write")

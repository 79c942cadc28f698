"""`rig plan CONFIG --target-uncertainty …`: the shortest run for an uncertainty, and its configuration."""

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
    from rig.analysis.design.candidate_search import PlannedCandidate, TargetUncertainty

# The names on the command line, and those of `rig.analysis.design.candidate_search.TargetUncertainty`.
TARGETS = {
    "scale": "scale",
    "bias": "bias_rad_s",
    "acceleration_scale": "acceleration_scale",
    "acceleration_bias": "acceleration_bias_m_s2",
}
EXAMPLE = "Give for example --target-uncertainty scale=5e-4 --target-uncertainty bias=1e-4"


def add_target(parser: ArgumentParser) -> None:
    """Add `--target-uncertainty`, which may be repeated, and the arguments that limit the search for a run."""
    parser.add_argument(
        "--target-uncertainty",
        action="append",
        default=[],
        metavar="scale=U",
        help="find the shortest run predicted to reach this expanded uncertainty (k = 2): scale=U, bias=U in rad/s, "
        "acceleration_scale=U, acceleration_bias=U in m/s²",
    )
    parser.add_argument("--max-duration-s", type=float, metavar="S", help="longest duration of that run, in s")
    parser.add_argument("--write", type=Path, metavar="FILE", help="write the configuration of that run to a new file")


def print_shortest_run(options: Namespace) -> int:
    """Print the shortest run for the target, and write its configuration; return 1 if there is none.

    Raise Refused `bad_option`, `configuration_not_written`, `not_predictable`, and what `load_configured` raises.
    """
    say("rig plan: looking for the shortest run …", file=sys.stderr)
    from rig.commands.configured import load_configured
    from rig.plans.shortest_run import shortest_run
    from rig.report.terminal.shortest_words import print_shortest

    target = parse_target(options.target_uncertainty, options.max_duration_s)
    if options.table or options.script is not None:
        raise Refused(
            "bad_option",
            "--target-uncertainty cannot be combined with --table or --script",
            "Write the configuration first",
        )
    if options.write is not None and options.write.exists():
        raise _not_written(options.write, "it exists already")
    config = load_configured(options.config, options.overrides).loaded.config
    answer = shortest_run(config, target)
    print_shortest(answer, config.procedure, as_json=options.json)
    if answer.best is None:
        return 1
    if options.write is not None:
        _write(options, answer.best)
    return 0


def parse_target(options: Sequence[str], at_most_s: float | None) -> "TargetUncertainty":
    """Return the targets in options such as `scale=U`, and the longest duration. Raise Refused `bad_option`."""
    from rig.analysis.design.candidate_search import TargetUncertainty

    uncertainties: dict[str, float] = {}
    for option in options:
        name, _, value = option.partition("=")
        try:
            uncertainties[name] = float(value)
        except ValueError:
            raise Refused("bad_option", f"--target-uncertainty {option} is not a number", EXAMPLE) from None
        if name not in TARGETS or not 0 < uncertainties[name] < inf:
            raise Refused("bad_option", f"--target-uncertainty {option} is not one of {', '.join(TARGETS)}", EXAMPLE)
    if not uncertainties:
        raise Refused("bad_option", "--max-duration-s and --write are for a run with --target-uncertainty", EXAMPLE)
    if at_most_s is not None and not (isfinite(at_most_s) and at_most_s > 0):
        raise Refused("bad_option", f"--max-duration-s is {at_most_s:g}", "Give a time above 0, in seconds")
    wanted = {TARGETS[name]: size for name, size in uncertainties.items()}
    return TargetUncertainty(**wanted, at_most_s=inf if at_most_s is None else at_most_s)


def _write(options: Namespace, best: "PlannedCandidate") -> None:
    """Write a configuration for `rig run`: the file's values with the procedure of the plan."""
    from rig.commands.configured import load_configured
    from rig.config.files.safe_writing import write_new
    from rig.report.terminal.shortest_words import list_key_changes

    section = load_configured(options.config, options.overrides).loaded.config.procedure
    changed = list_key_changes(section, best.candidate.procedure)
    overrides = [f"procedure.{key}={json.dumps(value)}" for key, value in changed.items()]
    loaded = load_configured(options.config, [*options.overrides, *overrides]).loaded
    reached = best.reached
    predicted = ", ".join(f"{name} {size:.3g}" for name, key in TARGETS.items() if (size := getattr(reached, key)) > 0)
    predicted = f"{best.candidate.duration_s:.1f} s, U: {predicted} (SI units)"
    comment = f"# Made by rig plan --target-uncertainty. Predicted: {predicted}.\n"
    try:
        write_new(options.write, comment + loaded.text)
    except OSError as error:
        raise _not_written(options.write, str(error.strerror or error)) from error


def _not_written(path: Path, why: str) -> Refused:
    return Refused("configuration_not_written", f"{path} cannot be written: {why}", "Name a new file with --write")

"""`rig plan`: the dry run. Connects to nothing."""

import json
from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_json, add_script
from rig.commands.measure.target_uncertainty import add_target, print_shortest_run
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.config.procedures.hand_sections import ByHandSection
    from rig.report.terminal.plan_table import DryRun


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig plan`."""
    add_config(parser)
    add_script(parser)
    form = parser.add_mutually_exclusive_group()
    add_json(form)
    form.add_argument(
        "--table", action="store_true", help="print the sweeps as CSV, a profile for each axis: time, angle, rate"
    )
    add_target(parser)


def run(options: Namespace) -> int:
    """Print the plan of `make_plan`, or the shortest plan for a target uncertainty.

    Return 0, or 1 if no plan reaches the target. Raise Refused as `make_plan` and `print_shortest_run` do.
    """
    if options.target_uncertainty or options.max_duration_s is not None or options.write is not None:
        return print_shortest_run(options)
    from rig.config.procedures.hand_sections import ByHandSection
    from rig.report.terminal.plan_profile import profile_csv
    from rig.report.terminal.plan_table import print_plan

    dry_run = make_plan(options)
    if isinstance(dry_run.config.procedure, ByHandSection):
        _print_by_hand(dry_run.config.procedure, as_json=options.json)
        return 0
    if options.table:
        for line in profile_csv(dry_run.plan):
            say(line)
    else:
        print_plan(dry_run, as_json=options.json)
    return 0


def _print_by_hand(section: "ByHandSection", *, as_json: bool) -> None:
    """Print the instructions to the operator, in the order of an uninterrupted session."""
    from rig.plans.by_hand import WantedMoves, simulate_session

    instructions = list(simulate_session(WantedMoves(section.flips, section.turns)))
    if as_json:
        moves = [{"say": step.say, "face": step.face, "turns": step.turns} for step in instructions]
        say(json.dumps({"schema": "rig.by_hand_plan/1", "moves": moves}))
        return
    for number, step in enumerate(instructions, 1):
        say(f"{number:2d}  {step.words}")
    say(f"{len(instructions)} moves, {section.rest_s:g} s of rest between them; any order does")


def make_plan(options: Namespace) -> "DryRun":
    """Return the plan, which begins at home. Raise Refused for a motion beyond a limit, or insufficient attitudes."""
    from rig.commands.configured import load_configured
    from rig.errors import refuse
    from rig.report.terminal.plan_table import DryRun
    from rig.turners.turner_registry import kind_of

    configured = load_configured(options.config, options.overrides, options.script)
    steps = configured.phase.plan()
    config = configured.loaded.config
    kind = kind_of(config.turner)
    refuse(kind.problems([steps], config.turner, None))
    model = kind.describe_configured(config.turner).model
    return DryRun(model, steps, config, repeated=configured.phase.follows is not None)

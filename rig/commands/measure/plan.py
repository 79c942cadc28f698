"""`rig plan`: the dry run. Connects to nothing."""

import json
from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_json, add_script
from rig.commands.measure.wanted import add_wanted, print_shortest_run
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.config.procedures.hand_sections import ByHandSection
    from rig.report.terminal.plan_table import DryRun


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig plan`."""
    add_config(parser)
    add_script(parser)
    form = parser.add_mutually_exclusive_group()
    add_json(form)
    form.add_argument(
        "--table", action="store_true", help="the sweeps as CSV, a profile for each axis: time, angle, rate"
    )
    add_wanted(parser)


def run(options: Namespace) -> int:
    """Print the plan as `planned` has it, or the shortest one for what is wanted.

    Returns 0, or 1 where no plan has that. Raises Refused as `planned` and `print_shortest_run`.
    """
    if options.target_uncertainty or options.max_duration_s is not None or options.write is not None:
        return print_shortest_run(options)
    from rig.config.procedures.hand_sections import ByHandSection
    from rig.report.terminal.plan_profile import profile_csv
    from rig.report.terminal.plan_table import print_plan

    found = planned(options)
    if isinstance(found.config.procedure, ByHandSection):
        _print_by_hand(found.config.procedure, as_json=options.json)
        return 0
    if options.table:
        for line in profile_csv(found.plan):
            say(line)
    else:
        print_plan(found, as_json=options.json)
    return 0


def _print_by_hand(section: "ByHandSection", *, as_json: bool) -> None:
    """What an operator is asked for, in the order in which it is when nothing comes between."""
    from rig.plans.by_hand import WantedMoves, simulate_session

    asked = list(simulate_session(WantedMoves(section.flips, section.turns)))
    if as_json:
        moves = [{"say": each.say, "face": each.face, "turns": each.turns} for each in asked]
        say(json.dumps({"schema": "rig.by_hand_plan/1", "moves": moves}))
        return
    for number, each in enumerate(asked, 1):
        say(f"{number:2d}  {each.words}")
    say(f"{len(asked)} moves, {section.rest_s:g} s of rest between them; any order does")


def planned(options: Namespace) -> "DryRun":
    """The plan from the home pose.

    Raises `Refused` when a motion breaks a limit, and when the attitudes do not tell enough.
    """
    from rig.commands.configured import configured
    from rig.errors import refuse
    from rig.report.terminal.plan_table import DryRun
    from rig.turners.registry import kind_of

    found = configured(options.config, options.overrides, options.script)
    steps = found.phase.plan()
    config = found.loaded.config
    kind = kind_of(config.turner)
    refuse(kind.problems([steps], config.turner, None))
    model = kind.describe_configured(config.turner).model
    return DryRun(model, steps, config, repeated=found.phase.follows is not None)

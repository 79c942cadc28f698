"""`rig plan`: the dry run. Connects to nothing."""

from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_json, add_script
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.report.plan_table import Planned


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig plan`."""
    add_config(parser)
    add_script(parser)
    form = parser.add_mutually_exclusive_group()
    add_json(form)
    form.add_argument(
        "--table", action="store_true", help="the sweeps as CSV, a profile for each axis: time, angle, rate"
    )


def run(options: Namespace) -> int:
    """Print the plan as `planned` has it; returns 0."""
    from rig.report.plan_profile import profile_csv
    from rig.report.plan_table import print_plan

    found = planned(options)
    if options.table:
        for line in profile_csv(found.plan):
            say(line)
    else:
        print_plan(found, as_json=options.json)
    return 0


def planned(options: Namespace) -> "Planned":
    """The plan from the home pose.

    Raises `Refused` when a motion breaks a limit, and when the attitudes do not tell enough.
    """
    from rig.commands.configured import configured
    from rig.errors import refuse
    from rig.report.plan_table import Planned
    from rig.turners.registry import kind_of

    found = configured(options.config, options.overrides, options.script)
    steps = found.phase.plan()
    config = found.loaded.config
    kind = kind_of(config.turner)
    refuse(kind.problems([steps], config.turner, None))
    model = kind.meant(config.turner).model
    return Planned(model, steps, config, repeated=found.phase.follows is not None)

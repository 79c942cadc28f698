"""`rig resume`: go on with an interrupted run."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from rig.commands.config_arguments import add_run, add_set
from rig.commands.measure.notice import noticed
from rig.commands.measure.run import add_outcome
from rig.commands.page_arguments import wish
from rig.errors import Refused


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig resume`."""
    add_run(parser, "run_folder", "an interrupted run", metavar="RUN_DIR")
    parser.add_argument("--script", type=Path, metavar="FILE", help="the script it was begun with, of another's folder")
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ADDRESS",
        help="an address in a folder that is not of a run of yours, to which it may connect; for each of them",
    )
    add_set(parser, "a board, a sensor or the arm answers elsewhere now: board.port=/dev/ttyACM1", "KEY=ADDRESS")
    add_outcome(parser)


def run(options: Namespace) -> int:
    """Go on with an interrupted run by the script it was begun with: sweeps it has finished count, the others are done.

    A sweep that the verdict named as disturbed is repeated. Of a folder that is somebody else's `--script` names the
    script, which is executed, and `--connect` the addresses that may be connected to; `--set` names new addresses of
    devices. Returns as `rig run` does. Raises Refused `no_run`, `already_finished`, and as `refuse_links`,
    `read_result`, `refuse_other_changes`, `refuse_foreign_addresses`, `script_identity` and `kept_script`.
    """
    page = wish(options)
    from rig.commands.configured import configured_here
    from rig.commands.measure.carry_out import carry_out
    from rig.commands.measure.consent import refuse_foreign_addresses
    from rig.commands.measure.moved_addresses import refuse_other_changes
    from rig.config.load import load
    from rig.data.latest_run import note_run
    from rig.data.result_file import read_result
    from rig.data.run_folder import CONFIG, RESULT, SCRIPT, refuse_links, script_identity
    from rig.plans.script_file import kept_script, load_script
    from rig.turners.registry import sections

    folder: Path = options.run_folder
    if not (folder / CONFIG).exists():
        raise Refused("no_run", f"{folder} holds no {CONFIG}", "Give the folder of an interrupted run")
    if (folder / RESULT).exists() and all(check.means.sweep is None for check in read_result(folder).checks):
        raise Refused("already_finished", f"{folder} has its {RESULT}", "Start a new run with `rig run`")
    if not (folder / SCRIPT).exists():
        raise Refused(
            "another_script",
            f"{folder} contains no {SCRIPT}, so the script with which it was begun is not known",
            "Start a new run with `rig run`",
        )
    refuse_links(*folder.iterdir())
    begun = load(folder / CONFIG, sections=None, turners=sections())
    named_now = refuse_other_changes(begun, options.overrides)
    now = load(folder / CONFIG, options.overrides, sections=None, turners=sections())
    refuse_foreign_addresses(folder, now, [*options.connect, *named_now])
    named = None if options.script is None else load_script(options.script)
    script, moved = kept_script(folder, script_identity(folder), named), frozenset(options.other_board)
    note_run(folder)
    with configured_here(folder / CONFIG, options.overrides, script=script) as found:

        def work() -> int:
            return carry_out(folder, found, assume_yes=options.yes, moved=moved, as_json=options.json, page=page)

        return noticed(options.notify, folder, work)

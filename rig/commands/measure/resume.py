"""`rig resume`: continue an interrupted run."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from rig.commands.config_arguments import add_run, add_set
from rig.commands.measure.notice import notify_after
from rig.commands.measure.run import add_outcome
from rig.commands.page_arguments import read_page_wish
from rig.errors import Refused


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig resume`."""
    add_run(parser, "run_folder", "an interrupted run", metavar="RUN_DIR")
    parser.add_argument("--script", type=Path, metavar="FILE", help="its script, if the folder is another user's")
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ADDRESS",
        help="permit this address in another user's run folder; may be repeated",
    )
    add_set(parser, "give a new address of a board, a sensor or the arm: board.port=/dev/ttyACM1", "KEY=ADDRESS")
    add_outcome(parser)


def run(options: Namespace) -> int:
    """Continue an interrupted run with its own script, for the sweeps that are not finished.

    Sweeps that the verdict named as disturbed are repeated. In another user's folder, `--script` names the script,
    which is executed, and `--connect` the addresses that may be used; `--set` gives new addresses of devices. Return an
    exit status as `rig run` does. Raise Refused `no_run`, `already_finished`, `another_script`, and what
    `refuse_links`, `read_result`, `refuse_other_changes`, `refuse_foreign_addresses`, `script_identity` and
    `kept_script` raise.
    """
    page = read_page_wish(options)
    from rig.commands.configured import open_configured
    from rig.commands.measure.carry_out import carry_out
    from rig.commands.measure.consent import refuse_foreign_addresses, refuse_other_changes
    from rig.config.load import load
    from rig.data.latest_run import note_run
    from rig.data.result_file import read_result
    from rig.data.run_folder import CONFIG, RESULT, SCRIPT, refuse_links, script_identity
    from rig.plans.script_file import kept_script, load_script
    from rig.turners.turner_registry import sections

    folder: Path = options.run_folder
    if not (folder / CONFIG).exists():
        raise Refused("no_run", f"{folder} holds no {CONFIG}", "Give the folder of an interrupted run")
    if (folder / RESULT).exists() and all(check.means.sweep is None for check in read_result(folder).checks):
        raise Refused("already_finished", f"{folder} has its {RESULT}", "Start a new run with `rig run`")
    if not (folder / SCRIPT).exists():
        raise Refused(
            "another_script",
            f"{folder} contains no {SCRIPT}, so the script that it began with is unknown",
            "Start a new run with `rig run`",
        )
    refuse_links(*folder.iterdir())
    loaded = load(folder / CONFIG, sections=None, turners=sections())
    new_addresses = refuse_other_changes(loaded, options.overrides)
    reloaded = load(folder / CONFIG, options.overrides, sections=None, turners=sections())
    refuse_foreign_addresses(folder, reloaded, [*options.connect, *new_addresses])
    script_given = None if options.script is None else load_script(options.script)
    script, moved = kept_script(folder, script_identity(folder), script_given), frozenset(options.other_board)
    note_run(folder)
    with open_configured(folder / CONFIG, options.overrides, script=script) as configured:

        def work() -> int:
            return carry_out(folder, configured, assume_yes=options.yes, moved=moved, as_json=options.json, page=page)

        return notify_after(options.notify, folder, work)

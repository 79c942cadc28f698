"""`rig run` and `rig resume`: one run from its configuration to its verdict, in its folder and its laboratory."""

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.claims import claimed
from rig.commands.configured import Configured, configured
from rig.commands.consent import refuse_foreign_addresses
from rig.commands.laboratory import simulated_laboratory
from rig.commands.page_arguments import PageWish, operators_page
from rig.commands.remember import print_beside, remember
from rig.config.load import load
from rig.data.own_texts import note_own
from rig.data.result_file import read_result
from rig.data.run_folder import CONFIG, RESULT, SCRIPT, WORLD_LATE, new_folder, refuse_links, script_identity
from rig.errors import Refused
from rig.plans.script_file import ScriptFile, kept_script, load_script
from rig.report.document import document_of
from rig.report.table import print_outcome
from rig.runner.phases import Run
from rig.station.confirm import ask_operator
from rig.station.events import NotRemembered, RunFolderWritten
from rig.station.log import log
from rig.station.station import Stations, always_yes
from rig.station.view import view

if TYPE_CHECKING:
    from rig.page.shown import About


def run(
    config_path: Path,
    overrides: Sequence[str] = (),
    out: Path | None = None,
    *,
    script: ScriptFile | Path | None = None,
    assume_yes: bool = False,
    as_json: bool = False,
    page: PageWish | None = None,
) -> int:
    """Run the procedure a configuration names, or that of `script`, in a new run folder; on a `page` too if wanted.

    Returns 0 passed, 1 verdict failed.
    """
    found = configured(config_path, overrides, script)
    folder = new_folder(out, found.loaded, found.script.text, found.script.identity)
    note_own(found.loaded.text, found.script.text)
    return _carry_out(folder, found, assume_yes=assume_yes, as_json=as_json, page=page)


def resume(
    folder: Path,
    *,
    script: Path | None = None,
    connect: Sequence[str] = (),
    assume_yes: bool = False,
    as_json: bool = False,
    page: PageWish | None = None,
) -> int:
    """Go on with an interrupted run by the script it was begun with: sweeps it has finished count, the others are done.

    A sweep that the verdict named as disturbed is repeated. Of a folder that is somebody else's `script` names the
    script, which is executed, and `connect` the addresses that may be connected to. Returns as `run` does. Raises
    Refused `no_run`, `already_finished`, and as `refuse_links`, `read_result`, `refuse_foreign_addresses`,
    `script_identity` and `kept_script`.
    """
    if not (folder / CONFIG).exists():
        raise Refused("no_run", f"{folder} holds no {CONFIG}", "Give the folder of an interrupted run")
    if (folder / RESULT).exists() and all(check.means.sweep is None for check in read_result(folder).checks):
        raise Refused("already_finished", f"{folder} has its {RESULT}", "Start a new run with `rig run`")
    if not (folder / SCRIPT).exists():
        raise Refused(
            "another_script",
            f"{folder} keeps no {SCRIPT}, so the script it was begun with is not known",
            "Start a new run with `rig run`",
        )
    refuse_links(*folder.iterdir())
    refuse_foreign_addresses(folder, load(folder / CONFIG, sections=None), connect)
    named = None if script is None else load_script(script)
    found = configured(folder / CONFIG, script=kept_script(folder, script_identity(folder), named))
    return _carry_out(folder, found, assume_yes=assume_yes, as_json=as_json, page=page)


def _carry_out(folder: Path, found: Configured, *, assume_yes: bool, as_json: bool, page: PageWish | None) -> int:
    with operators_page(page, folder, lambda: _about(folder, found, page)) as shown:
        # Nobody stands beside a laboratory that this process starts itself, so there nobody need be asked.
        on_terminal = always_yes if assume_yes or found.loaded.simulated else ask_operator
        answer = shown.answer if shown.answer is not None and not assume_yes else on_terminal
        with log(folder / "log.txt") as logged, view() as seen, ExitStack() as held:
            station = Stations((logged, seen, *shown.listeners), answer)
            this = Run(folder, found.loaded, found.script, station)
            with this.reported():
                held.enter_context(claimed(found.loaded.config))
                if found.loaded.simulated:
                    held.enter_context(simulated_laboratory(folder / CONFIG, folder / WORLD_LATE))
            outcome = this.carry_out(found.phase)
            try:
                entered, beside = remember(folder, found.loaded.config.history)
            except KeyboardInterrupt:
                station.event(NotRemembered(folder, "interrupted"))
                raise
            if entered is not None:
                station.event(entered)
            station.event(RunFolderWritten(folder))
        print_outcome(document_of(outcome), as_json=as_json)
        if not as_json:
            print_beside(beside)
        shown.stay()
    return 0 if outcome.passed else 1


def _about(folder: Path, found: Configured, page: PageWish | None) -> "About":
    from rig.page.shown import About

    config = found.loaded.config
    parts = {name: f"{each.part} {each.serial_number}" for name, each in config.sensors.items()}
    parts |= {name: f"{each.part} {each.serial_number}" for name, each in config.magnetometers.items()}
    return About(
        folder=str(folder),
        procedure=config.procedure.name,
        may_answer=page is not None and page.may_answer,
        parts=parts,
        simulated=found.loaded.simulated,
    )

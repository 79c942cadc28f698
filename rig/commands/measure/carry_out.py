"""One run from its configuration to its verdict, in its folder and its laboratory: `rig run` and `rig resume`."""

import shlex
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.configured import Configured
from rig.commands.history.recall import remembered
from rig.commands.history.remember import remember, since_lines
from rig.commands.laboratory.claims import claimed
from rig.commands.laboratory.laboratory import hands_of, simulated_laboratory
from rig.commands.laboratory.simulated_operator import SimulatedOperator
from rig.commands.page_arguments import PageWish, operators_page
from rig.commands.standard_streams import tell_where_the_result_is
from rig.data.run_folder import CONFIG, LOG, RESULT, WORLD_LATE
from rig.report.document import document_of
from rig.report.terminal.table import print_kept
from rig.runner.phases import Run
from rig.station.confirm import ask_operator
from rig.station.events import NotRemembered, RunFolderWritten
from rig.station.log import log
from rig.station.station import Stations, always_yes
from rig.station.view import view

if TYPE_CHECKING:
    from rig.page.about import About


def carry_out(
    folder: Path,
    configured: Configured,
    *,
    assume_yes: bool,
    moved: frozenset[str],
    as_json: bool,
    page: PageWish | None,
) -> int:
    """Run, or go on with, the phases in a run folder; on a `page` too if wanted. Returns 0 passed, 1 verdict failed.

    `moved` are serial numbers of sensors that are stated to be on another board than before.
    """
    with operators_page(page, folder, lambda: _about(folder, configured, page)) as shown:
        # Nobody stands beside a laboratory that this process starts itself, so there nobody need be asked.
        on_terminal = always_yes if assume_yes or configured.loaded.simulated else ask_operator
        answer = shown.answer if shown.answer is not None and not assume_yes else on_terminal
        with log(folder / LOG) as logged, view() as seen, ExitStack() as held:
            station = Stations((logged, seen, *shown.listeners), answer, attended=answer is not always_yes)
            memory = remembered(configured.loaded.config, moved)
            this = Run(folder, configured.loaded, configured.script, station, memory)
            with this.reported():
                held.enter_context(claimed(configured.loaded.config))
                if configured.loaded.simulated:
                    control = held.enter_context(simulated_laboratory(configured.loaded.text, folder / WORLD_LATE))
                    station.mount = hands_of(control)
                    station.listeners = (*station.listeners, SimulatedOperator(control))
            outcome = this.carry_out(configured.phase)
            try:
                entered, beside = remember(folder, configured.loaded.config.history)
            except KeyboardInterrupt:
                station.event(NotRemembered(folder, "interrupted"))
                raise
            if entered is not None:
                station.event(entered)
            station.event(RunFolderWritten(folder))
        print_kept(folder, document_of(outcome), since_lines(beside), as_json=as_json)
        tell_where_the_result_is(folder / RESULT)
        shown.stay()
    return 0 if outcome.passed else 1


def _about(folder: Path, configured: Configured, page: PageWish | None) -> "About":
    from rig.page.about import About
    from rig.page.arm import built
    from rig.turners.registry import kind_of

    config = configured.loaded.config
    return About(
        folder=str(folder),
        procedure=config.procedure.name,
        may_answer=page is not None and page.may_answer,
        parts={name: f"{each.part} {each.serial_number}" for name, each in config.all_sensors.items()},
        simulated=configured.loaded.simulated,
        storing=_storing(folder, configured),
        arm=built(kind_of(config.turner).describe_configured(config.turner).kinematics),
    )


def _storing(folder: Path, configured: Configured) -> str | None:
    """The command that stores the run's calibration on the board; a simulated one forgets it with the command's end."""
    if configured.loaded.simulated or not configured.loaded.config.parts_on_board:
        return None
    return f"rig board calibration write {shlex.quote(str(folder / CONFIG))} {shlex.quote(str(folder))}"

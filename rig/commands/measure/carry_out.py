"""One run from its configuration to its verdict, in its folder and laboratory, for `rig run` and `rig resume`."""

import shlex
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.configured import Configured
from rig.commands.history.remember import describe_changes, remember
from rig.commands.history.run_serials import recall_sensors
from rig.commands.laboratory.claims import claim_devices
from rig.commands.laboratory.laboratory_process import make_mounter, run_simulated_laboratory
from rig.commands.laboratory.simulated_operator import OperatorListener
from rig.commands.laboratory.written_truth import write_truth
from rig.commands.page_arguments import PageWish, serve_operators_page
from rig.commands.standard_streams import say_where_the_result_is
from rig.data.run_folder import CONFIG, LATENESS_FILE, LOG, RESULT, TRUTH_FILE, recordings
from rig.report.document import document_of
from rig.report.simulated_truth import truth_lines, truth_rows
from rig.report.terminal.result_table import print_kept
from rig.runner.phases import Run
from rig.station.confirm import ask_operator
from rig.station.events import NotRemembered, RunFolderWritten
from rig.station.log import log
from rig.station.operator_station import Stations, always_yes
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
    """Carry out the phases in a run folder, or continue them; show the run on a `page` too, if requested.

    Return 0 if passed, 1 if failed. `moved` are serial numbers of sensors that are declared to have changed boards.
    """
    with serve_operators_page(page, folder, lambda: _describe_run(folder, configured, page)) as page_of_run:
        # In a laboratory that this process simulates no person can be hurt, so no operator is asked.
        on_terminal = always_yes if assume_yes or configured.loaded.simulated else ask_operator
        answer = page_of_run.answer if page_of_run.answer is not None and not assume_yes else on_terminal
        with log(folder / LOG) as logged, view() as terminal, ExitStack() as stack:
            station = Stations((logged, terminal, *page_of_run.listeners), answer, attended=answer is not always_yes)
            memory = recall_sensors(configured.loaded.config, moved)
            control, resumed = None, False
            run = Run(folder, configured.loaded, configured.script, station, memory)
            with run.report_end():
                stack.enter_context(claim_devices(configured.loaded.config))
                if configured.loaded.simulated:
                    # In a resumed run, the windows of the first part belong to the clock of an earlier laboratory.
                    resumed = bool(recordings(folder, "raw"))
                    (folder / TRUTH_FILE).unlink(missing_ok=True)
                    control = stack.enter_context(
                        run_simulated_laboratory(configured.loaded.text, folder / LATENESS_FILE, folder / TRUTH_FILE)
                    )
                    station.mount = make_mounter(control)
                    station.listeners = (*station.listeners, OperatorListener(control))
            outcome = run.carry_out(configured.phase)
            if control is not None and not resumed:
                for event in write_truth(control, folder / TRUTH_FILE, folder, configured.loaded, outcome):
                    station.event(event)
            try:
                entered, comparisons = remember(folder, configured.loaded.config.history)
            except KeyboardInterrupt:
                station.event(NotRemembered(folder, "interrupted"))
                raise
            if entered is not None:
                station.event(entered)
            station.event(RunFolderWritten(folder))
        document = document_of(outcome)
        compared = [*truth_lines(truth_rows(folder, document)), *describe_changes(comparisons)]
        print_kept(folder, document, compared, as_json=as_json)
        say_where_the_result_is(folder / RESULT)
        page_of_run.stay()
    return 0 if outcome.passed else 1


def _describe_run(folder: Path, configured: Configured, page: PageWish | None) -> "About":
    from rig.page.about import About
    from rig.page.arm import built
    from rig.turners.turner_registry import kind_of

    config = configured.loaded.config
    return About(
        folder=str(folder),
        procedure=config.procedure.name,
        may_answer=page is not None and page.may_answer,
        parts={name: f"{sensor.part} {sensor.serial_number}" for name, sensor in config.all_sensors.items()},
        simulated=configured.loaded.simulated,
        storing=_storing_command(folder, configured),
        arm=built(kind_of(config.turner).describe_configured(config.turner).kinematics),
    )


def _storing_command(folder: Path, configured: Configured) -> str | None:
    """Return the command that stores the run's calibration on its board; None without a real board."""
    if configured.loaded.simulated or not configured.loaded.config.parts_on_board:
        return None
    return f"rig board calibration write {shlex.quote(str(folder / CONFIG))} {shlex.quote(str(folder))}"

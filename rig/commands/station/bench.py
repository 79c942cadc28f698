"""The bench of a station: the common devices and configuration of all parts, and the run of one part.

The claims, the simulated laboratory, the configuration and its script remain. A run stops its turner for good, so the
turner is reconnected for each part, while the operator changes the part.
"""

import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from rig.analysis.outcome import Outcome
from rig.batch.batch_state import BatchPart, Chip, PartEnded
from rig.batch.part_sequence import Desk, now_utc
from rig.commands.configured import Configured, change_configured
from rig.commands.history.remember import remember
from rig.commands.history.run_serials import find_other_board, recall_sensors
from rig.commands.laboratory.claims import claim_devices
from rig.commands.laboratory.laboratory_process import make_fitter, make_mounter, run_simulated_laboratory
from rig.commands.laboratory.simulated_operator import OperatorListener
from rig.commands.laboratory.written_truth import write_truth
from rig.commands.page_arguments import Answer
from rig.config.models import RigConfig
from rig.data.result_file import read_result
from rig.data.run_folder import ARM_LOG, CONFIG, LATENESS_FILE, LOG, RESULT, TRUTH_FILE, discard, new_folder
from rig.data.user_texts import note_own
from rig.errors import Fault, Refused
from rig.report.certificate.content import certificate_of
from rig.report.certificate.statements import configuration_statements
from rig.report.document import document_of
from rig.report.simulated_truth import truth_lines, truth_rows
from rig.runner.early_connection import EarlyConnection
from rig.runner.phases import Run
from rig.station.events import Advice, BoardConnected, RunEvent, RunFolderWritten, SamplingStarted
from rig.station.log import log
from rig.station.operator_station import Listener, Stations
from rig.station.view import view
from rig.turners.turner_registry import kind_of


@dataclass(slots=True)
class PartListener:
    """A listener of one run, which notes the board, whether readings were recorded and whether to repeat sweeps."""

    chip: Chip | None = None
    recorded: bool = False
    repeats: bool = False

    def event(self, event: RunEvent) -> None:
        """Handle an event, as a Listener does."""
        match event:
            case BoardConnected(_, identity):
                self.chip = Chip(identity.unique_id, tuple(part.who_am_i for part in identity.sensors if part.present))
            case SamplingStarted():
                self.recorded = True
            case Advice(repeats=repeats):
                self.repeats = repeats


@dataclass(frozen=True, slots=True)
class BatchSettings:
    """The settings of all parts: whether an operator attends, the operator's name, the work order, and the listeners.

    `going_on` is the command that continues the batch.
    """

    attended: bool
    operator: str = ""
    work_order: str = ""
    listeners: Sequence[Listener] = ()
    going_on: str = ""


@dataclass(frozen=True, slots=True)
class RigBench:
    """A bench with the rig of a configuration.

    - control: the address of its simulated laboratory, None for a real one.
    - ahead: connects the turner for the next run in advance.
    - truth_file: where the simulated laboratory writes its truth.
    - begun: the folders of the runs that began in this laboratory.
    """

    configured: Configured
    control: str | None
    station: BatchSettings
    ahead: EarlyConnection
    truth_file: Path
    begun: set[Path] = field(default_factory=set)

    @property
    def simulated(self) -> bool:
        """Whether the laboratory is simulated."""
        return self.configured.loaded.simulated

    def today(self, serial: str) -> str | None:
        """Return the newest calibration of today that passed, in words; None if there is none."""
        memory = recall_sensors(self._configure(serial).loaded.config, frozenset())
        day = datetime.now(UTC).date().isoformat()
        parts = {self.configured.loaded.config.sensors[name].part for name in self._named}
        calibrations = (
            past
            for past in memory.calibrations
            if past.serial_number == serial and past.part in parts and past.simulated == self.simulated
        )
        return next((past.words for past in calibrations if (past.day, past.verdict) == (day, "pass")), None)

    def find_other_serial_number(self, chip: Chip, serial: str) -> str | None:
        """Return the newest other serial number that the history has for this board; None if it has no other."""
        config = self._configure(serial).loaded.config
        own_numbers = {sensor.serial_number for sensor in config.all_sensors.values()}
        parts = {config.sensors[name].part for name in self._named}
        return find_other_board(config, chip.board, parts, own_numbers, simulated=self.simulated)

    def fit(self, serial: str) -> None:
        """Make the simulated operator, if any, fit the part."""
        if self.control is not None:
            make_fitter(self.control)(serial)

    def run(self, part: BatchPart, folder: Path, desk: Desk) -> PartEnded:
        """Run the part in `folder`, or continue its run, repeat refused sweeps at once, and return the end.

        Raise Refused and Fault as `Run.carry_out` does.
        """
        configured = self._configure(part.serial)
        if (folder / RESULT).exists() and (ended := _read_ended(folder, configured)) is not None:
            return ended
        new = _prepare_folder(folder, configured)
        if new:
            self.begun.add(folder)
        listener, began_s, is_confirmed = PartListener(), time.monotonic(), False

        def answer(announcement: Sequence[str], to_do: str) -> bool:
            nonlocal began_s
            agreed = desk.agrees(announcement, to_do)
            began_s = time.monotonic()
            return agreed

        def confirm() -> None:
            nonlocal is_confirmed  # once for all stages and repeats
            if listener.chip is not None and not is_confirmed:
                desk.confirm(listener.chip)
                is_confirmed = True

        try:
            outcome, repeated, truth = self._run_repeatedly(folder, configured, listener, answer, confirm)
        except (Refused, Fault) as error:
            if isinstance(error, Refused) and new and not listener.recorded:
                discard(folder)
            self.ahead.begin()
            raise
        self.ahead.begin()
        why = "" if outcome.passed else ", ".join(check.name for check in outcome.checks if not check.passed)
        return PartEnded(
            "pass" if outcome.passed else "fail",
            now_utc(),
            why,
            _certificate_number(folder, configured),
            repeated,
            listener.chip,
            time.monotonic() - began_s,
            truth,
        )

    def _run_repeatedly(
        self, folder: Path, configured: Configured, listener: PartListener, answer: Answer, confirm: Callable[[], None]
    ) -> tuple[Outcome, int, str]:
        """Return the part's outcome, the number of repetitions of sweeps, and the agreement with a simulated truth."""
        config = configured.loaded.config
        with log(folder / LOG) as logged, view() as terminal:
            listeners = (logged, terminal, listener, *self.station.listeners)
            station = Stations(listeners, answer, attended=self.station.attended, confirm=confirm)
            if self.control is not None:
                station.mount = make_mounter(self.control)
                station.listeners = (*listeners, OperatorListener(self.control))
            memory = recall_sensors(config, frozenset())
            going_on, connected = self.station.going_on, self.ahead.connect_turner
            run = Run(folder, configured.loaded, configured.script, station, memory, connected, going_on)
            phase = configured.phase
            for repeated in range(config.station.repeats + 1):
                repeats_left, listener.repeats = config.station.repeats - repeated, False
                try:
                    outcome = run.carry_out(phase)
                    if outcome.passed or not repeats_left or not run.has_refused_sweeps(phase):
                        break
                except Fault:
                    if not (repeats_left and listener.repeats):
                        raise
                phase = replace(phase, agreed=True)
            truth = self._compare_with_truth(folder, configured, outcome, station)  # pyrefly: ignore[unbound-name]  # the last run has one, or raises
            entered, _ = remember(folder, config.history)
            if entered is not None:
                station.event(entered)
            station.event(RunFolderWritten(folder))
        return outcome, repeated, truth

    def _compare_with_truth(self, folder: Path, configured: Configured, outcome: Outcome, station: Stations) -> str:
        """Have a simulated laboratory write its truth; return the result's agreement in words, empty without a truth.

        A run begun in another laboratory, on another clock, is not compared.
        """
        (folder / TRUTH_FILE).unlink(missing_ok=True)
        if self.control is None or folder not in self.begun:
            return ""
        for event in write_truth(self.control, self.truth_file, folder, configured.loaded, outcome):
            station.event(event)
        return "".join(truth_lines(truth_rows(folder, document_of(outcome))))

    @property
    def _named(self) -> tuple[str, ...]:
        """The names of the sensors that have the part's serial number."""
        config = self.configured.loaded.config
        return config.station.sensors or tuple(config.to_calibrate)

    def _configure(self, serial: str) -> Configured:
        """Return the configuration with the part's serial number, the operator and the work order."""
        values = {f"sensors.{name}.serial_number": serial for name in self._named}
        values |= {"history.operator": self.station.operator} if self.station.operator else {}
        values |= {"history.note": f"work order {self.station.work_order}"} if self.station.work_order else {}
        return change_configured(self.configured, [f"{key}={json.dumps(value)}" for key, value in values.items()])


@contextmanager
def open_bench(configured: Configured, folder: Path, station: BatchSettings) -> Iterator[RigBench]:
    """Yield the bench of the batch in `folder`, which is open during the block.

    Raise Refused `station_sensors` if the configuration has no sensors that a station can calibrate, and what
    `claim_devices` raises.
    """
    config = configured.loaded.config
    refuse_other_sensors(config)
    with ExitStack() as stack:
        stack.enter_context(claim_devices(config))
        control = None
        if configured.loaded.simulated:
            control = stack.enter_context(
                run_simulated_laboratory(configured.loaded.text, folder / LATENESS_FILE, folder / TRUTH_FILE)
            )
        connect = partial(kind_of(config.turner).connect, config.turner)
        ahead = EarlyConnection(connect, folder / ARM_LOG)
        stack.callback(ahead.close)
        ahead.begin()
        yield RigBench(configured, control, station, ahead, folder / TRUTH_FILE)


def refuse_other_sensors(config: RigConfig) -> None:
    """Raise Refused `station_sensors` if `station.sensors` names a sensor that is not calibrated."""
    others = [name for name in config.station.sensors if name not in config.to_calibrate]
    if others:
        raise Refused(
            "station_sensors",
            f"station.sensors names {', '.join(others)}; calibrated are {', '.join(config.to_calibrate)}",
            "Name sensors with role: calibrate, or leave station.sensors out",
        )


def _read_ended(folder: Path, configured: Configured) -> PartEnded | None:
    """Return the end of a run that ended before the station was killed, and enter the run in the history.

    If sweeps failed, return None and enter nothing, because these sweeps are to be repeated.
    """
    result = read_result(folder)
    failed = [check for check in result.checks if not check.passed]
    if any(check.means.sweep is not None for check in failed):
        return None
    remember(folder, configured.loaded.config.history)
    why, chip = ", ".join(check.name for check in failed), Chip(result.provenance.board_unique_id)
    return PartEnded(result.verdict, now_utc(), why, _certificate_number(folder, configured), chip=chip)


def _prepare_folder(folder: Path, configured: Configured) -> bool:
    """Prepare a run folder for the part, unless a run was begun there. Return whether the folder is new."""
    if (folder / CONFIG).exists():
        return False
    if folder.exists():  # the process was killed while it wrote the first files
        discard(folder)
    new_folder(folder, configured.loaded, configured.script.text, configured.script.identity)
    note_own(configured.loaded.text, configured.script.text)
    return True


def _certificate_number(folder: Path, configured: Configured) -> str:
    """Return the number of the certificate in a run folder."""
    return certificate_of(read_result(folder), configuration_statements(configured.loaded)).number

"""The bench of a station: what stays between two parts, and a part's run on it.

The claims, the simulated laboratory, the configuration and its script stay. What turns is connected anew, since a run
ends with it stopped for good, but ahead: while the part is changed.
"""

import json
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from rig.analysis.outcome import Outcome
from rig.batch.batch import BatchPart, Chip, PartEnded
from rig.batch.parts_in_turn import Desk, now_utc
from rig.commands.configured import Configured, changed
from rig.commands.history.recall import known_board, remembered
from rig.commands.history.remember import remember
from rig.commands.laboratory.claims import claimed
from rig.commands.laboratory.laboratory import hands_of, part_fitter, simulated_laboratory
from rig.commands.page_arguments import Answer
from rig.config.models import RigConfig
from rig.data.own_texts import note_own
from rig.data.result_file import read_result
from rig.data.run_folder import ARM_LOG, CONFIG, LOG, RESULT, WORLD_LATE, discard, new_folder
from rig.errors import Fault, Refused
from rig.report.certificate.content import certificate_of
from rig.report.certificate.statements import of_configuration
from rig.runner.ahead import Ahead
from rig.runner.phases import Run
from rig.station.events import Advice, BoardConnected, RunEvent, RunFolderWritten, SamplingStarted
from rig.station.log import log
from rig.station.station import Listener, Stations
from rig.station.view import view
from rig.turners.registry import kind_of


@dataclass(slots=True)
class Heard:
    """A listener of one run: what board it met, whether anything was recorded, and whether its end says that refused
    sweeps can be repeated."""

    chip: Chip | None = None
    recorded: bool = False
    repeats: bool = False

    def event(self, event: RunEvent) -> None:
        """Take an event, as a Listener does."""
        match event:
            case BoardConnected(_, identity):
                self.chip = Chip(identity.unique_id, tuple(each.who_am_i for each in identity.sensors if each.present))
            case SamplingStarted():
                self.recorded = True
            case Advice(repeats=repeats):
                self.repeats = repeats


@dataclass(frozen=True, slots=True)
class Station:
    """What holds for all parts: whether somebody sits there, who and for which work order, and who listens.

    `going_on` is the command that goes on with the batch.
    """

    attended: bool
    operator: str = ""
    work_order: str = ""
    listeners: Sequence[Listener] = ()
    going_on: str = ""


@dataclass(frozen=True, slots=True)
class RigBench:
    """A bench with the rig of a configuration. `control` is its simulated laboratory's, None for a real one.

    `ahead` connects what turns.
    """

    configured: Configured
    control: str | None
    station: Station
    ahead: Ahead

    @property
    def simulated(self) -> bool:
        """Whether the laboratory is."""
        return self.configured.loaded.simulated

    def today(self, serial: str) -> str | None:
        """The newest calibration of today that passed."""
        memory = remembered(self._of(serial).loaded.config, frozenset())
        day = datetime.now(UTC).date().isoformat()
        parts = {self.configured.loaded.config.sensors[name].part for name in self._named}
        found = (
            each
            for each in memory.calibrations
            if each.serial_number == serial and each.part in parts and each.simulated == self.simulated
        )
        return next((each.words for each in found if (each.day, each.verdict) == (day, "pass")), None)

    def known_as(self, chip: Chip, serial: str) -> str | None:
        """The newest other number that the history has of this board."""
        config = self._of(serial).loaded.config
        own = {each.serial_number for each in config.all_sensors.values()}
        parts = {config.sensors[name].part for name in self._named}
        return known_board(config, chip.board, parts, own, simulated=self.simulated)

    def fit(self, serial: str) -> None:
        """The simulated operator lays the part in."""
        if self.control is not None:
            part_fitter(self.control)(serial)

    def run(self, part: BatchPart, folder: Path, desk: Desk) -> PartEnded:
        """Run the part in `folder`, or go on there; refused sweeps are repeated at once. Raises Refused, Fault."""
        of_part = self._of(part.serial)
        if (folder / RESULT).exists() and (ended := _finished(folder, of_part)) is not None:
            return ended
        new = _prepared(folder, of_part)
        heard, began_s, asked = Heard(), time.monotonic(), False

        def answer(announcement: Sequence[str], to_do: str) -> bool:
            nonlocal began_s, asked
            chip, asked = None if asked else heard.chip, True  # whose it is, is asked once
            agreed = desk.agrees(announcement, to_do, chip)
            began_s = time.monotonic()
            return agreed

        try:
            outcome, repeated = self._outcome(folder, of_part, heard, answer)
        except (Refused, Fault) as error:
            if isinstance(error, Refused) and new and not heard.recorded:
                discard(folder)
            self.ahead.begin()
            raise
        self.ahead.begin()
        why = "" if outcome.passed else ", ".join(each.name for each in outcome.checks if not each.passed)
        return PartEnded(
            "pass" if outcome.passed else "fail",
            now_utc(),
            why,
            _certificate(folder, of_part),
            repeated,
            heard.chip,
            time.monotonic() - began_s,
        )

    def _outcome(self, folder: Path, of_part: Configured, heard: Heard, answer: Answer) -> tuple[Outcome, int]:
        """What came of the part, and how often refused sweeps were repeated."""
        config = of_part.loaded.config
        with log(folder / LOG) as logged, view() as seen:
            station = Stations((logged, seen, heard, *self.station.listeners), answer, attended=self.station.attended)
            station.mount = None if self.control is None else hands_of(self.control)
            memory = remembered(config, frozenset())
            going_on, connected = self.station.going_on, self.ahead.connected
            this = Run(folder, of_part.loaded, of_part.script, station, memory, connected, going_on)
            phase = of_part.phase
            for repeated in range(config.station.repeats + 1):
                left, heard.repeats = config.station.repeats - repeated, False
                try:
                    outcome = this.carry_out(phase)
                    if outcome.passed or not left or not this.refused_sweeps(phase):
                        break
                except Fault:
                    if not (left and heard.repeats):
                        raise
                phase = replace(phase, agreed=True)
            entered, _ = remember(folder, config.history)
            if entered is not None:
                station.event(entered)
            station.event(RunFolderWritten(folder))
        return outcome, repeated

    @property
    def _named(self) -> tuple[str, ...]:
        """The sensors that have the part's number."""
        config = self.configured.loaded.config
        return config.station.sensors or tuple(config.to_calibrate)

    def _of(self, serial: str) -> Configured:
        """The configuration of one part."""
        values = {f"sensors.{name}.serial_number": serial for name in self._named}
        values |= {"history.operator": self.station.operator} if self.station.operator else {}
        values |= {"history.note": f"work order {self.station.work_order}"} if self.station.work_order else {}
        return changed(self.configured, [f"{key}={json.dumps(value)}" for key, value in values.items()])


@contextmanager
def bench(configured: Configured, folder: Path, station: Station) -> Iterator[RigBench]:
    """The bench for the length of the `with` block; `folder` is the batch's.

    Raises Refused as `claimed`, and `station_sensors` where the configuration has no such sensors.
    """
    config = configured.loaded.config
    refuse_other_sensors(config)
    with ExitStack() as held:
        held.enter_context(claimed(config))
        control = None
        if configured.loaded.simulated:
            control = held.enter_context(simulated_laboratory(configured.loaded.text, folder / WORLD_LATE))
        connect = partial(kind_of(config.turner).connect, config.turner)
        ahead = Ahead(connect, folder / ARM_LOG)
        held.callback(ahead.close)
        ahead.begin()
        yield RigBench(configured, control, station, ahead)


def refuse_other_sensors(config: RigConfig) -> None:
    """Raise Refused `station_sensors` where `station.sensors` names one that is not calibrated."""
    others = [name for name in config.station.sensors if name not in config.to_calibrate]
    if others:
        raise Refused(
            "station_sensors",
            f"station.sensors names {', '.join(others)}; calibrated are {', '.join(config.to_calibrate)}",
            "Name sensors with role: calibrate, or leave station.sensors out",
        )


def _finished(folder: Path, of_part: Configured) -> PartEnded | None:
    """What came of a run that had its result when the station was killed; None where sweeps are left to repeat."""
    found = read_result(folder)
    failed = [check for check in found.checks if not check.passed]
    if any(check.means.sweep is not None for check in failed):
        return None
    remember(folder, of_part.loaded.config.history)
    why, chip = ", ".join(check.name for check in failed), Chip(found.provenance.board_unique_id)
    return PartEnded(found.verdict, now_utc(), why, _certificate(folder, of_part), chip=chip)


def _prepared(folder: Path, of_part: Configured) -> bool:
    """A run folder for the part, unless one was begun there; whether it is new."""
    if (folder / CONFIG).exists():
        return False
    if folder.exists():  # a kill came between its first file and its last
        discard(folder)
    new_folder(folder, of_part.loaded, of_part.script.text, of_part.script.identity)
    note_own(of_part.loaded.text, of_part.script.text)
    return True


def _certificate(folder: Path, of_part: Configured) -> str:
    """The number of the certificate in a run folder."""
    return certificate_of(read_result(folder), of_configuration(of_part.loaded)).number

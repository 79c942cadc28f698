"""A batch, part by part: journal entries, questions and documents."""

import gc
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol

from rig.batch import batch_table, label
from rig.batch.batch_journal import Journal
from rig.batch.batch_state import (
    Batch,
    BatchEnded,
    BatchPart,
    Chip,
    Doubt,
    Entry,
    Outcome,
    PartBegun,
    PartEnded,
    doubt_of,
)
from rig.batch.operators import Operator
from rig.config.files.safe_writing import write_new
from rig.config.judging.station_section import StationSection
from rig.errors import Fault, Refused

LABELS = "labels"


class Bench(Protocol):
    """A bench that exchanges and runs parts, and knows their history."""

    @property
    def simulated(self) -> bool: ...

    def today(self, serial: str) -> str | None:
        """Describe today's run of the serial number in the history; None if there is none."""
        ...

    def find_other_serial_number(self, chip: Chip, serial: str) -> str | None:
        """Return another serial number that the history has for the chip, or None."""
        ...

    def fit(self, serial: str) -> None:
        """Exchange the part in the simulated laboratory, if the operator is simulated."""
        ...

    def run(self, part: BatchPart, folder: Path, desk: "Desk") -> PartEnded:
        """Run the part, or continue the run in its folder. Raise Refused if nothing has moved, otherwise Fault."""
        ...


@dataclass(frozen=True, slots=True)
class Desk:
    """The questions that a run asks the station before the arm moves."""

    work: "Work"
    part: BatchPart

    def confirm(self, chip: Chip) -> None:
        """Raise Refused `same_chip` if the board that answered belongs to another serial number, unless confirmed."""
        self.work.refuse_same_chip(self.part, chip)

    def agrees(self, announcement: Sequence[str], to_do: str) -> bool:
        """Return whether the operator agrees to `to_do` after the announcement."""
        return self.work.operator.agrees(announcement, to_do)


@dataclass(slots=True)
class Work:
    """A batch in progress; `notify` is called after every entry."""

    journal: Journal
    section: StationSection
    operator: Operator
    bench: Bench
    notify: Callable[[Batch], None] = lambda batch: None

    def all_parts(self) -> None:
        """Run part after part, until the operator or the list ends. Raise Fault if a question gets no answer."""
        self._write_table()
        self.notify(self.journal.batch)
        while True:
            part = self.journal.batch.in_hand or self._begin_next()
            if part is None:
                break
            self._carry_out(part)
            gc.collect()  # it counts objects, not bytes: by itself it would keep the data of several runs
        self._enter(BatchEnded(now_utc()))
        self._write_table()

    def _begin_next(self) -> BatchPart | None:
        """Enter the next part in the journal and return it; None if no part follows."""
        why = ""
        while (serial := self.operator.next_part(self.journal.batch.parts, why)) is not None:
            doubt = doubt_of(serial, self.journal.batch, self.section, self.bench.today)
            why = doubt.why if doubt is not None and doubt.final else ""
            right = doubt is None or (not doubt.final and self.operator.goes_on(doubt))
            if right or self.operator.listed:
                self._enter(PartBegun(serial, self.journal.batch.folder_of(serial), now_utc()))
            if right:
                return self.journal.batch.in_hand
            if doubt is not None and self.operator.listed:
                self._end_part(PartEnded("refused", now_utc(), doubt.why))
        return None

    def _carry_out(self, part: BatchPart) -> None:
        """Measure the part, and enter the outcome in the journal; after an error, measure again if the operator agrees.

        Pass on a Fault if no operator attends.
        """
        while True:
            try:
                if not self.operator.is_mounted(part):
                    return self._end_part(PartEnded("refused", now_utc(), "put aside before it was mounted"))
                self.bench.fit(part.serial)
                return self._end_part(self.bench.run(part, self.journal.folder / part.folder, Desk(self, part)))
            except (Refused, Fault) as error:
                if isinstance(error, Fault) and not self.operator.attended:
                    raise  # the arm was stopped, and the cause is unknown: nothing may move after it
                if not self.operator.tries_again(part, error):
                    outcome: Outcome = "refused" if isinstance(error, Refused) else "fault"
                    return self._end_part(PartEnded(outcome, now_utc(), f"{error.name}: {error.what}"))

    def refuse_same_chip(self, part: BatchPart, chip: Chip) -> None:
        """Raise Refused `same_chip` if the chip had another serial number before, unless the operator overrides it."""
        if not self.section.own_board:
            return
        other = self.journal.batch.same_chip(chip, part.serial)
        earlier = f"{other.serial}, part {other.number} of this batch" if other else None
        earlier = earlier or self.bench.find_other_serial_number(chip, part.serial)
        if earlier is None:
            return
        doubt = Doubt(f"the part mounted as {part.serial} is {chip}, which was {earlier}")
        if not self.operator.goes_on(doubt):
            raise Refused(
                "same_chip",
                doubt.why,
                "Mount the other part, or correct the serial number; if one board stays at the rig and only the "
                "parts on it change: station.own_board: false",
            )

    def _end_part(self, ended: PartEnded) -> None:
        part = self.journal.batch.parts[-1]
        if ended.outcome == "pass":
            self._write_label(part, ended)  # first: an ended part is not continued after a kill
        self._enter(ended)
        self._write_table()
        self.operator.print_outcome(self.journal.batch.parts[-1])

    def _write_label(self, part: BatchPart, ended: PartEnded) -> None:
        marks = "SIMULATED, NOT A MEASUREMENT" if self.bench.simulated else ""
        part_label = label.Label(part.serial, part.begun_utc[:10], ended.certificate, marks)
        folder = self.journal.folder / LABELS
        folder.mkdir(exist_ok=True)
        for ending, content in label.files_of(part_label).items():
            write_new(folder / f"{part.folder}{ending}", content)

    def _enter(self, entry: Entry) -> None:
        self.journal.enter(entry)
        self.notify(self.journal.batch)

    def _write_table(self) -> None:
        batch, folder = self.journal.batch, self.journal.folder
        write_new(folder / batch_table.CSV, batch_table.csv_of(batch))
        write_new(folder / batch_table.PAGE, batch_table.page_of(batch, simulated=self.bench.simulated))


def now_utc() -> str:
    """Return the present time (UTC) as text, to seconds."""
    return datetime.now(UTC).isoformat(timespec="seconds")

"""One part after the other until none follows: what is entered, asked and written between their runs."""

import gc
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol

from rig.batch import label, table
from rig.batch.batch import Batch, BatchEnded, Chip, Doubt, Entry, Outcome, Part, PartBegun, PartEnded, doubt_of
from rig.batch.journal import Journal
from rig.batch.operators import Asked
from rig.config.files.written_file import write_new
from rig.config.judging.station_section import StationSection
from rig.errors import Fault, Refused

LABELS = "labels"


class Bench(Protocol):
    """Where a part is run, with all that stays between two parts."""

    @property
    def simulated(self) -> bool: ...

    def today(self, serial: str) -> str | None:
        """What a history knows of that number of today, in words; None for nothing."""
        ...

    def known_as(self, chip: Chip, serial: str) -> str | None:
        """The other number under which a history knows the chip; None for none."""
        ...

    def fit(self, serial: str) -> None:
        """Exchange the part, where a simulated operator does."""
        ...

    def run(self, part: Part, folder: Path, desk: "Desk") -> PartEnded:
        """Run it, or go on with what lies in its folder. Raises Refused where nothing has moved, Fault."""
        ...


@dataclass(frozen=True, slots=True)
class Desk:
    """What a run asks of the station before its arm moves."""

    work: "Work"
    part: Part

    def agrees(self, announcement: Sequence[str], to_do: str, chip: Chip | None) -> bool:
        """Whether the run may do that. Raises Refused `same_chip`."""
        if chip is not None:
            self.work.refuse_same_chip(self.part, chip)
        return self.work.operator.agrees(announcement, to_do)


@dataclass(slots=True)
class Work:
    """A batch at work; `told` hears of it whenever something has been entered."""

    journal: Journal
    section: StationSection
    operator: Asked
    bench: Bench
    told: Callable[[Batch], None] = lambda batch: None

    def all_parts(self) -> None:
        """Run parts until none follows, each as far as it comes. Raises Fault where nobody can decide what follows."""
        self._written()
        self.told(self.journal.batch)
        while True:
            part = self.journal.batch.in_hand or self._named()
            if part is None:
                break
            self._carried_out(part)
            gc.collect()  # it counts objects, not bytes: by itself it would leave the data of several runs lying about
        self._enter(BatchEnded(now_utc()))
        self._written()

    def _named(self) -> Part | None:
        """The next part, entered; None where none follows."""
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
                self._ended(PartEnded("refused", now_utc(), doubt.why))
        return None

    def _carried_out(self, part: Part) -> None:
        while True:
            try:
                if not self.operator.mounted(part):
                    return self._ended(PartEnded("refused", now_utc(), "put aside before it was mounted"))
                self.bench.fit(part.serial)
                return self._ended(self.bench.run(part, self.journal.folder / part.folder, Desk(self, part)))
            except (Refused, Fault) as error:
                if isinstance(error, Fault) and not self.operator.attended:
                    raise  # the arm was stopped: nobody has looked why, so nothing may move after it
                if not self.operator.tries_again(part, error):
                    outcome: Outcome = "refused" if isinstance(error, Refused) else "fault"
                    return self._ended(PartEnded(outcome, now_utc(), f"{error.name}: {error.what}"))

    def refuse_same_chip(self, part: Part, chip: Chip) -> None:
        """Raise Refused `same_chip` where another number had this chip, and nobody says that this is right."""
        if not self.section.own_board:
            return
        other = self.journal.batch.same_chip(chip, part.serial)
        here = f"{other.serial}, part {other.number} of this batch" if other else None
        known = here or self.bench.known_as(chip, part.serial)
        if known is None:
            return
        doubt = Doubt(f"what is mounted as {part.serial} is {chip}, which was {known}")
        if not self.operator.goes_on(doubt):
            raise Refused(
                "same_chip",
                doubt.why,
                "Mount the other part, or correct the serial number; where one board stays at the rig and the parts on "
                "it change: station.own_board: false",
            )

    def _ended(self, ended: PartEnded) -> None:
        part = self.journal.batch.parts[-1]
        if ended.outcome == "pass":
            self._labelled(part, ended)  # first: what has ended is not looked at again after a kill
        self._enter(ended)
        self._written()
        self.operator.hears(self.journal.batch.parts[-1])

    def _labelled(self, part: Part, ended: PartEnded) -> None:
        marks = "SIMULATED, NOT A MEASUREMENT" if self.bench.simulated else ""
        made = label.Label(part.serial, part.begun_utc[:10], ended.certificate, marks)
        folder = self.journal.folder / LABELS
        folder.mkdir(exist_ok=True)
        for ending, content in label.files_of(made).items():
            write_new(folder / f"{part.folder}{ending}", content)

    def _enter(self, entry: Entry) -> None:
        self.journal.enter(entry)
        self.told(self.journal.batch)

    def _written(self) -> None:
        batch, folder = self.journal.batch, self.journal.folder
        write_new(folder / table.CSV, table.csv_of(batch))
        write_new(folder / table.PAGE, table.page_of(batch, simulated=self.bench.simulated))


def now_utc() -> str:
    """The time of this moment, as a batch writes it."""
    return datetime.now(UTC).isoformat(timespec="seconds")

"""The state of a batch, and what may be done next: made of the entries of its journal alone. Pure."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from rig.config.judging.station_section import StationSection
from rig.config.sensors.sensor_sections import check_serial_number

Outcome = Literal["pass", "fail", "refused", "fault"]
Folder = Annotated[str, Field(pattern=r"^\d{2,}-[A-Za-z0-9._-]*$")]  # a name, which leads nowhere else


@dataclass(frozen=True, slots=True)
class Begun:
    """A batch was begun: by whom and for which work order (empty: nobody said), in a simulated laboratory or not."""

    operator: str
    work_order: str
    at_utc: str
    simulated: bool = False


@dataclass(frozen=True, slots=True)
class PartBegun:
    """The part of that `serial` number is to be run, in `folder` beside the journal."""

    serial: str
    folder: Folder
    at_utc: str


@dataclass(frozen=True, slots=True)
class Chip:
    """What a part is known by beside its number: the board's own, and what its sensors say they are (WHO_AM_I)."""

    board: str
    who_am_i: tuple[int, ...] = ()

    def is_that(self, other: "Chip") -> bool:
        """Whether it is the same; sensors that nobody asked tell no difference."""
        asked = self.who_am_i and other.who_am_i
        return self.board == other.board and (not asked or self.who_am_i == other.who_am_i)

    def __str__(self) -> str:
        """The chip as people are told of it."""
        identities = ", ".join(f"0x{each:02x}" for each in self.who_am_i)
        return f"board {self.board}" + (f", WHO_AM_I {identities}" if identities else "")


@dataclass(frozen=True, slots=True)
class PartEnded:
    """What came of the part in hand.

    `why` is empty for one that passed; `certificate` the number of its certificate, empty where there is none;
    `repeated` how often refused sweeps were repeated; `chip` None where none was seen; `took_s` from "go" to the end.
    """

    outcome: Outcome
    at_utc: str
    why: str = ""
    certificate: str = ""
    repeated: int = 0
    chip: Chip | None = None
    took_s: float = 0.0


@dataclass(frozen=True, slots=True)
class BatchEnded:
    """No part follows."""

    at_utc: str


Entry = Begun | PartBegun | PartEnded | BatchEnded


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the batch: its serial number, where its run lies, what became of it (None: nothing yet)."""

    number: int
    serial: str
    folder: str
    begun_utc: str
    ended: PartEnded | None = None

    @property
    def state(self) -> str:
        """The outcome in a word; a part that nothing has become of yet is open."""
        return "open" if self.ended is None else self.ended.outcome


@dataclass(frozen=True, slots=True)
class Batch:
    """All parts so far, in their order; the last may be in hand."""

    begun: Begun
    parts: tuple[Part, ...] = ()
    ended_utc: str | None = None

    @property
    def in_hand(self) -> Part | None:
        """The part that was begun and has not ended."""
        return self.parts[-1] if self.parts and self.parts[-1].ended is None else None

    def count(self, *states: str) -> int:
        """How many parts have become so."""
        return sum(part.state in states for part in self.parts)

    @property
    def passed(self) -> bool:
        """Whether every serial number of the batch has a verdict, and the newest one is a pass."""
        newest = (self.done(serial) for serial in {part.serial for part in self.parts})
        return all(part is not None and part.state == "pass" for part in newest)

    def done(self, serial: str) -> Part | None:
        """The newest run of that number that came to a verdict."""
        return next((each for each in reversed(self.parts) if each.serial == serial and _judged(each)), None)

    def same_chip(self, chip: Chip, serial: str) -> Part | None:
        """The part of another number, with a verdict, that had this chip."""
        for each in reversed(self.parts):
            seen = each.ended.chip if each.ended is not None and _judged(each) else None
            if each.serial != serial and seen is not None and seen.is_that(chip):
                return each
        return None

    def folder_of(self, serial: str) -> str:
        """A folder's name for the next part: its place and what of its number a file system takes."""
        return f"{len(self.parts) + 1:02d}-{re.sub(r'[^A-Za-z0-9._-]', '_', serial)}"


def state_of(entries: Iterable[Entry]) -> Batch:
    """The batch that a journal's entries tell of. Raises ValueError where they tell of none."""
    batch: Batch | None = None
    for entry in entries:
        batch = after(batch, entry)
    if batch is None:
        raise ValueError("the journal is empty")
    return batch


def after(batch: Batch | None, entry: Entry) -> Batch:
    """The batch after one more entry. Raises ValueError for one that cannot follow."""
    match entry:
        case Begun() if batch is None:
            return Batch(entry)
        case PartBegun() if batch is not None and batch.in_hand is None:
            part = Part(len(batch.parts) + 1, entry.serial, entry.folder, entry.at_utc)
            return replace(batch, parts=(*batch.parts, part), ended_utc=None)
        case PartEnded() if batch is not None and batch.in_hand is not None:
            return replace(batch, parts=(*batch.parts[:-1], replace(batch.in_hand, ended=entry)))
        case BatchEnded() if batch is not None and batch.in_hand is None:
            return replace(batch, ended_utc=entry.at_utc)
        case _:
            raise ValueError(f"{type(entry).__name__} cannot follow there")


@dataclass(frozen=True, slots=True)
class Doubt:
    """Why a serial number is not simply taken; `final` where nobody can say that it is right all the same."""

    why: str
    final: bool = False


def doubt_of(serial: str, batch: Batch, section: StationSection, today: Callable[[str], str | None]) -> Doubt | None:
    """What speaks against running that number now; `today` tells of a run of today that the history knows."""
    try:
        check_serial_number(serial)
    except ValueError as error:
        return Doubt(f"{serial} is no serial number: {error}", final=True)
    if re.fullmatch(section.serial_pattern, serial, re.ASCII) is None:
        return Doubt(f"{serial} does not match the pattern {section.serial_pattern}", final=True)
    if section.parts and serial not in section.parts:
        return Doubt(f"there is no part {serial} in station.parts")
    if (done := batch.done(serial)) is not None:
        return Doubt(f"{serial} is done: part {done.number} of this batch, {done.state.upper()}")
    if (before := today(serial)) is not None:
        return Doubt(f"{serial} was calibrated today: {before}")
    return None


def _judged(part: Part) -> bool:
    return part.state in ("pass", "fail")

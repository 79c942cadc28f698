"""The state of a batch and its possible continuations, from the entries of its journal alone. Pure."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import Field

from rig.config.judging.station_section import StationSection
from rig.config.sensors.sensor_sections import check_serial_number

Outcome = Literal["pass", "fail", "refused", "fault"]
Folder = Annotated[str, Field(pattern=r"^\d{2,}-[A-Za-z0-9._-]*$")]  # a plain name, not a path


@dataclass(frozen=True, slots=True)
class Begun:
    """The beginning of a batch: operator and work order, empty if not stated; whether the laboratory is simulated."""

    operator: str
    work_order: str
    at_utc: str
    simulated: bool = False


@dataclass(frozen=True, slots=True)
class PartBegun:
    """The beginning of a part with a `serial` number, run in `folder` next to the journal."""

    serial: str
    folder: Folder
    at_utc: str


@dataclass(frozen=True, slots=True)
class Chip:
    """The hardware of a part: the board's unique number, and the identities of its sensors (WHO_AM_I)."""

    board: str
    who_am_i: tuple[int, ...] = ()

    def is_that(self, other: "Chip") -> bool:
        """Return whether both are the same chip, by their boards and, if both were read, by the sensors' identities."""
        both_read = self.who_am_i and other.who_am_i
        return self.board == other.board and (not both_read or self.who_am_i == other.who_am_i)

    def __str__(self) -> str:
        """Return the chip's identity in words."""
        identities = ", ".join(f"0x{identity:02x}" for identity in self.who_am_i)
        return f"board {self.board}" + (f", WHO_AM_I {identities}" if identities else "")


@dataclass(frozen=True, slots=True)
class PartEnded:
    """The outcome of the part that was begun last.

    - why: the reason of the outcome, empty for a passed part.
    - certificate: its number, empty without one.
    - repeated: how often refused sweeps were repeated.
    - chip: the part's hardware, None if unknown.
    - took_s: the duration from the start to the end.
    - truth: the agreement of the result with a simulated laboratory's truth, empty without a truth.
    """

    outcome: Outcome
    at_utc: str
    why: str = ""
    certificate: str = ""
    repeated: int = 0
    chip: Chip | None = None
    took_s: float = 0.0
    truth: str = ""


@dataclass(frozen=True, slots=True)
class BatchEnded:
    """The end of the batch."""

    at_utc: str


Entry = Begun | PartBegun | PartEnded | BatchEnded


@dataclass(frozen=True, slots=True)
class BatchPart:
    """A part of the batch: its serial number, its run's folder, its outcome (None: not yet)."""

    number: int
    serial: str
    folder: str
    begun_utc: str
    ended: PartEnded | None = None

    @property
    def state(self) -> str:
        """The outcome in a word; "open" while there is no outcome."""
        return "open" if self.ended is None else self.ended.outcome


@dataclass(frozen=True, slots=True)
class Batch:
    """A batch: all parts so far, in order; the last may be in progress."""

    begun: Begun
    parts: tuple[BatchPart, ...] = ()
    ended_utc: str | None = None

    @property
    def in_hand(self) -> BatchPart | None:
        """The part that was begun and has not ended."""
        return self.parts[-1] if self.parts and self.parts[-1].ended is None else None

    def count(self, *states: str) -> int:
        """Return the number of parts in any of the given states."""
        return sum(part.state in states for part in self.parts)

    @property
    def passed(self) -> bool:
        """Whether the newest verdict of every serial number in the batch is a pass."""
        newest = (self.done(serial) for serial in {part.serial for part in self.parts})
        return all(part is not None and part.state == "pass" for part in newest)

    def done(self, serial: str) -> BatchPart | None:
        """Return the newest run of the serial number with a verdict, or None."""
        return next((part for part in reversed(self.parts) if part.serial == serial and _has_verdict(part)), None)

    def same_chip(self, chip: Chip, serial: str) -> BatchPart | None:
        """Return the newest part with this chip, a verdict and a serial number other than `serial`, if any."""
        for part in reversed(self.parts):
            earlier = part.ended.chip if part.ended is not None and _has_verdict(part) else None
            if part.serial != serial and earlier is not None and earlier.is_that(chip):
                return part
        return None

    def folder_of(self, serial: str) -> str:
        """Return a folder's name for the next part: its number, and its serial number without forbidden letters."""
        return f"{len(self.parts) + 1:02d}-{re.sub(r'[^A-Za-z0-9._-]', '_', serial)}"


def state_of(entries: Iterable[Entry]) -> Batch:
    """Return the batch that a journal's entries describe. Raise ValueError if they describe none."""
    batch: Batch | None = None
    for entry in entries:
        batch = after(batch, entry)
    if batch is None:
        raise ValueError("the journal is empty")
    return batch


def after(batch: Batch | None, entry: Entry) -> Batch:
    """Return the batch after one more entry. Raise ValueError for an entry that cannot follow."""
    match entry:
        case Begun() if batch is None:
            return Batch(entry)
        case PartBegun() if batch is not None and batch.in_hand is None:
            part = BatchPart(len(batch.parts) + 1, entry.serial, entry.folder, entry.at_utc)
            return replace(batch, parts=(*batch.parts, part), ended_utc=None)
        case PartEnded() if batch is not None and batch.in_hand is not None:
            return replace(batch, parts=(*batch.parts[:-1], replace(batch.in_hand, ended=entry)))
        case BatchEnded() if batch is not None and batch.in_hand is None:
            return replace(batch, ended_utc=entry.at_utc)
        case _:
            raise ValueError(f"{type(entry).__name__} cannot follow there")


@dataclass(frozen=True, slots=True)
class Doubt:
    """An objection to a serial number; `final` if the operator may not override it."""

    why: str
    final: bool = False


def doubt_of(serial: str, batch: Batch, section: StationSection, today: Callable[[str], str | None]) -> Doubt | None:
    """Return the objection to running this serial number now, or None; `today` describes its run of today, if any."""
    try:
        check_serial_number(serial)
    except ValueError as error:
        return Doubt(f"{serial} is not a serial number: {error}", final=True)
    if re.fullmatch(section.serial_pattern, serial, re.ASCII) is None:
        return Doubt(f"{serial} does not match the pattern {section.serial_pattern}", final=True)
    if section.parts and serial not in section.parts:
        return Doubt(f"there is no part {serial} in station.parts")
    if (done := batch.done(serial)) is not None:
        return Doubt(f"{serial} is done: part {done.number} of this batch, {done.state.upper()}")
    if (before := today(serial)) is not None:
        return Doubt(f"{serial} was calibrated today: {before}")
    return None


def _has_verdict(part: BatchPart) -> bool:
    return part.state in ("pass", "fail")

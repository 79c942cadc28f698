"""What a kind of result says to every outlet: terminal, page, notebook, certificate, history, header, exports."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar
from xml.etree.ElementTree import Element

from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.config.judging.judging_sections import SiteSection
from rig.data.entries.magnetometer import ReversalEntry
from rig.data.quantity import Quantity, Unit
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.report.findings.characteristic import Characteristic, Term
from rig.report.findings.corrected import Corrected
from rig.report.findings.finding import EntryT, Finding
from rig.report.findings.followed import Followed
from rig.report.findings.unexplained import Unexplained

SaidT = TypeVar("SaidT")
OWN_TEMPLATES = Path(__file__).parents[1] / "certificate" / "templates"


@dataclass(frozen=True, slots=True)
class Without:
    """Why a kind of result has no such outlet."""

    why: str


@dataclass(frozen=True, slots=True)
class Three:
    """Values x, y, z, of fewer axes fewer, or by other labels, and their expanded uncertainties."""

    values: Sequence[float]
    expanded: Sequence[float]


@dataclass(frozen=True, slots=True)
class Shown:
    """Three numbers as page and notebook show them under a `name`, in `unit`; scale factors beside, if there are any.

    They are of a `sensor` and what it measures. `combined` tells whether U holds all that is known, else it is two
    standard deviations of noise. `held_at` says at what the numbers hold ("at ±60.0 °/s") and `model` what they are of
    ("g = K (m + b)"), where a run's end says that; `noun` is what numbers without scale factors are, and `labels` are
    those of the numbers.
    """

    sensor: str
    quantity: Quantity
    name: str
    unit: Unit
    numbers: Three
    combined: bool
    scale: Three | None = None
    held_at: str = ""
    model: str = ""
    noun: str = "bias"
    labels: Sequence[str] = "xyz"


@dataclass(frozen=True, slots=True)
class Measured:
    """What a digital certificate says of one item: its results under a name, and how warm it was when they were read.

    The item is the `sensor` of that name of one kind (`item`: gyroscope), with its part and serial number if the result
    says them.
    """

    item: str
    sensor: str
    part: str | None
    serial_number: str | None
    name: str
    results: Iterable[Element]
    temperatures_c: Mapping[str, float | None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Standard:
    """What the scale factors of sensors that were held still hang on, as certificates say it.

    `size` is what has to be known of it, `value` how large an entry took it to be, `origin` where the laboratory says
    that this comes from. `known` is what was to be read where a file tells the motion; `method` says how an arm showed
    it to them, with or without sweeps of a gyroscope beside.
    """

    size: str
    value: Callable[[Any], str]
    origin: Callable[[SiteSection], str | None]
    known: str
    method: Callable[[bool], str]


@dataclass(frozen=True, slots=True)
class ResultKind(Generic[EntryT]):
    """A kind of result, by what it says to each outlet, or why it says nothing there.

    - `name` is what people call it; `key` is its place in `result.json`, and `entries` makes what stands there: nothing
      where a run has none. `found` finds it there again.
    - `printed` makes what the terminal shows of one: tables and lines; `unsolved` says of all why they were not found.
      `in_short` is what a run ends with of one that has no row.
    - `shown` makes the row of the page and of the notebook, `followed` what a history keeps.
    - `figures` names the writer of its pictures in a run folder (`module:function`), `header` makes the lines of
      `calibration.h`, by the g-sensitivities (3, 3) of the gyroscopes that have one.
    - `block` names the macro of the certificate's page (`template:macro`) that prints one; the template lies in
      `templates`.
    - `measured` is what the digital certificate says of one, with what turning it over has told, by sensor; `standard`
      what both certificates say of traceability.
    - `characteristics` are what entries state beside scale and bias: terminal, page, notebook, both certificates,
      history and exports go through them after what the kind itself says.
    - `corrected` is how exports to other programs put the readings of one right; None of a reference. `unexplained` is
      what the model leaves of its means, for pictures; None of one that has none.
    """

    name: str
    key: str
    entries: Callable[[Outcome], Mapping[str, object]] | Without
    found: Callable[[ResultDocument], Iterator[Finding[EntryT]]]
    printed: Callable[[Finding[EntryT]], Iterator[Table | str]] | Without
    shown: Callable[[Finding[EntryT]], Shown] | Without
    followed: Callable[[Finding[EntryT], ResultDocument], Followed | None] | Without
    header: Callable[[Finding[EntryT], Mapping[str, Array]], Iterable[str]] | Without
    figures: str | Without
    block: str | Without
    measured: Callable[[Finding[EntryT], Mapping[str, ReversalEntry]], Measured | None] | Without
    standard: Standard | Without
    corrected: Callable[[Finding[EntryT]], Corrected | None] | Without
    unexplained: Callable[[Finding[EntryT]], Unexplained | None] | Without
    templates: Path = OWN_TEMPLATES
    unsolved: Callable[[ResultDocument], Iterable[str]] = lambda _: ()
    in_short: Callable[[Finding[EntryT]], Iterable[str]] = lambda _: ()
    characteristics: tuple[Characteristic, ...] = ()


def row_of(term: Term, whose: str | None = None, noun: str | None = None) -> Shown:
    """The row of a characteristic, under the name of its sensor and its own unless others are given."""
    finding, whose, noun = term.finding, whose or term.whose, noun or term.name
    labels, values, widths = zip(*term.printed, strict=True)
    of = finding.sensor, finding.quantity, f"{whose}: {noun}", term.units.shown, Three(values, widths)
    return Shown(*of, combined=True, noun=noun, labels=labels)


def said(outlet: Callable[..., Iterable[SaidT]] | Without, *about: object) -> Iterable[SaidT]:
    """All that an outlet makes of what it is asked `about`; nothing where a kind has none."""
    return () if isinstance(outlet, Without) else outlet(*about)

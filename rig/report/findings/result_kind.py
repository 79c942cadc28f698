"""The outputs of a kind of result (outlets): terminal, page, notebook, certificate, history, header, exports."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar
from xml.etree.ElementTree import Element

from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.config.judging.judging_sections import SiteSection
from rig.data.entries.magnetometer import ReversalEntry
from rig.data.quantity import DisplayUnit, Quantity
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.report.findings.characteristic import Characteristic, Term
from rig.report.findings.finding import EntryT, Finding
from rig.report.findings.history_records import HistoryRecord
from rig.report.findings.linear_corrections import SensorCorrection
from rig.report.findings.unexplained import Unexplained

ItemT = TypeVar("ItemT")
OWN_TEMPLATES = Path(__file__).parents[1] / "certificate" / "templates"


@dataclass(frozen=True, slots=True)
class NoOutlet:
    """The reason `why` a kind of result does not appear in one of the outputs."""

    why: str


@dataclass(frozen=True, slots=True)
class AxisValues:
    """Values of the axes x, y, z, or by other labels, with their expanded uncertainties."""

    values: Sequence[float]
    expanded: Sequence[float]


@dataclass(frozen=True, slots=True)
class DisplayRow:
    """A row of page and notebook: numbers, with scale factors if there are any.

    - sensor, quantity: the sensor and what it measures.
    - name, unit: the row's name and unit.
    - numbers: the values with U.
    - combined: whether U includes all contributors; otherwise it is two standard deviations of the noise.
    - scale: the scale factors with U.
    - held_at: the conditions under which the values are valid, as the end of a run prints them ("at ±60.0 °/s").
    - model: the model of correction or reading ("g = K (m + b)"); the end of a run prints only its first equation.
    - noun: the name of `numbers`, such as "bias".
    - labels: the labels of the numbers.
    """

    sensor: str
    quantity: Quantity
    name: str
    unit: DisplayUnit
    numbers: AxisValues
    combined: bool
    scale: AxisValues | None = None
    held_at: str = ""
    model: str = ""
    noun: str = "bias"
    labels: Sequence[str] = "xyz"


@dataclass(frozen=True, slots=True)
class CertifiedItem:
    """The digital certificate's content for one item: named results, and the temperatures of their readings.

    `item` is the kind of sensor, such as gyroscope, and `sensor` the configured name. `part` and `serial_number` are
    None if the result does not state them.
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
    """The statements of a certificate on the reference standard of a kind of sensor that is calibrated at rest.

    - `size`: the name of the standard's quantity, such as "Gravity", for the beginning of a sentence.
    - `value`: formats the standard's value from an entry.
    - `origin`: returns the laboratory's statement of where this value comes from.
    - `quantity`: the name of the standard's quantity within a sentence, if a file gives the motion.
    - `method`: describes the measurement on an arm; its argument says whether gyroscope sweeps were made too.
    """

    size: str
    value: Callable[[Any], str]
    origin: Callable[[SiteSection], str | None]
    quantity: str
    method: Callable[[bool], str]


@dataclass(frozen=True, slots=True)
class ResultKind(Generic[EntryT]):
    """A kind of result: a function for each output (outlet), or the reason why the kind does not have this output.

    A function that serves an output is named by a participle: a result is printed on the terminal, shown on the page.

    - name: the kind's name for people.
    - key: the kind's key in result.json.
    - entries: builds this kind's entries of result.json from a run's outcome.
    - find: finds this kind's entries in the document of a result.
    - printed: yields tables and lines for the terminal.
    - shown: builds the row of page and notebook.
    - followed: builds the record of a history.
    - header: yields the lines of calibration.h from a finding and the g-sensitivities (3, 3) of gyroscopes, by sensor.
    - figures: the writer of its pictures in a run folder ("module:function").
    - block: the macro of the certificate's page that prints a finding ("template:macro").
    - measured: builds the content of the digital certificate from a finding and the reversal entries, by sensor.
    - standard: the statement of traceability in both certificates.
    - corrected: builds the correction of readings for exports; None for a reference.
    - unexplained: builds the residuals of a finding's means for pictures; returns None without residuals.
    - templates: the folder of the block's template.
    - unsolved: yields the reasons why sensors have no solution.
    - in_short: yields lines for the end of a run, if the kind has no row.
    - characteristics: quantities other than scale and bias, for all outputs.
    """

    name: str
    key: str
    entries: Callable[[Outcome], Mapping[str, object]] | NoOutlet
    find: Callable[[ResultDocument], Iterator[Finding[EntryT]]]
    printed: Callable[[Finding[EntryT]], Iterator[Table | str]] | NoOutlet
    shown: Callable[[Finding[EntryT]], DisplayRow] | NoOutlet
    followed: Callable[[Finding[EntryT], ResultDocument], HistoryRecord | None] | NoOutlet
    header: Callable[[Finding[EntryT], Mapping[str, Array]], Iterable[str]] | NoOutlet
    figures: str | NoOutlet
    block: str | NoOutlet
    measured: Callable[[Finding[EntryT], Mapping[str, ReversalEntry]], CertifiedItem | None] | NoOutlet
    standard: Standard | NoOutlet
    corrected: Callable[[Finding[EntryT]], SensorCorrection | None] | NoOutlet
    unexplained: Callable[[Finding[EntryT]], Unexplained | None] | NoOutlet
    templates: Path = OWN_TEMPLATES
    unsolved: Callable[[ResultDocument], Iterable[str]] = lambda _: ()
    in_short: Callable[[Finding[EntryT]], Iterable[str]] = lambda _: ()
    characteristics: tuple[Characteristic, ...] = ()


def row_of(term: Term, whose: str | None = None, noun: str | None = None) -> DisplayRow:
    """Return the display row of a characteristic, by default named after the sensor and the characteristic."""
    finding, whose, noun = term.finding, whose or term.whose, noun or term.name
    labels, values, widths = zip(*term.printed, strict=True)
    numbers, unit = AxisValues(values, widths), term.units.shown
    about = finding.sensor, finding.quantity, f"{whose}: {noun}", unit, numbers
    return DisplayRow(*about, combined=True, noun=noun, labels=labels)


def outlet_items(outlet: Callable[..., Iterable[ItemT]] | NoOutlet, *about: object) -> Iterable[ItemT]:
    """Return the items that an outlet yields for the arguments `about`; empty if the kind lacks the outlet."""
    return () if isinstance(outlet, NoOutlet) else outlet(*about)

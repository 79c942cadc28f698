"""What all sensors of three axes share in a result: scale factors, biases and axes by one account of uncertainty."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.data.entries.budget import expanded_uncertainties
from rig.data.entries.magnetometer import ReversalEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.quantity import Quantity
from rig.data.recording.motion_file import NOT_STATED
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.report.findings.characteristic import Characteristic
from rig.report.findings.characteristics import NON_ORTHOGONALITY
from rig.report.findings.corrected import Corrected, noise_of
from rig.report.findings.finding import Finding
from rig.report.findings.followed import Calibrated, Followed, known, scale_and_bias
from rig.report.findings.kind import Measured, ResultKind, Shown, Standard, Three
from rig.report.findings.unexplained import of_attitudes
from rig.report.tables.axes import line_of, scale_and_bias_table, triple
from rig.report.tables.budget import budget_table, expanded_heading


@dataclass(frozen=True, slots=True)
class Words:
    """What is said of one such sensor, by its entry: behind its name, its model, lines below its table.

    Of the digital certificate its scale and bias, with what turning it over has told, and how warm it was.
    """

    title: str
    model: Callable[[Any], str]
    lines: Callable[[Finding[Any]], Iterator[str]]
    digital: Callable[[Any, ReversalEntry | None], Iterator[Element]]
    temperatures_c: Callable[[Any], Mapping[str, float | None]]


def bias_of(quantity: Quantity, entry: object) -> Sequence[float]:
    """The bias (3,) of an entry, in SI units."""
    found: Sequence[float] = getattr(entry, quantity.named("bias"))
    return found


def shown_of(finding: Finding[Any]) -> Shown:
    """The row of page and notebook."""
    quantity, entry = finding.quantity, finding.entry
    expanded, size = expanded_uncertainties(entry.budget, entry.covariance), quantity.bias.size
    axes = len(entry.scale)
    bias = Three([each / size for each in bias_of(quantity, entry)], [each / size for each in expanded[axes:]])
    scale, combined = Three(entry.scale, expanded[:axes]), entry.budget is not None
    name, unit = quantity.label(finding.sensor), quantity.bias
    return Shown(finding.sensor, quantity, name, unit, bias, combined, scale, labels=quantity.axes)


def followed_of(finding: Finding[Any], document: ResultDocument) -> Followed:
    """Scale and bias as a history keeps them."""
    quantity, entry = finding.quantity, finding.entry
    followed = [*scale_and_bias(finding.sensor, quantity, entry, bias_of(quantity, entry), document)]
    full_scale: float = getattr(entry, quantity.named("range")) or 0.0
    temperature_c: float | None = getattr(entry, "temperature_c", None)
    of = entry.part, entry.serial_number, full_scale, entry.estimator, temperature_c
    return Followed(finding.sensor, quantity.name, *of, known(followed))


def tables(title: str, quantity: Quantity, entry: Calibrated) -> Iterator[Table]:
    """Scale and bias of each axis ± U, and what makes U up."""
    budget, expanded = entry.budget, expanded_uncertainties(entry.budget, entry.covariance)
    yield scale_and_bias_table(
        title, quantity, entry.scale, bias_of(quantity, entry), expanded, heading=expanded_heading(budget)
    )
    if budget is not None:
        yield budget_table(budget, entry.scale, quantity.bias)


def item_words(entry: Any) -> str:
    """Part and serial number, as far as anybody said."""
    told = [each for each in (entry.part, entry.serial_number) if each != NOT_STATED]
    return " ".join(told) or "part and serial number not stated"


def attitude_lines(finding: Finding[Any]) -> Iterator[str]:
    """How far the axes are from right angles, and the attitudes from what they were taken to be.

    And, where a file told the attitudes, what laying down did and what was left out.
    """
    entry, quantity = finding.entry, finding.quantity
    yield line_of(NON_ORTHOGONALITY.of(finding), "non-orthogonality yz zx xy", "+.4f")
    if entry.attitude_error_rad is not None:
        known = "" if entry.attitude_error_std_rad is None else f" (± {2e3 * entry.attitude_error_std_rad:.2f})"
        yield f"attitude error found: {1e3 * entry.attitude_error_rad:.2f} mrad about each axis{known}"
    laid, unit = entry.placement, quantity.unit
    if laid is None:
        return
    if laid.placement_std is not None:
        told = f"{laid.placement_std:.2g} ± {2 * laid.placement_uncertainty:.2g} {unit}"
        count = laid.rests_without_attitude
        beside = f", {count} more rests have helped to find it" if count else ""
        yield f"a placement found to change each reading by {told} beside its attitude{beside}"
        if laid.placement_uncertainty > laid.placement_std / 2:
            yield "this is hardly known: lay it down in the same attitudes again, and the uncertainty becomes smaller"


def method_lines(entry: Any, quantity: Quantity, from_what: str = "") -> Iterator[str]:
    """What each of the other methods finds, or why it finds nothing."""
    for method, other in entry.other_methods.items():
        if isinstance(other, ErrorEntry):
            yield f"{method}{from_what}: {other.error}"
        else:
            bias = triple(np.divide(bias_of(quantity, other), quantity.bias.size), f"+.{quantity.decimals}f")
            yield f"{method}{from_what}: k {triple(other.scale, '.6f')}, b {bias} {quantity.bias.name}"


def unsolved_lines(document: ResultDocument, quantity: Quantity) -> Iterator[str]:
    """Why readings from elsewhere told nothing of a quantity."""
    for name, faults in document.unsolved.items():
        if (fault := faults.get(quantity.name)) is not None:
            yield f"{name}, {quantity.sensor}, not calibrated: {fault.error}"


def _corrected(finding: Finding[Any]) -> Corrected:
    """Readings to what they are of, in the right-angled frame that the entry's matrix leads to."""
    quantity, entry = finding.quantity, finding.entry
    noise = [(getattr(dwell, quantity.named("noise")), dwell.samples) for dwell in entry.dwells]
    return Corrected(
        sensor=finding.sensor,
        quantity=quantity,
        part=entry.part,
        serial_number=entry.serial_number,
        full_scale=getattr(entry, quantity.named("range")),
        temperature_c=getattr(entry, "temperature_c", None),
        scale=np.array(entry.scale),
        matrix=np.linalg.inv(np.array(entry.correction_matrix)),
        offset=np.array(bias_of(quantity, entry)),
        noise=noise_of(entry.dwells, noise),
        second_order=getattr(entry, "second_order_s2_m", None) is not None,
    )


def triad_kind(
    quantity: Quantity,
    key: str,
    entries: Callable[[Outcome], Mapping[str, object]],
    words: Words,
    *,
    header: Callable[[Finding[Any], Mapping[str, Array]], Iterable[str]],
    block: str,
    standard: Standard,
    characteristics: tuple[Characteristic, ...],
) -> ResultKind[Any]:
    """The kind of a sensor that attitudes calibrate, whose entries stand at `key`; its `words` are its own."""

    def found(document: ResultDocument) -> Iterator[Finding[Any]]:
        of_all: Mapping[str, Any] = getattr(document, key)
        return (Finding(name, quantity, each) for name, each in of_all.items() if not isinstance(each, ErrorEntry))

    def unsolved(document: ResultDocument) -> Iterator[str]:
        of_all: Mapping[str, Any] = getattr(document, key)
        for name, each in of_all.items():
            if isinstance(each, ErrorEntry):
                yield f"{quantity.label(name)}, not calibrated: {each.error}"
        yield from unsolved_lines(document, quantity)

    def printed(finding: Finding[Any]) -> Iterator[Table | str]:
        entry = finding.entry
        title = f"{quantity.label(finding.sensor)}{words.title}: {item_words(entry)}"
        yield from tables(f"{title}, {words.model(entry)}, {entry.estimator}", quantity, entry)
        yield from words.lines(finding)

    def measured(finding: Finding[Any], turned: Mapping[str, ReversalEntry]) -> Measured:
        entry, name = finding.entry, f"calibration of {quantity.sensor} {finding.sensor}"
        results = words.digital(entry, turned.get(finding.sensor))
        warm = words.temperatures_c(entry)
        return Measured(quantity.sensor, finding.sensor, entry.part, entry.serial_number, name, results, warm)

    return ResultKind(
        name=quantity.sensor,
        key=key,
        entries=entries,
        found=found,
        unsolved=unsolved,
        printed=printed,
        shown=shown_of,
        followed=followed_of,
        header=header,
        figures="rig.report.figures.attitudes:write_attitude_figures",
        block=block,
        measured=measured,
        standard=standard,
        corrected=_corrected,
        unexplained=of_attitudes,
        characteristics=characteristics,
    )

"""All kinds of results, in displayed order. A new kind is a file and a line here."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Any, Final, TypeVar

from rig.data.installed_kinds import installed_kinds
from rig.data.result_file import ResultDocument
from rig.report.findings.characteristic import Outlet, Term, terms
from rig.report.findings.finding import Finding
from rig.report.findings.history_records import HistoryRecord, parameters, select_uncertain
from rig.report.findings.result_kind import DisplayRow, NoOutlet, ResultKind, row_of
from rig.report.kinds.accelerometer import ACCELEROMETER
from rig.report.kinds.bias_drift import BIAS_DRIFT
from rig.report.kinds.earth_rate import EARTHS_RATE
from rig.report.kinds.gyroscope import GYROSCOPE
from rig.report.kinds.magnetometer import MAGNETOMETER
from rig.report.kinds.over_temperature import OVER_TEMPERATURE
from rig.report.kinds.verification import VERIFICATION

OutletT = TypeVar("OutletT")
RIG_KINDS: Final[tuple[ResultKind[Any], ...]] = (
    GYROSCOPE, EARTHS_RATE, ACCELEROMETER, MAGNETOMETER, BIAS_DRIFT, OVER_TEMPERATURE, VERIFICATION,
)  # fmt: skip


@cache
def kinds() -> tuple[ResultKind[Any], ...]:
    """Return all kinds of results: the rig's own, then those of packages (`rig.data.installed_kinds`)."""
    return (*RIG_KINDS, *(kind.result for kind in installed_kinds()))


def outlets(
    document: ResultDocument, outlet_of: Callable[[ResultKind[Any]], OutletT | NoOutlet]
) -> Iterator[tuple[ResultKind[Any], OutletT, Finding[Any]]]:
    """Yield kind, outlet and finding for each part of a result whose kind has the outlet that `outlet_of` selects."""
    for kind in kinds():
        if not isinstance(outlet := outlet_of(kind), NoOutlet):
            yield from ((kind, outlet, finding) for finding in kind.find(document))


def terms_of(document: ResultDocument, outlet: Outlet | None = None) -> Iterator[Term]:
    """Yield all characteristics in a result, kind by kind, or only those that the form of output `outlet` shows."""
    for kind in kinds():
        for finding in kind.find(document):
            yield from terms(kind.characteristics, finding, outlet)


def shown(document: ResultDocument) -> Iterator[DisplayRow]:
    """Yield the rows of page and notebook: those of all kinds of results, then those of characteristics."""
    yield from (show(finding) for _, show, finding in outlets(document, lambda kind: kind.shown))
    yield from map(row_of, terms_of(document, "page"))


def history_records(document: ResultDocument) -> tuple[HistoryRecord, ...]:
    """Return a result's records for a history, of all sensors including references."""
    return tuple(_records(document))


def _records(document: ResultDocument) -> Iterator[HistoryRecord]:
    for kind, follow, finding in outlets(document, lambda kind: kind.followed):
        if (record := follow(finding, document)) is not None:
            more = select_uncertain([*parameters(terms(kind.characteristics, finding, "history"))])
            yield replace(record, parameters=(*record.parameters, *more))

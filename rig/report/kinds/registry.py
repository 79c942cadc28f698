"""Every kind of result, in the order in which they are shown: a new one is a file and a line here."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Any, Final, TypeVar

from rig.data.installed_kinds import installed_kinds
from rig.data.result_file import ResultDocument
from rig.report.findings.characteristic import Outlet, Term, terms
from rig.report.findings.finding import Finding
from rig.report.findings.followed import Followed, known, parameters
from rig.report.findings.kind import ResultKind, Shown, Without, row_of
from rig.report.kinds.accelerometer import ACCELEROMETER
from rig.report.kinds.bias_drift import BIAS_DRIFT
from rig.report.kinds.earth_rate import EARTHS_RATE
from rig.report.kinds.gyroscope import GYROSCOPE
from rig.report.kinds.magnetometer import MAGNETOMETER
from rig.report.kinds.over_temperature import OVER_TEMPERATURE
from rig.report.kinds.verification import VERIFICATION

OutletT = TypeVar("OutletT")
OF_THE_RIG: Final[tuple[ResultKind[Any], ...]] = (
    GYROSCOPE, EARTHS_RATE, ACCELEROMETER, MAGNETOMETER, BIAS_DRIFT, OVER_TEMPERATURE, VERIFICATION,
)  # fmt: skip


@cache
def kinds() -> tuple[ResultKind[Any], ...]:
    """Every kind of result, those that packages add (`rig.data.installed_kinds`) after the rig's own."""
    return (*OF_THE_RIG, *(kind.result for kind in installed_kinds()))


def outlets(
    document: ResultDocument, of: Callable[[ResultKind[Any]], OutletT | Without]
) -> Iterator[tuple[ResultKind[Any], OutletT, Finding[Any]]]:
    """Everything in a result that has an outlet `of` its kind: the kind, the outlet and what it is asked about."""
    for kind in kinds():
        if not isinstance(outlet := of(kind), Without):
            yield from ((kind, outlet, finding) for finding in kind.found(document))


def terms_of(document: ResultDocument, outlet: Outlet | None = None) -> Iterator[Term]:
    """Every characteristic in a result, kind by kind; those that an outlet takes where one is named."""
    for kind in kinds():
        for finding in kind.found(document):
            yield from terms(kind.characteristics, finding, outlet)


def shown(document: ResultDocument) -> Iterator[Shown]:
    """The rows of page and notebook: of every sensor what was found, kind by kind, then what stands beside."""
    yield from (show(finding) for _, show, finding in outlets(document, lambda kind: kind.shown))
    yield from map(row_of, terms_of(document, "page"))


def followed(document: ResultDocument) -> tuple[Followed, ...]:
    """All that a result says of sensors for a history to keep, references too."""
    return tuple(_followed(document))


def _followed(document: ResultDocument) -> Iterator[Followed]:
    for kind, follow, finding in outlets(document, lambda kind: kind.followed):
        if (each := follow(finding, document)) is not None:
            more = known([*parameters(terms(kind.characteristics, finding, "history"))])
            yield replace(each, parameters=(*each.parameters, *more))

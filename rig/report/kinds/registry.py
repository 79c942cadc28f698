"""Every kind of result, in the order in which they are shown: a new one is a file and a line here."""

from collections.abc import Iterator
from functools import cache
from typing import Any, Final

from rig.data.installed_kinds import installed_kinds
from rig.data.result_file import ResultDocument
from rig.report.kinds.accelerometer import ACCELEROMETER
from rig.report.kinds.bias_drift import BIAS_DRIFT
from rig.report.kinds.earth_rate import EARTH_RATE
from rig.report.kinds.followed import Followed
from rig.report.kinds.gyroscope import GYROSCOPE
from rig.report.kinds.kind import ResultKind, Shown, Without
from rig.report.kinds.magnetometer import MAGNETOMETER
from rig.report.kinds.over_temperature import OVER_TEMPERATURE
from rig.report.kinds.verification import VERIFICATION

OF_THE_RIG: Final[tuple[ResultKind[Any], ...]] = (
    GYROSCOPE, EARTH_RATE, ACCELEROMETER, MAGNETOMETER, BIAS_DRIFT, OVER_TEMPERATURE, VERIFICATION,
)  # fmt: skip


@cache
def kinds() -> tuple[ResultKind[Any], ...]:
    """Every kind of result, those that packages add (`rig.data.installed_kinds`) after the rig's own."""
    return (*OF_THE_RIG, *(kind.result for kind in installed_kinds()))


def shown(document: ResultDocument) -> Iterator[Shown]:
    """The rows of page and notebook: of every sensor what was found, kind by kind."""
    for kind in kinds():
        if not isinstance(kind.shown, Without):
            yield from map(kind.shown, kind.found(document))


def followed(document: ResultDocument) -> tuple[Followed, ...]:
    """All that a result says of sensors for a history to keep, references too."""
    return tuple(
        each
        for kind in kinds()
        if not isinstance(kind.followed, Without)
        for found in kind.found(document)
        if (each := kind.followed(found, document)) is not None
    )

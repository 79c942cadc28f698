"""The Earth's rate, where a gyroscope was to find it (TRIAX, section III-A)."""

from collections.abc import Iterator

from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.quantity import RATE
from rig.data.result_file import GyroscopeEntry, ResultDocument
from rig.report.findings.characteristics import EARTH_RATE, EARTHS_RATES
from rig.report.findings.finding import Finding
from rig.report.findings.followed import Followed
from rig.report.findings.kind import Measured, ResultKind, Shown, Without, row_of
from rig.report.kinds.gyroscope import temperatures_c
from rig.report.tables import dcc_results


def _found(document: ResultDocument) -> Iterator[Finding[GyroscopeEntry]]:
    """Every sensor that has found it."""
    for name, sensor in document.gyroscopes.items():
        if isinstance(sensor.earth_rate, EarthRateEntry):
            yield Finding(name, RATE, sensor)


def _of(finding: Finding[GyroscopeEntry]) -> EarthRateEntry:
    rate = finding.entry.earth_rate
    if not isinstance(rate, EarthRateEntry):
        raise TypeError(f"{finding.sensor} has not found the Earth's rate")
    return rate


def _shown(finding: Finding[GyroscopeEntry]) -> Shown:
    """The Earth's rate in the axes of the arm's base."""
    return row_of(EARTH_RATE.of(finding))


def _followed(finding: Finding[GyroscopeEntry], _: object) -> Followed:
    sensor = finding.entry
    return Followed(
        finding.sensor,
        "Earth's rate",
        sensor.part,
        sensor.serial_number,
        sensor.range_rad_s or 0.0,
        sensor.estimator,
        sensor.temperature_c,
    )


def _measured(finding: Finding[GyroscopeEntry], _: object) -> Measured | None:
    """The item is its gyroscope, as warm as that was; a reference is none."""
    sensor = finding.entry
    if finding.known:
        return None
    name, results = f"the Earth's rate found by gyroscope {finding.sensor}", dcc_results.earth_rate(_of(finding))
    warm = temperatures_c(sensor)
    return Measured("gyroscope", finding.sensor, sensor.part, sensor.serial_number, name, results, warm)


AMONG = Without("it stands among the lines of its gyroscope")
EARTHS_RATE = ResultKind(
    name="Earth's rate",
    key="gyroscopes",
    entries=Without("it is part of its gyroscope's entry"),
    found=_found,
    printed=AMONG,
    shown=_shown,
    followed=_followed,
    header=Without("it is the place's, not the sensor's"),
    figures="rig.report.figures.earth_rate:write_earth_rate_figures",
    block=Without("it stands in the block of its gyroscope"),
    measured=_measured,
    standard=Without("it hangs on that of its gyroscope"),
    corrected=Without("it is the place's, not the sensor's"),
    unexplained=Without("it is told by what its gyroscope's picture shows"),
    characteristics=EARTHS_RATES,
)

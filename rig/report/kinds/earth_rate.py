"""The Earth's rate, if a gyroscope was to measure it (paper TRIAX, section III-A)."""

from collections.abc import Iterator

from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.quantity import RATE
from rig.data.result_file import GyroscopeEntry, ResultDocument
from rig.report.findings.characteristics import EARTH_RATE, EARTH_RATES
from rig.report.findings.finding import Finding
from rig.report.findings.history_records import HistoryRecord
from rig.report.findings.result_kind import CertifiedItem, NoOutlet, ResultKind, row_of
from rig.report.kinds.gyroscope import temperatures_c
from rig.report.tables import dcc_results


def _find(document: ResultDocument) -> Iterator[Finding[GyroscopeEntry]]:
    """Yield the sensors that measured the Earth's rate."""
    for name, sensor in document.gyroscopes.items():
        if isinstance(sensor.earth_rate, EarthRateEntry):
            yield Finding(name, RATE, sensor)


def _rate_of(finding: Finding[GyroscopeEntry]) -> EarthRateEntry:
    rate = finding.entry.earth_rate
    if not isinstance(rate, EarthRateEntry):
        raise TypeError(f"{finding.sensor} has not found the Earth's rate")
    return rate


def _build_record(finding: Finding[GyroscopeEntry], _: object) -> HistoryRecord:
    sensor = finding.entry
    return HistoryRecord(
        finding.sensor,
        "Earth's rate",
        sensor.part,
        sensor.serial_number,
        sensor.range_rad_s or 0.0,
        sensor.estimator,
        sensor.temperature_c,
    )


def _describe_item(finding: Finding[GyroscopeEntry], _: object) -> CertifiedItem | None:
    """Return the certificate's item of the Earth's rate that this gyroscope measured; None for a reference."""
    sensor = finding.entry
    if finding.is_reference:
        return None
    name, results = (
        f"the Earth's rate measured by gyroscope {finding.sensor}",
        dcc_results.earth_rate(_rate_of(finding)),
    )
    temperatures = temperatures_c(sensor)
    return CertifiedItem("gyroscope", finding.sensor, sensor.part, sensor.serial_number, name, results, temperatures)


NO_OWN_LINE = NoOutlet("it is among the lines of its gyroscope")
EARTHS_RATE = ResultKind(
    name="Earth's rate",
    key="gyroscopes",
    entries=NoOutlet("it is part of its gyroscope's entry"),
    find=_find,
    printed=NO_OWN_LINE,
    shown=lambda finding: row_of(EARTH_RATE.term_of(finding)),
    followed=_build_record,
    header=NoOutlet("it is a property of the site, not of the sensor"),
    figures="rig.report.figures.earth_rate:write_earth_rate_figures",
    block=NoOutlet("it is in the block of its gyroscope"),
    measured=_describe_item,
    standard=NoOutlet("it has the standard of its gyroscope"),
    corrected=NoOutlet("it is a property of the site, not of the sensor"),
    unexplained=NoOutlet("its gyroscope's picture shows its residuals"),
    characteristics=EARTH_RATES,
)

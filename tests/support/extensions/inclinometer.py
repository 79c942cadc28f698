"""A kind of sensor unknown to the rig: a two-axis inclinometer, as a user's package adds it.

φ = a m + c along x and y, φ the angle by which the axis rises above the horizontal: k = 1/a … in the rig's words m = φ
/ k + b.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from rich.table import Table

from rig.analysis.check import fitness
from rig.analysis.installed_solvers import OfKind
from rig.analysis.outcome import Outcome
from rig.data.entries.result_types import Entry
from rig.data.quantity import DisplayUnit, Quantity
from rig.data.recording.settings import Site
from rig.data.result_file import ResultDocument
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.external.placements import Placements
from rig.report.findings.finding import Finding
from rig.report.findings.history_records import HistoryRecord, scale_and_bias, select_uncertain
from rig.report.findings.result_kind import CertifiedItem, DisplayRow, NoOutlet, ResultKind, Standard
from rig.report.findings.unexplained import Unexplained
from rig.report.kinds.triad import shown_of, tables
from rig.report.tables.xml_parts import dcc, real_list, text
from rig.report.words.expanded_uncertainty import expanded

KEY, FEWEST = "inclinometers", 4
DEGREE = np.pi / 180
TABLE_STD_RAD = 2e-5  # how well the table that it lies on is known, in each attitude
INCLINATION = Quantity(
    name="inclination",
    sensor="inclinometer",
    unit="rad",
    suffix="rad",
    reading=DisplayUnit("°", DEGREE),
    bias=DisplayUnit("mrad", 1e-3),
    decimals=3,
    drift=DisplayUnit("µrad", 1e-6),
    residuals=(DisplayUnit("mrad", 1e-3),),
    walk="white noise",
    walk_suffix="rad_sqrt_s",
    walk_unit=DisplayUnit("µrad √s", 1e-6),
    steady=1e-3,
    d_si=r"\radian",
    axes="xy",
)


@dataclass(frozen=True)
class Solution:
    """Scale (2,), bias (2,), their covariance (4, 4), residuals (N, 2) in rad."""

    scale: Array
    bias_rad: Array
    covariance: Array
    residuals_rad: Array


class InclinometerEntry(Entry):
    """An inclinometer's calibration m = φ / k + b."""

    part: str
    serial_number: str
    estimator: str
    scale: tuple[float, float]
    bias_rad: tuple[float, float]
    covariance: tuple[tuple[float, ...], ...]
    covariance_combined: tuple[tuple[float, ...], ...] | None
    budget: None = None
    residuals_rad: tuple[tuple[float, float], ...]


def solve(name: str, placements: Placements, site: Site) -> OfKind:
    """Fit lines through the readings over the angles of rise, axis by axis, weighted by all variances."""
    read = placements.read
    up = placements.attitudes.swapaxes(1, 2) @ np.array(site.up)
    rise, means = np.arcsin(up[:, :2]), read.means[INCLINATION]
    variances = read.variances[INCLINATION] + TABLE_STD_RAD**2
    if len(means) < FEWEST:
        raise Fault("too_few_observations", f"{len(means)} attitudes do not tell two lines", "Lay it down more often")
    lines = [_line(*row) for row in zip(rise.T, means.T, variances.T, strict=True)]
    scale, bias = (np.array([1 / line[0][0] for line in lines]), np.array([line[0][1] for line in lines]))
    covariance = np.zeros((4, 4))
    for i, ((slope, _), spread) in enumerate(lines):
        turn = np.diag([-1 / slope**2, 1.0])
        covariance[np.ix_((i, 2 + i), (i, 2 + i))] = turn @ spread @ turn
    residuals = means - (rise / scale + bias)
    check = fitness(name, INCLINATION.name, "residuals", float(np.abs(residuals).max()), 0.01, unit="rad")
    return OfKind(Solution(scale, bias, covariance, residuals), (check,))


def _line(rise: Array, means: Array, variances: Array) -> tuple[Array, Array]:
    design = np.column_stack([rise, np.ones(len(rise))]) / np.sqrt(variances)[:, None]
    spread = np.linalg.inv(design.T @ design)
    line: Array = spread @ design.T @ (means / np.sqrt(variances))
    return line, np.asarray(spread, dtype=np.float64)


def _entries(outcome: Outcome) -> dict[str, InclinometerEntry]:
    entries = {}
    for kind in outcome.installed_kinds:
        if kind.quantity == INCLINATION and kind.solved is not None and isinstance(kind.solved.solution, Solution):
            fields = {key: np.asarray(value).tolist() for key, value in vars(kind.solved.solution).items()}
            item = kind.sensor.part, kind.sensor.serial_number
            fields["covariance_combined"] = fields["covariance"]
            entries[kind.name] = InclinometerEntry(part=item[0], serial_number=item[1], estimator="lines", **fields)
    return entries


def _find(document: ResultDocument) -> Iterator[Finding[InclinometerEntry]]:
    for name, entry in document.others.get(KEY, {}).items():
        yield Finding(name, INCLINATION, InclinometerEntry.model_validate(entry))


def _print(finding: Finding[InclinometerEntry]) -> Iterator[Table | str]:
    yield from tables(f"{finding.sensor}: inclinometer, m = φ / k + b", INCLINATION, finding.entry)


def _shown(finding: Finding[InclinometerEntry]) -> DisplayRow:
    return replace(shown_of(finding), combined=finding.entry.covariance_combined is not None)


def _record(finding: Finding[InclinometerEntry], document: ResultDocument) -> HistoryRecord:
    entry = finding.entry
    rows = list(scale_and_bias(finding.sensor, INCLINATION, entry, entry.bias_rad, document))
    identity = entry.part, entry.serial_number, 0.0, entry.estimator, None
    return HistoryRecord(finding.sensor, INCLINATION.name, *identity, select_uncertain(rows))


def _find_residuals(finding: Finding[InclinometerEntry]) -> Unexplained:
    residuals = np.array(finding.entry.residuals_rad)
    labels = [f"attitude {number}" for number in range(1, len(residuals) + 1)]
    return Unexplained(INCLINATION, labels, residuals, np.full(residuals.shape, TABLE_STD_RAD), "the table's attitudes")


def _header(finding: Finding[InclinometerEntry], _: Mapping[str, Array]) -> Iterator[str]:
    x, y = finding.entry.scale
    yield f"static const float {finding.sensor}_inclination_scale[2] = {{{x}f, {y}f}};"


def _certify(finding: Finding[InclinometerEntry], _: Any) -> CertifiedItem:
    entry, spread = finding.entry, [finding.entry.covariance[i][i] ** 0.5 for i in range(2)]
    listed = real_list("xy", entry.scale, [r"\one"], expanded=expanded(spread, None))
    result: Element = dcc("result", text("name", "scale factor"), dcc("data", listed))
    name = "calibration of inclinometer"
    return CertifiedItem("inclinometer", finding.sensor, entry.part, entry.serial_number, name, [result])


RESULT = ResultKind(
    name="inclinometer",
    key=KEY,
    entries=_entries,
    find=_find,
    printed=_print,
    shown=_shown,
    followed=_record,
    header=_header,
    figures=NoOutlet("two lines are told by their residuals, which are in the result"),
    block="inclinometer.html.j2:inclinometer",
    templates=Path(__file__).parent,
    measured=_certify,
    unexplained=_find_residuals,
    corrected=NoOutlet("no autopilot and no library that takes exports knows two lines"),
    standard=Standard(
        size="The rise of its axes above the horizontal",
        value=lambda _: "as the attitudes give it",
        origin=lambda _: None,
        quantity="the rise of an axis above the horizontal",
        method=lambda _: "Inclinometers are held still in known attitudes.",
    ),
)


KIND = SimpleNamespace(quantity=INCLINATION, solve=solve, result=RESULT)  # named by the entry point

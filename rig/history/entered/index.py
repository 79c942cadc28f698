"""The columns of a run's row that repeat values of its result: written on entry, later compared with it. Pure."""

import hashlib
import math
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime

from rig.data.result_file import ResultDocument
from rig.report.findings.history_records import HistoryRecord, Parameter
from rig.report.kinds.kind_registry import history_records

STD_TOLERANCE = 1e-6  # relative to the standard uncertainty: above the rounding of another processor


def run_row(document: ResultDocument) -> dict[str, str | bool]:
    """Return the columns of a run's row that repeat values of the result."""
    origin = document.provenance
    return {
        "measurement_sha256": measurement_sha256(document),
        "started_utc": utc(origin.started_utc),
        "solved_utc": utc(origin.solved_utc),
        "arm_serial_number": origin.arm_serial_number,
        "board_unique_id": origin.board_unique_id,
        "configuration_sha256": origin.configuration_sha256,
        "verdict": document.verdict,
        "fit": fit(document),
    }


def measurement_sha256(document: ResultDocument) -> str:
    """Return the checksum that identifies a measurement: arm, board, configuration, start time."""
    provenance = document.provenance
    identity = (
        provenance.started_utc,
        provenance.arm_serial_number,
        provenance.board_unique_id,
        provenance.configuration_sha256,
    )
    return hashlib.sha256("\n".join(identity).encode()).hexdigest()


def fit(document: ResultDocument) -> bool:
    """Return whether the measurement passed its checks of fitness, regardless of the sensor's conformity."""
    return all(check.passed for check in document.checks if check.means.kind == "fitness")


def utc(text: str) -> str:
    """Return a time as a text in UTC, always in the same form, so that texts sort like times."""
    return datetime.fromisoformat(text).astimezone(UTC).isoformat(timespec="seconds")


def unlike(document: ResultDocument, recomputed: Sequence[HistoryRecord]) -> Iterator[str]:
    """Yield the differences, beyond the rounding of processors, of `recomputed` calibrations from the document's."""
    stated = {(record.sensor, record.quantity): record for record in history_records(document)}
    present = {(record.sensor, record.quantity): record for record in recomputed}
    for sensor, quantity in sorted(stated.keys() ^ present.keys()):
        yield f"{quantity} of {sensor}, which only one of them has"
    for key in sorted(stated.keys() & present.keys()):
        yield from _differences(stated[key], present[key])


def _differences(stated: HistoryRecord, recomputed: HistoryRecord) -> Iterator[str]:
    """Yield the properties and parameters in which the two records differ."""
    for name in ("part", "serial_number", "estimator"):
        if getattr(stated, name) != getattr(recomputed, name):
            yield f"{name} of {stated.sensor}: {getattr(recomputed, name)}, stated {getattr(stated, name)}"
    for name in ("full_scale", "temperature_c"):
        if not _close(getattr(stated, name), getattr(recomputed, name)):
            yield f"{name} of {stated.sensor}: {getattr(recomputed, name)}, stated {getattr(stated, name)}"
    ours, theirs = ({parameter.name: parameter for parameter in record.parameters} for record in (stated, recomputed))
    for name in sorted(ours.keys() ^ theirs.keys()):
        yield f"{name} of {stated.sensor}, which only one of them has"
    for name in sorted(ours.keys() & theirs.keys()):
        yield from (f"{text} of {stated.sensor}" for text in _parameter_differences(ours[name], theirs[name]))


def _parameter_differences(stated: Parameter, recomputed: Parameter) -> Iterator[str]:
    if not abs(stated.value - recomputed.value) <= STD_TOLERANCE * stated.std:
        yield f"{stated.name} {recomputed.value:.9g}, stated {stated.value:.9g},"
    for name in ("std_statistical", "std_combined", "max_deviation", "coverage_factor"):
        if not _close(getattr(stated, name), getattr(recomputed, name)):
            yield f"{name} {getattr(recomputed, name)} of {stated.name}, stated {getattr(stated, name)},"
    if stated.unit != recomputed.unit:
        yield f"unit of {stated.name}"


def _close(stated: float | None, other: float | None) -> bool:
    return stated == other if stated is None or other is None else math.isclose(stated, other, rel_tol=STD_TOLERANCE)

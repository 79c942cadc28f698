"""What the rows of a run repeat of its result: made of it when it is entered, and held against it ever after. Pure."""

import hashlib
import math
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime

from rig.data.result_file import ResultDocument
from rig.report.findings.followed import Followed, Parameter
from rig.report.kinds.registry import followed

SAME = 1e-6  # of the standard uncertainty: what a processor's rounding may change of a number


def run_row(document: ResultDocument) -> dict[str, str | bool]:
    """The columns of a run that its result says."""
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
    """Checksum of what was measured: arm, board, configuration, time of its beginning."""
    of = document.provenance
    said = (of.started_utc, of.arm_serial_number, of.board_unique_id, of.configuration_sha256)
    return hashlib.sha256("\n".join(said).encode()).hexdigest()


def fit(document: ResultDocument) -> bool:
    """Whether the measurement passed its own checks; a value beyond its limit is a result like any other."""
    return all(check.passed for check in document.checks if check.means.kind == "fitness")


def utc(text: str) -> str:
    """A time in one form, UTC, so that texts sort as times do."""
    return datetime.fromisoformat(text).astimezone(UTC).isoformat(timespec="seconds")


def unlike(document: ResultDocument, recomputed: Sequence[Followed]) -> Iterator[str]:
    """What in `recomputed` differs from the calibrations that a result states, beyond a processor's rounding."""
    stated = {(each.sensor, each.quantity): each for each in followed(document)}
    beside = {(each.sensor, each.quantity): each for each in recomputed}
    for sensor, quantity in sorted(stated.keys() ^ beside.keys()):
        yield f"{quantity} of {sensor}, which only one of them has"
    for key in sorted(stated.keys() & beside.keys()):
        yield from _differences(stated[key], beside[key])


def _differences(stated: Followed, recomputed: Followed) -> Iterator[str]:
    for name in ("part", "serial_number", "estimator"):
        if getattr(stated, name) != getattr(recomputed, name):
            yield f"{name} of {stated.sensor}: {getattr(recomputed, name)}, stated {getattr(stated, name)}"
    for name in ("full_scale", "temperature_c"):
        if not _close(getattr(stated, name), getattr(recomputed, name)):
            yield f"{name} of {stated.sensor}: {getattr(recomputed, name)}, stated {getattr(stated, name)}"
    ours, theirs = ({each.name: each for each in of.parameters} for of in (stated, recomputed))
    for name in sorted(ours.keys() ^ theirs.keys()):
        yield f"{name} of {stated.sensor}, which only one of them has"
    for name in sorted(ours.keys() & theirs.keys()):
        yield from (f"{each} of {stated.sensor}" for each in _otherwise(ours[name], theirs[name]))


def _otherwise(stated: Parameter, recomputed: Parameter) -> Iterator[str]:
    if not abs(stated.value - recomputed.value) <= SAME * stated.std:
        yield f"{stated.name} {recomputed.value:.9g}, stated {stated.value:.9g},"
    for name in ("std_statistical", "std_combined", "max_deviation", "coverage_factor"):
        if not _close(getattr(stated, name), getattr(recomputed, name)):
            yield f"{name} {getattr(recomputed, name)} of {stated.name}, stated {getattr(stated, name)},"
    if stated.unit != recomputed.unit:
        yield f"unit of {stated.name}"


def _close(stated: float | None, other: float | None) -> bool:
    return stated == other if stated is None or other is None else math.isclose(stated, other, rel_tol=SAME)

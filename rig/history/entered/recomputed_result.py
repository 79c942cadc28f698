"""Comparison of a result with one recomputed from its recordings: all numbers, checks and provenance. Pure."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from rig.config.judging.verdict_limits import Kind
from rig.data.installed_kinds import quantities
from rig.data.result_file import CheckEntry, ResultDocument
from rig.history.entered.index import STD_TOLERANCE, unlike
from rig.report.findings.history_records import BIASES, SCALES, HistoryRecord
from rig.report.kinds.kind_registry import history_records

ROUNDING_ERROR = 1e-15  # values that are zero except for rounding: no quantity of a result is as small
UNCOMPARED_FIELDS = ("iterations", "solved_utc")  # the same result may take other iterations, and has another time


def differing_parts(claimed: ResultDocument, recomputed: ResultDocument) -> list[str]:
    """Return the parts of a `claimed` result that differ from the recomputed one by more than processors' rounding.

    `recomputed` is solved from the recordings. Calibrations must agree within 1e-6 of their standard uncertainty, other
    numbers within 1e-6 of the largest number in their list. Texts, and fields that the claimed result lacks, are not
    compared, because they change from version to version.
    """
    origin = _origin(recomputed)
    rows = [f"provenance.{name}" for name, value in _origin(claimed).items() if value != origin.get(name)]
    rows += ["verdict"] if claimed.verdict != recomputed.verdict else []
    checks = {check.name: _check_values(check) for check in recomputed.checks}
    rows += [check.name for check in claimed.checks if checks.get(check.name) != _check_values(check)]
    numbers = _differences(_numbers_of(claimed), _numbers_of(recomputed), "")
    stated = {(record.sensor, record.quantity): record for record in history_records(claimed)}
    records = []
    for record in history_records(recomputed):
        key = record.sensor, record.quantity
        if record.quantity in quantities() or key in stated:
            records.append(_drop_later_parameters(record, stated.get(key)))
    return [*rows, *unlike(claimed, records), *numbers]


def _drop_later_parameters(recomputed: HistoryRecord, claimed: HistoryRecord | None) -> HistoryRecord:
    """Return `recomputed` without characteristics that `claimed` lacks, because later versions may add some."""
    if claimed is None:
        return recomputed
    names = {*SCALES, *BIASES, *(parameter.name for parameter in claimed.parameters)}
    return replace(
        recomputed, parameters=tuple(parameter for parameter in recomputed.parameters if parameter.name in names)
    )


def _check_values(check: CheckEntry) -> tuple[bool, str, Kind]:
    return check.passed, check.unit, check.means.kind


def _origin(document: ResultDocument) -> dict[str, object]:
    fields: dict[str, object] = json.loads(document.provenance.model_dump_json(exclude_unset=True))
    return {name: value for name, value in fields.items() if name not in UNCOMPARED_FIELDS}


def _numbers_of(document: ResultDocument) -> dict[str, object]:
    """Return the numbers of a result as JSON, with checks keyed by name, so that an added check shifts no others."""
    fields: dict[str, object] = json.loads(document.text())
    checks = {check.name: [check.value, check.limit, check.uncertainty] for check in document.checks}
    return {**{name: value for name, value in fields.items() if name != "provenance"}, "checks": checks}


def _differences(claimed: object, recomputed: object, where: str, scale: float = 0.0) -> Iterator[str]:
    """Yield the paths at which the claimed document differs from the recomputed one by more than rounding.

    `where` is the path of both documents in the whole result. `scale` is the largest number of the list that contains
    them, to which rounding is relative; 0 outside of lists.
    """
    if isinstance(claimed, Mapping) and isinstance(recomputed, Mapping):
        for name, item in claimed.items():
            if name not in recomputed:
                yield f"{where}{name}"
            elif name not in UNCOMPARED_FIELDS:
                yield from _differences(item, recomputed[name], f"{where}{name}.")
    elif isinstance(claimed, Sequence) and isinstance(recomputed, Sequence) and not isinstance(claimed, str):
        if len(claimed) != len(recomputed):
            yield where.rstrip(".")
            return
        largest = scale or _largest_number(recomputed)
        for number, (item, other) in enumerate(zip(claimed, recomputed, strict=True)):
            yield from _differences(item, other, f"{where}{number}.", largest)
    elif isinstance(claimed, float | int) and isinstance(recomputed, float | int):
        if abs(claimed - recomputed) > max(STD_TOLERANCE * max(scale, abs(recomputed)), ROUNDING_ERROR):
            yield f"{where.rstrip('.')} {claimed:.9g}, which is {recomputed:.9g}"
    elif type(claimed) is not type(recomputed):
        yield where.rstrip(".")


def _largest_number(numbers: object) -> float:
    """Return the largest absolute value in a list or a matrix."""
    if isinstance(numbers, float | int):
        return abs(numbers)
    if isinstance(numbers, Sequence) and not isinstance(numbers, str):
        return max(map(_largest_number, numbers), default=0.0)
    return 0.0

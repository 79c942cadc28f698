"""Whether a result says what its recordings give: all of its numbers, its checks and where it comes from. Pure."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from rig.config.judging.limits import Kind
from rig.data.installed_kinds import quantities
from rig.data.result_file import CheckEntry, ResultDocument
from rig.history.entered.index import SAME, unlike
from rig.report.findings.followed import BIASES, SCALES, Followed
from rig.report.kinds.registry import followed

ROUNDING = 1e-15  # of what is zero but for the last digits: no quantity of a result is so small
# What the same numbers may be reached with, and when.
AS_IT_COMES = ("iterations", "solved_utc")


def not_given(claimed: ResultDocument, given: ResultDocument) -> list[str]:
    """What of a `claimed` result its recordings do not give, beyond a processor's rounding; `given` is solved anew.

    Calibrations agree within 1e-6 of their standard uncertainty, other numbers within 1e-6 of the largest beside them.
    Words are not compared, and what the claim leaves out is not missed: both change from version to version.
    """
    origin = _origin(given)
    rows = [f"provenance.{name}" for name, said in _origin(claimed).items() if said != origin.get(name)]
    rows += ["verdict"] if claimed.verdict != given.verdict else []
    checks = {check.name: _said(check) for check in given.checks}
    rows += [check.name for check in claimed.checks if checks.get(check.name) != _said(check)]
    numbers = _differences(_numbers_of(claimed), _numbers_of(given), "")
    there = {(each.sensor, each.quantity): each for each in followed(claimed)}
    found = [_said_before(each, there.get((each.sensor, each.quantity))) for each in followed(given)]
    found = [each for each in found if each.quantity in quantities() or (each.sensor, each.quantity) in there]
    return [*rows, *unlike(claimed, found), *numbers]


def _said_before(given: Followed, claimed: Followed | None) -> Followed:
    """What is followed without the characteristics that a claim does not state: later versions know more of them."""
    if claimed is None:
        return given
    names = {*SCALES, *BIASES, *(each.name for each in claimed.parameters)}
    return replace(given, parameters=tuple(each for each in given.parameters if each.name in names))


def _said(check: CheckEntry) -> tuple[bool, str, Kind]:
    return check.passed, check.unit, check.means.kind


def _origin(document: ResultDocument) -> dict[str, object]:
    found: dict[str, object] = json.loads(document.provenance.model_dump_json(exclude_unset=True))
    return {name: each for name, each in found.items() if name not in AS_IT_COMES}


def _numbers_of(document: ResultDocument) -> dict[str, object]:
    """The numbers of a result as JSON, checks by their names: one that a later version adds moves no other."""
    found: dict[str, object] = json.loads(document.text())
    checks = {check.name: [check.value, check.limit, check.uncertainty] for check in document.checks}
    return {**{name: each for name, each in found.items() if name != "provenance"}, "checks": checks}


def _differences(claimed: object, given: object, where: str, scale: float = 0.0) -> Iterator[str]:
    if isinstance(claimed, Mapping) and isinstance(given, Mapping):
        for name, each in claimed.items():
            if name not in given:
                yield f"{where}{name}"
            elif name not in AS_IT_COMES:
                yield from _differences(each, given[name], f"{where}{name}.")
    elif isinstance(claimed, Sequence) and isinstance(given, Sequence) and not isinstance(claimed, str):
        if len(claimed) != len(given):
            yield where.rstrip(".")
            return
        largest = scale or _largest(given)
        for number, (each, other) in enumerate(zip(claimed, given, strict=True)):
            yield from _differences(each, other, f"{where}{number}.", largest)
    elif isinstance(claimed, float | int) and isinstance(given, float | int):
        if abs(claimed - given) > max(SAME * max(scale, abs(given)), ROUNDING):
            yield f"{where.rstrip('.')} {claimed:.9g}, which is {given:.9g}"
    elif type(claimed) is not type(given):
        yield where.rstrip(".")


def _largest(numbers: object) -> float:
    """The largest size of the numbers in a list or a matrix."""
    if isinstance(numbers, float | int):
        return abs(numbers)
    if isinstance(numbers, Sequence) and not isinstance(numbers, str):
        return max(map(_largest, numbers), default=0.0)
    return 0.0

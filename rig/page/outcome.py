"""The page's first screen after a run: what was found of each sensor, what it was before, what to do next. Pure."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rig.analysis.check import Check
from rig.data.installed_kinds import quantities
from rig.data.meaning import JUDGED_PARAMETERS, limit_held
from rig.data.result_file import ResultDocument
from rig.data.run_folder import CONFIG, resuming
from rig.page.about import About
from rig.report.findings.kind import Three
from rig.report.kinds.registry import shown
from rig.report.words.rounding import in_print
from rig.station.events import Since

Row = dict[str, Any]


def outcome_rows(result: ResultDocument, parts: Mapping[str, str]) -> list[Row]:
    """A row for each thing that was found: its numbers ± U as the certificate prints them, and how far they may be off.

    `parts` are the sensors' parts and serial numbers.
    """
    rows = []
    for found in shown(result):
        scale, bias = (limit_held(result.checks, found.sensor, found.quantity.name, of) for of in JUDGED_PARAMETERS)
        if found.scale is None:  # limits are those of a calibration
            bias = None
        rows.append(
            {
                "name": found.name,
                "part": parts.get(found.sensor, ""),
                "labels": list(found.labels),
                "unit": found.unit.name,
                "scale": None if found.scale is None else _numbers(found.scale, 1.0, scale),
                "bias": _numbers(found.numbers, 0.0, None if bias is None else bias / found.unit.size),
            }
        )
    return rows


def since_rows(since: Iterable[Since]) -> dict[str, Row]:
    """What was found the time before, by the name of the row beside which it stands, in the units of that row."""
    rows = {}
    for each in since:
        quantity = quantities().get(each.quantity)
        if quantity is None:  # of what is no sensor's scale and bias a history keeps more than a row has room for
            continue
        worst = max(each.normalised_error.items(), key=lambda pair: pair[1], default=("", 0.0))
        row: Row = {"number": each.number, "day": each.day, "worst": [worst[0], round(worst[1], 2)]}
        for of, letter, size in (("scale", "k", 1.0), ("bias", "b", quantity.bias.size)):
            names = [letter + axis for axis in quantity.axes]
            if all(name in each.before for name in names):
                row[of] = {
                    "values": [each.before[name][0] / size for name in names],
                    "expanded": [each.before[name][1] / size for name in names],
                    "normalised_error": [round(each.normalised_error[name], 2) for name in names],
                    "changed": [name in each.changed for name in names],
                }
        row["changed"] = list(each.changed)
        rows[quantity.label(each.sensor)] = row
    return rows


def after_verdict(about: About, checks: Sequence[Check], *, passed: bool, stored: bool) -> Row:
    """What to do after a verdict, in words and as a command."""
    folder = shlex.quote(about.folder)
    if passed and about.storing and not stored:
        return _next("Store the calibration on the board", about.storing)
    if passed:
        serial = next((part.partition(" ")[2] for part in about.parts.values()), "")
        return _next("What became of it over time", f"rig history {shlex.quote(serial)}" if serial else "rig history")
    failed = [check for check in checks if not check.passed]
    sweeps = sorted({check.means.sweep for check in failed if check.means.sweep is not None})
    if sweeps:
        which = "sweep " + ", ".join(map(str, sweeps))
        return _next(f"Look who touched arm or cable in {which}, and repeat that alone", resuming(Path(about.folder)))
    if all(check.means.kind == "conformity" for check in failed):
        return _next("The measurement is sound and the part beyond its limits. All of it", f"rig show {folder} --all")
    config = shlex.quote(str(Path(about.folder) / CONFIG))
    return _next(f"Look for the cause (rig show {folder} --checks), then measure again", f"rig run {config}")


def after_fault(command: str, *, repeats: bool) -> Row:
    """What to do after a fault, in words and as a command."""
    return _next("Repeat the refused sweeps" if repeats else "When it is corrected, go on", command)


def _next(words: str, command: str) -> Row:
    return {"words": words, "command": command}


def _numbers(three: Three, nominal: float, limit: float | None) -> Row:
    texts = [in_print(value, u) for value, u in zip(three.values, three.expanded, strict=True)]
    return {
        "values": [float(value) for value in three.values],
        "expanded": [float(u) for u in three.expanded],
        "texts": [value for value, _ in texts],
        "u": [u for _, u in texts],
        "nominal": nominal,
        "limit": limit,
    }

"""The page's first screen after a run: each sensor's result, its previous one, the next step. Pure."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rig.analysis.check import Check
from rig.data.installed_kinds import quantities
from rig.data.meaning import JUDGED_PARAMETERS, find_conformity_limit
from rig.data.result_file import ResultDocument
from rig.data.run_folder import CONFIG, resuming
from rig.page.about import About
from rig.report.findings.result_kind import AxisValues
from rig.report.kinds.kind_registry import shown
from rig.report.simulated_truth import TruthRow
from rig.report.words.printed_values import format_with_u
from rig.station.events import LastCalibration

Row = dict[str, Any]


def outcome_rows(result: ResultDocument, parts: Mapping[str, str], true_rows: Sequence[TruthRow] = ()) -> list[Row]:
    """Return a row for each result: its numbers ± U as on the certificate, and its limits.

    `parts`: the sensors' parts and serial numbers; `true_rows`: the true values of a simulated laboratory.
    """
    rows = []
    true_by_name = {true.row.name: true for true in true_rows}
    for row in shown(result):
        names = row.sensor, row.quantity.name
        scale, bias = (find_conformity_limit(result.checks, *names, parameter) for parameter in JUDGED_PARAMETERS)
        if row.scale is None:  # only calibrations have limits
            bias = None
        rows.append(
            {
                "name": row.name,
                "part": parts.get(row.sensor, ""),
                "labels": list(row.labels),
                "unit": row.unit.name,
                "model": f"{row.quantity.sensor}: {row.model.partition(',')[0]}" if row.model else "",
                "scale": None if row.scale is None else _numbers(row.scale, 1.0, scale),
                "bias": _numbers(row.numbers, 0.0, None if bias is None else bias / row.unit.size),
                "truth": _truth(true_by_name.get(row.name)),
            }
        )
    return rows


def since_rows(since: Iterable[LastCalibration]) -> dict[str, Row]:
    """Return the previous results, by the names of the displayed rows and in their units."""
    rows = {}
    for since_result in since:
        quantity = quantities().get(since_result.quantity)
        if quantity is None:  # other kinds of results have more values than a row has room for
            continue
        worst = max(since_result.normalised_error.items(), key=lambda pair: pair[1], default=("", 0.0))
        row: Row = {"number": since_result.number, "day": since_result.day, "worst": [worst[0], round(worst[1], 2)]}
        for parameter, letter, size in (("scale", "k", 1.0), ("bias", "b", quantity.bias.size)):
            names = [letter + axis for axis in quantity.axes]
            if all(name in since_result.before for name in names):
                row[parameter] = {
                    "values": [since_result.before[name][0] / size for name in names],
                    "expanded": [since_result.before[name][1] / size for name in names],
                    "normalised_error": [round(since_result.normalised_error[name], 2) for name in names],
                    "changed": [name in since_result.changed for name in names],
                }
        row["changed"] = list(since_result.changed)
        rows[quantity.label(since_result.sensor)] = row
    return rows


def after_verdict(about: About, checks: Sequence[Check], *, passed: bool, stored: bool) -> Row:
    """Return the next step after a verdict, in words and as a command."""
    folder = shlex.quote(about.folder)
    if passed and about.storing and not stored:
        return _next("Store the calibration on the board", about.storing)
    if passed:
        serial = next((part.partition(" ")[2] for part in about.parts.values()), "")
        return _next("Trend", f"rig history {shlex.quote(serial)}" if serial else "rig history")
    failed = [check for check in checks if not check.passed]
    sweeps = sorted({check.means.sweep for check in failed if check.means.sweep is not None})
    if sweeps:
        which = "sweep " + ", ".join(map(str, sweeps))
        return _next(f"Check who touched arm or cable in {which}, and repeat it alone", resuming(Path(about.folder)))
    if all(check.means.kind == "conformity" for check in failed):
        return _next("The measurement is valid, but the part is beyond its limits. Details", f"rig show {folder} --all")
    config = shlex.quote(str(Path(about.folder) / CONFIG))
    return _next(f"Find the cause (rig show {folder} --checks), then measure again", f"rig run {config}")


def after_fault(command: str, *, repeats: bool) -> Row:
    """Return the next step after a fault: words, and the `command`, which `repeats` refused sweeps or not."""
    return _next("Repeat the refused sweeps" if repeats else "After correcting it, continue", command)


def _truth(true: TruthRow | None) -> Row | None:
    """Return the printed true values, and (result − truth)/U; None if the truth is not known."""
    if true is None:
        return None
    return {
        name: {"texts": values.truth_texts, "deviations": values.deviations}
        for name, values in (("scale", true.scale), ("bias", true.bias))
        if values is not None
    }


def _next(words: str, command: str) -> Row:
    return {"words": words, "command": command}


def _numbers(three: AxisValues, nominal: float, limit: float | None) -> Row:
    texts = [format_with_u(value, u) for value, u in zip(three.values, three.expanded, strict=True)]
    return {
        "values": [float(value) for value in three.values],
        "expanded": [float(u) for u in three.expanded],
        "texts": [value for value, _ in texts],
        "u": [u for _, u in texts],
        "nominal": nominal,
        "limit": limit,
    }

"""The shortest run in words: its duration, uncertainties and their main contributors, and the limits of all runs."""

import json
from collections.abc import Iterator
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from rig.analysis.design.candidate_search import (
    TARGET_NAMES,
    Budgets,
    PlannedCandidate,
    ReachedUncertainty,
    ShortestRun,
    TargetUncertainty,
)
from rig.config.models import ProcedureSection
from rig.config.procedures.attitude_sets import ATTITUDE_SETS
from rig.config.procedures.procedure_sections import AttitudesSection
from rig.estimation.design.optimality import c_efficiency, g_efficiency, list_designs
from rig.station.plain_text import build_number_table, plain

if TYPE_CHECKING:
    from rig.estimation.arrays import Array

LISTED_CONTRIBUTORS = 3  # for each sensor
# Possible targets by their names in `TARGET_NAMES`: unit and words.
TARGETS = {
    "scale": ("", "the scale factors"),
    "bias_rad_s": (" rad/s", "the biases"),
    "acceleration_scale": ("", "the accelerometers' scale factors"),
    "acceleration_bias_m_s2": (" m/s²", "the accelerometers' biases"),
}
MIN_LISTED_FRACTION = 0.05  # of the variance of a contributor that is listed
MAX_LISTED_SPEEDS = 8
ASSUMPTIONS = (
    "Predicted for parts as in their data sheets, at one temperature, with flicker noise as the only bias drift, "
    "and a mounting error of 5° (in stages uncertainty.mount_deg). A sensor that is mounted more exactly does "
    "better; one that warms up does worse."
)


def list_key_changes(before: ProcedureSection, after: ProcedureSection) -> dict[str, Any]:
    """Return the changed keys of the procedure with new values; a standard set of attitudes is given by its name."""
    old, new = _values(before), _values(after)
    return {key: value for key, value in new.items() if old.get(key) != value}


def _values(section: ProcedureSection) -> dict[str, Any]:
    values = section.model_dump(mode="json")
    if isinstance(section, AttitudesSection):
        names = {attitudes: name for name, attitudes in ATTITUDE_SETS.items()}
        values["attitudes"] = names.get(section.attitudes, values["attitudes"])
    return values


def print_shortest(shortest: ShortestRun, section: ProcedureSection, *, as_json: bool) -> None:
    """Print the shortest run on stdout: tables for people, JSON in SI units for machines."""
    if as_json:
        print(json.dumps(shortest_document(shortest, section), indent=2, allow_nan=False))
        return
    console = Console(highlight=False)
    console.print(plain(_verdict(shortest)))
    shown = shortest.best or shortest.nearest
    if shown is not None:
        console.print(_tabulate_plans(shortest, shown, section))
        console.print(_limits("Main contributors, as fractions of the variance:", shown.budgets))
    console.print(plain(_describe_floor(shortest)))
    if shortest.directions is not None:
        console.print(_optimality(shortest.directions))
    console.print(plain(f"{shortest.tried} of {shortest.candidates_count} plans were compared. {ASSUMPTIONS}"))


def shortest_document(shortest: ShortestRun, section: ProcedureSection) -> dict[str, Any]:
    """Return the shortest run as JSON values; a missing plan or target is null."""
    shown = shortest.best or shortest.nearest
    return {
        "schema": "rig.shortest/1",
        "target_uncertainty": {
            **{size: _finite(getattr(shortest.wanted, size)) for size in TARGET_NAMES},
            "max_duration_s": _finite(shortest.wanted.at_most_s),
        },
        "reached": shortest.best is not None,
        "cannot_be_had": shortest.unreachable,
        "plan": None if shown is None else _plan_entry(shown, section),
        "before": None if shortest.before is None else _plan_entry(shortest.before, section),
        "at_any_length": _sizes_entry(shortest.at_any_length),
        "optimality": None if shortest.directions is None else _efficiencies(shortest.directions),
        "tried": shortest.tried,
        "among": shortest.candidates_count,
    }


def _plan_entry(planned: PlannedCandidate, section: ProcedureSection) -> dict[str, Any]:
    return {
        "duration_s": planned.candidate.duration_s,
        **_sizes_entry(planned.reached),
        "changed": list_key_changes(section, planned.candidate.procedure),
        "limits": {
            name: [{"contributor": line, "scale_share": scale, "bias_share": bias} for line, scale, bias in lines]
            for name, lines in _main_contributors(planned.budgets).items()
        },
    }


def _sizes_entry(reached: ReachedUncertainty) -> dict[str, float | None]:
    """Return the reached uncertainties by name; None for sensors that are not calibrated."""
    return {size: getattr(reached, size) or None for size in TARGET_NAMES}


def _verdict(shortest: ShortestRun) -> str:
    wish = wish_words(shortest.wanted)
    within = "" if shortest.wanted.at_most_s == inf else f" within {shortest.wanted.at_most_s:g} s"
    if shortest.best is not None:
        return f"The shortest run for {wish} takes {shortest.best.candidate.duration_s:.1f} s."
    if shortest.unreachable:
        return f"No run of this kind reaches {wish}, of any duration."
    return f"No examined plan reaches {wish}{within}; this one is nearest."


def wish_words(wanted: TargetUncertainty) -> str:
    """Return the target as `U ≤ 0.0005 of the scale factors`."""
    sizes = {size: getattr(wanted, size) for size in TARGET_NAMES}
    return " and ".join(
        f"U ≤ {value:.3g}{TARGETS[size][0]} of {TARGETS[size][1]}" for size, value in sizes.items() if value < inf
    )


def _tabulate_plans(shortest: ShortestRun, shown: PlannedCandidate, section: ProcedureSection) -> Table:
    """Return a table that compares the shortest plan with the file's plan."""
    headings = ("", "as in the file", "shortest" if shortest.best else "nearest")
    table = build_number_table(headings, texts=("",), box=SIMPLE)
    before = shortest.before
    old = _values(section)
    for key, value in list_key_changes(section, shown.candidate.procedure).items():
        table.add_row(f"procedure.{key}", plain(_shown(old.get(key))), plain(_shown(value)))
    for size, (unit, what) in TARGETS.items():
        if getattr(shown.reached, size) > 0:
            own_value = "–" if before is None else f"{getattr(before.reached, size):.3g}"
            name = f"U of {what}" + unit.replace(" ", ", ")
            table.add_row(name, own_value, f"{getattr(shown.reached, size):.3g}")
    own_value = "–" if before is None else f"{before.candidate.duration_s:.1f}"
    table.add_row("duration, s", own_value, f"{shown.candidate.duration_s:.1f}")
    return table


def _shown(value: object) -> str:
    if isinstance(value, list) and len(value) > MAX_LISTED_SPEEDS:
        return f"{len(value)} attitudes"
    return "–" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _limits(title: str, budgets: Budgets) -> Table:
    headings = ("sensor", "contributor", "of the scale factors", "of the biases")
    table = build_number_table(headings, title, texts=headings[:2], box=SIMPLE)
    for name, lines in _main_contributors(budgets).items():
        for contributor, scale, bias in lines:
            table.add_row(plain(name), contributor, f"{100 * scale:.0f} %", f"{100 * bias:.0f} %")
    return table


def _main_contributors(budgets: Budgets) -> dict[str, list[tuple[str, float, float]]]:
    """Return each sensor's main contributors, with fractions of the variances of its worst scale factor and bias."""
    lines_by_sensor = {}
    kinds = {**budgets.rates, **{f"{name}, acceleration": budget for name, budget in budgets.accelerations.items()}}
    for name, budget in kinds.items():
        scale, bias = int(np.argmax(budget.std[:3])), 3 + int(np.argmax(budget.std[3:]))
        lines = [
            (part.name, _fraction(part.std[scale], budget.std[scale]), _fraction(part.std[bias], budget.std[bias]))
            for part in budget.contributors
        ]
        largest = sorted(lines, key=lambda line: -max(line[1:]))[:LISTED_CONTRIBUTORS]
        lines_by_sensor[name] = [line for line in largest if max(line[1:]) >= MIN_LISTED_FRACTION]
    return lines_by_sensor


def _fraction(part: float, whole: float) -> float:
    return float((part / whole) ** 2) if whole > 0 else 0.0


def _describe_floor(shortest: ShortestRun) -> str:
    """Return a sentence on the smallest uncertainties that this kind of run can reach, with their contributors."""
    parts = []
    for index, (size, (unit, what)) in enumerate(TARGETS.items()):
        least = shortest.least(size)
        of_kind = Budgets(least.rates) if index < len(TARGET_NAMES) // 2 else Budgets({}, least.accelerations)
        by_sensor = [lines for lines in _main_contributors(of_kind).values() if lines]
        largest = sorted({max(lines, key=lambda line: line[1 + index % 2])[0] for lines in by_sensor})
        value = getattr(least.reached, size)
        if value > 0:
            parts.append(f"U = {value:.2g}{unit} of {what} ({', '.join(largest)})")
    return f"However long it lasts, no run of this kind achieves less than {' and '.join(parts)}."


def _efficiencies(directions: "Array") -> dict[str, dict[str, float]]:
    """Return efficiencies by criterion: "plan" has those of `directions`, "six" those of the six in the paper SIX."""
    return {
        name: dict(_design_efficiencies(axes)) for name, axes in (("plan", directions), ("six", list_designs()["six"]))
    }


def _design_efficiencies(directions: "Array") -> Iterator[tuple[str, float]]:
    yield "g", g_efficiency(directions, "vector")
    yield "g_squared", g_efficiency(directions, "squared")
    yield "c_scale", c_efficiency(directions, "scale")
    yield "c_bias", c_efficiency(directions, "bias")


def _optimality(directions: "Array") -> Table:
    names = {"g": "G", "g_squared": "G, speeds alone", "c_scale": "c, scale", "c_bias": "c, bias"}
    title = "Efficiency of the directions of the sweeps (1: the optimum):"
    table = build_number_table(("", *names.values()), title, texts=("",), box=SIMPLE)
    words = {"plan": "this plan", "six": "the paper's six"}
    for name, values in _efficiencies(directions).items():
        table.add_row(words[name], *(f"{values[key]:.2f}" for key in names))
    return table


def _finite(value: float) -> float | None:
    return value if value < inf else None

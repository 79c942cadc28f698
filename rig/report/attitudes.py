"""Calibrations from readings in known attitudes, for people and for machines."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from rig.analysis.attitudes import InAttitudes, Result, Surrounding, in_unit
from rig.analysis.increments import InIncrements
from rig.data.budget_entries import BudgetEntry
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.errors import Fault
from rig.estimation import accelerometer, magnetometer
from rig.estimation.known_increments import KnownIncrements
from rig.estimation.triaxial import TriaxialSolution
from rig.observation.timebase import TimeBase
from rig.report.axes import matrix_lines, scale_and_bias_table
from rig.report.budget_entry import budget_entry
from rig.report.budget_table import budget_table, expanded_heading
from rig.report.increments import increment_entry, increment_lines
from rig.station.plain_text import plain

SCHEMA = "rig.attitudes/1"
MODELS: Mapping[Quantity, str] = {
    RATE: "ω_m = F (Rᵀ ω_E + ω) + b",
    ACCELERATION: accelerometer.MODEL,
    FIELD: magnetometer.MODEL,
}
REFERENCES: Mapping[Quantity, str] = {
    RATE: "Earth's rate",
    ACCELERATION: "specific force at rest",
    FIELD: "magnetic field",
}


@dataclass(frozen=True, slots=True)
class Found:
    """What two CSV files gave; `clock`, where the samples' had to be found on the attitudes'."""

    samples: Path
    attitudes: Path
    surrounding: Surrounding
    results: Mapping[Quantity, Result | Fault]
    clock: TimeBase | None = None


def print_found(found: Found, *, as_json: bool) -> None:
    """The solutions on stdout: tables for people, JSON of schema "rig.attitudes/1" for machines."""
    if as_json:
        print(json.dumps(_document(found), indent=2, allow_nan=False))
        return
    console = Console(highlight=False)
    if found.clock is not None:
        console.print(plain(_clock_line(found.clock)))
    for quantity, result in found.results.items():
        if isinstance(result, Fault):
            console.print(plain(f"{quantity}: {result}"))
            continue
        budget = budget_entry(result.budget)
        console.print(_table(f"{found.samples}: {quantity}, {MODELS[quantity]}", quantity, result.solution, budget))
        console.print(budget_table(budget, in_unit(result.solution)[0].tolist(), quantity.bias))
        for line in _lines(quantity, result, found.surrounding):
            console.print(plain(line))


def _clock_line(clock: TimeBase) -> str:
    return (
        f"the samples' clock on the table's: {clock.offset_s:+.4f} s (± {2e3 * clock.offset_std_s:.2g} ms), "
        f"{1e6 * clock.drift:+.1f} ppm (± {2e6 * clock.drift_std:.2g}) at {clock.reference_s:.1f} s of theirs"
    )


def _clock_entry(clock: TimeBase) -> dict[str, float]:
    return {
        "offset_s": clock.offset_s,
        "offset_std_s": clock.offset_std_s,
        "drift": clock.drift,
        "drift_std": clock.drift_std,
        "reference_s": clock.reference_s,
    }


def _table(title: str, quantity: Quantity, solution: TriaxialSolution | KnownIncrements, budget: BudgetEntry) -> Table:
    """The scale factor and the bias of each axis, ± U."""
    scale, bias = in_unit(solution)[0].tolist(), solution.bias.tolist()
    return scale_and_bias_table(title, quantity, scale, bias, budget.expanded, heading=expanded_heading(budget))


def _lines(quantity: Quantity, result: Result, surrounding: Surrounding) -> Iterator[str]:
    factor = float(result.budget.coverage_factors[:3].max())
    yield from matrix_lines(result.solution.matrix, result.solution.covariance[:9, :9], factor)
    if isinstance(result, InIncrements):
        yield from increment_lines(result)
        return
    solution, unit = result.solution, quantity.unit
    if result.reference_fault is None:
        reference = " ".join(f"{each:+.6g}" for each in solution.reference)
        yield f"{REFERENCES[quantity]} in table coordinates: {reference} {unit}"
    else:
        yield f"{REFERENCES[quantity]}: {result.reference_fault}"
    if quantity == ACCELERATION:
        yield f"gravity {surrounding.gravity_m_s2:g} m/s², to which the scale factors are relative"
    if solution.second_order is not None:
        std = np.sqrt(np.diag(solution.covariance)[15:18])
        terms = "  ".join(
            f"{value:+.3e} ± {2 * each:.1e}" for value, each in zip(solution.second_order, std, strict=True)
        )
        yield f"second order: {terms} 1/({unit})"
    if solution.attitude_error is not None:
        error = solution.attitude_error
        off, known = 1e3 * error.std_rad, 2e3 * error.uncertainty_rad
        yield f"attitude error found: {off:.3f} ± {known:.3f} mrad about each axis"
    yield from _of_placements(result, unit)
    rms = float(np.sqrt(np.mean(solution.residuals**2)))
    judged = f"condition {solution.condition:.1f}, residuals {rms:.2g} {unit}"
    yield f"{solution.method}: {solution.observations} attitudes, {judged}"
    yield from (f"warning: {warning}" for warning in solution.warnings)
    for method, other in result.beside.items():
        if isinstance(other, Fault):
            yield f"{method}: {other}"
        else:
            scale, bias = (" ".join(f"{each:.6g}" for each in values) for values in (in_unit(other)[0], other.bias))
            yield f"{method}: scale {scale}, bias {bias} {unit}"


def _of_placements(result: InAttitudes, unit: str) -> Iterator[str]:
    """What laying it down again does, and which rows and rests counted."""
    laid = result.laid
    if laid is not None:
        told = f"{laid.placement_std:.2g} ± {2 * laid.placement_uncertainty:.2g} {unit}"
        elsewhere = f", {result.elsewhere} rests beside the rows have told of it" if result.elsewhere else ""
        yield f"a placement found to change each reading by {told} beside its attitude{elsewhere}"
        if laid.placement_uncertainty > laid.placement_std / 2:
            yield "which is hardly told: lay it down in the same attitudes again, and the uncertainty becomes smaller"
    if result.moving:
        yield f"left out: not_at_rest: {result.moving} rows in which the body moves"


def _document(found: Found) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "samples": str(found.samples),
        "attitudes": str(found.attitudes),
        "gravity_m_s2": found.surrounding.gravity_m_s2,
        "field_t": found.surrounding.field_t,
        **({} if found.clock is None else {"clock": _clock_entry(found.clock)}),
        "quantities": {
            quantity.name: {"error": str(result)} if isinstance(result, Fault) else _entry(quantity, result)
            for quantity, result in found.results.items()
        },
    }


def _entry(quantity: Quantity, result: Result) -> dict[str, Any]:
    order = [
        *(f"f{i}{j}" for i in "xyz" for j in "xyz"),
        *(f"reference_{axis}" for axis in "xyz"),
        *(f"bias_{axis}" for axis in "xyz"),
    ]
    model = {"model": MODELS[quantity], "unit": quantity.unit, "covariance_order": order}
    if isinstance(result, InIncrements):
        return {
            **model,
            **_parameters(result.solution),
            **increment_entry(result),
            "budget": _budget(result),
            "beside": {},
        }
    if result.solution.second_order is not None:
        order += [f"phi_{axis}" for axis in "xyz"]
    fault = result.reference_fault
    return {
        **model,
        **_solution(result.solution),
        "budget": _budget(result),
        "placement_std": None if result.laid is None else result.laid.placement_std,
        "rows_left_out": result.moving,
        **({} if fault is None else {"reference_table": None, "reference_error": str(fault)}),
        "beside": {
            method: {"error": str(other)} if isinstance(other, Fault) else _solution(other)
            for method, other in result.beside.items()
        },
    }


def _budget(result: Result) -> dict[str, Any]:
    return budget_entry(result.budget).model_dump()


def _parameters(solution: TriaxialSolution | KnownIncrements) -> dict[str, Any]:
    return {
        "matrix": solution.matrix.tolist(),
        "scale": in_unit(solution)[0].tolist(),
        "bias": solution.bias.tolist(),
        "covariance": solution.covariance.tolist(),
    }


def _solution(solution: TriaxialSolution) -> dict[str, Any]:
    error = solution.attitude_error
    return {
        "estimator": solution.method,
        **_parameters(solution),
        "reference_table": solution.reference.tolist(),
        "second_order": None if solution.second_order is None else solution.second_order.tolist(),
        "attitude_error_rad": None if error is None else error.std_rad,
        "attitude_error_std_rad": None
        if error is None or not np.isfinite(error.uncertainty_rad)
        else error.uncertainty_rad,
        "observations_used": solution.observations,
        "rank": solution.rank,
        "condition": solution.condition,
        "residual_rms": float(np.sqrt(np.mean(solution.residuals**2))),
        "warnings": list(solution.warnings),
    }

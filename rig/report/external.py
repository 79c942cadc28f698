"""A calibration from data recorded elsewhere, for people and for machines."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from rig.analysis.external import budget_of
from rig.data.budget_entries import expanded_uncertainties
from rig.data.quantity import RATE
from rig.data.result_file import EstimateEntry, VectorEntry
from rig.data.result_types import ErrorEntry
from rig.estimation.budget import Budget
from rig.estimation.estimate import Estimate
from rig.estimation.known_turns import TurnedSolution
from rig.estimation.six_observation import MODEL, PARAMETERS
from rig.estimation.vector_model import VectorSolution
from rig.observation.csv_import import ExternalData
from rig.report.axes import matrix_lines, scale_and_bias_table
from rig.report.budget_entry import budget_entry
from rig.report.budget_table import budget_table, expanded_heading
from rig.report.sensor_entry import estimate_entry, vector_entry
from rig.station.plain_text import plain


@dataclass(frozen=True, slots=True)
class External:
    """The chosen estimator's solution of two CSV files, and the six-observation solution of the same sweeps."""

    samples: Path
    sweeps: Path
    data: ExternalData
    solution: Estimate
    six_observation: EstimateEntry | ErrorEntry

    @property
    def budget(self) -> Budget:
        """What its uncertainty is made of."""
        return budget_of(self.solution, self.data)

    @property
    def vector(self) -> VectorEntry | None:
        """The solution with its matrix, of an estimator that finds one."""
        solution = self.solution
        return vector_entry(solution) if isinstance(solution, VectorSolution | TurnedSolution) else None

    @property
    def ways(self) -> list[str]:
        """How each sweep was solved, in the order of the rows."""
        turned = self.data.turned
        by_angle = turned.rows if turned is not None and isinstance(self.solution, TurnedSolution) else ()
        return ["increment" if sweep.sweep in by_angle else "mean" for sweep in self.data.sweeps]


def print_external(external: External, *, as_json: bool) -> None:
    """The solution on stdout: tables for people, JSON of schema "rig.external/1" for machines."""
    if as_json:
        print(json.dumps(_document(external), indent=2))
    else:
        _print(external, Console(highlight=False))


def _document(external: External) -> dict[str, object]:
    return {
        "schema": "rig.external/1",
        "samples": str(external.samples),
        "sweeps": str(external.sweeps),
        "model": MODEL,
        **estimate_entry(external.solution).model_dump(),
        "covariance_order": list(PARAMETERS),
        "covariance_units": list(RATE.parameter_units),
        "rests": len(external.data.rests),
        "ways": external.ways,
        "budget": budget_entry(external.budget).model_dump(),
        "vector_model": None if external.vector is None else external.vector.model_dump(),
        "six_observation": external.six_observation.model_dump(),
    }


def _print(external: External, console: Console) -> None:
    estimate, vector, beside = estimate_entry(external.solution), external.vector, external.six_observation
    budget = budget_entry(external.budget)
    title = f"{external.samples}, {MODEL}, {estimate.estimator}"
    console.print(_table(title, estimate, budget.expanded, heading=expanded_heading(budget)))
    console.print(budget_table(budget, estimate.scale, RATE.bias))
    if vector is not None:
        covariance = np.array(vector.matrix_covariance)[:9, :9]
        for line in matrix_lines(np.array(vector.matrix), covariance, max(budget.factors[:3])):
            console.print(plain(line))
        for line in _how(external):
            console.print(plain(line))
    if isinstance(beside, ErrorEntry):
        console.print(plain(f"six_observation: {beside.error}"))
    elif beside.estimator != estimate.estimator:
        title = "six observations alone, the rests and the axes left out"
        widths = expanded_uncertainties(None, beside.covariance)
        console.print(_table(title, beside, widths, expanded_heading(None)))


def _table(title: str, estimate: EstimateEntry, expanded: Sequence[float], heading: str) -> Table:
    return scale_and_bias_table(title, RATE, estimate.scale, estimate.bias_rad_s, expanded, heading=heading)


def _how(external: External) -> Iterator[str]:
    """How the rows were read, and what was taken as known of them."""
    solution, data = external.solution, external.data
    if not isinstance(solution, TurnedSolution) or data.turned is None:
        yield "The axes of the sweeps are taken as given: an error of theirs is an error of F across its rows."
        return
    turns = data.turned.turns
    ends, axes = (max(std) for std in zip(*((turn.angle_std_rad, turn.axis_std_rad) for turn in turns), strict=True))
    rows = ", ".join(map(str, data.turned.rows))
    yield f"by the angle turned from rest to rest: {len(turns)} of {len(data.sweeps)} sweeps (rows {rows})"
    yield (
        f"a turn ends within {1e3 * ends:.1f} mrad of what is said of it, its axis leans by {1e3 * axes:.0f} mrad (one "
        "standard deviation: angle_std_rad, axis_std_rad)"
    )
    if solution.widened > 1:
        yield f"the turns contradict each other by more, and count as {solution.widened:.2g} times as uncertain"

"""A calibration from data recorded elsewhere, for people and for machines."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from rig.data.result_file import EstimateEntry, VectorEntry
from rig.data.result_types import ErrorEntry
from rig.estimation.six_observation import MODEL, PARAMETER_UNITS, PARAMETERS
from rig.report.axes import matrix_lines
from rig.report.table import estimate_table
from rig.station.plain_text import plain


@dataclass(frozen=True, slots=True)
class External:
    """The chosen estimator's solution of two CSV files, and the six-observation solution of the same sweeps.

    `vector` is the same solution with its matrix, where the estimator is the vector model.
    """

    samples: Path
    sweeps: Path
    rests: int
    estimate: EstimateEntry
    vector: VectorEntry | None
    six_observation: EstimateEntry | ErrorEntry


def print_external(found: External, *, as_json: bool) -> None:
    """The solution on stdout: tables for people, JSON of schema "rig.external/1" for machines."""
    if as_json:
        print(json.dumps(_document(found), indent=2))
    else:
        _print(found, Console(highlight=False))


def _document(found: External) -> dict[str, object]:
    return {
        "schema": "rig.external/1",
        "samples": str(found.samples),
        "sweeps": str(found.sweeps),
        "model": MODEL,
        **found.estimate.model_dump(),
        "covariance_order": list(PARAMETERS),
        "covariance_units": list(PARAMETER_UNITS),
        "rests": found.rests,
        "vector_model": None if found.vector is None else found.vector.model_dump(),
        "six_observation": found.six_observation.model_dump(),
    }


def _print(found: External, console: Console) -> None:
    estimate, vector, beside = found.estimate, found.vector, found.six_observation
    console.print(estimate_table(f"{found.samples}, {MODEL}, {estimate.estimator}", estimate))
    if vector is not None:
        covariance = np.array(vector.matrix_covariance)[:9, :9]
        for line in matrix_lines(np.array(vector.matrix), covariance):
            console.print(plain(line))
        console.print("The axes of the sweeps are taken as given: an error of theirs is an error of F across its rows.")
    if isinstance(beside, ErrorEntry):
        console.print(plain(f"six_observation: {beside.error}"))
    elif beside.estimator != estimate.estimator:
        console.print(estimate_table("six observations alone, the rests and the axes left out", beside))

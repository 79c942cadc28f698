"""`rig solve SAMPLES.csv --sweeps SWEEPS.csv`: the calibration from data recorded elsewhere, without a verdict.

There is no configuration, so there are no limits to judge it by.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from rig.estimation.six_observation import MODEL, PARAMETER_UNITS, PARAMETERS
from rig.external import read
from rig.solution import known_estimator, solve_observations


def solve_external(samples: Path, sweeps: Path, estimator: str, *, as_json: bool) -> int:
    """Solve two CSV files (see `rig.external`) and print the result; 0.

    Raises Refused `unknown_estimator` and as `external.read` does; Fault as the estimator does.
    """
    chosen = known_estimator(estimator)
    data = read(samples, sweeps)
    solution = solve_observations(data.sweeps, chosen, data.rests)
    document = {
        "schema": "rig.external/1",
        "samples": str(samples),
        "sweeps": str(sweeps),
        "model": MODEL,
        "estimator": solution.estimator,
        "scale": solution.scale.tolist(),
        "bias_rad_s": solution.bias_rad_s.tolist(),
        "covariance": solution.covariance.tolist(),
        "covariance_order": list(PARAMETERS),
        "covariance_units": list(PARAMETER_UNITS),
        "rank": solution.rank,
        "condition": solution.condition,
        "iterations": solution.iterations,
        "observations_used": solution.observations,
        "rests": len(data.rests),
    }
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        _print(document)
    return 0


def _print(document: dict[str, Any]) -> None:
    table = Table(title=f"{document['samples']}, {document['model']}, {document['estimator']}", title_justify="left")
    for heading in ("axis", "scale factor", "± 1σ", "bias rad/s", "± 1σ rad/s"):
        table.add_column(heading, justify="left" if heading == "axis" else "right")
    std = np.sqrt(np.diag(document["covariance"]))
    for i, axis in enumerate("xyz"):
        scale, bias = document["scale"][i], document["bias_rad_s"][i]
        table.add_row(axis, f"{scale:.5f}", f"{std[i]:.5f}", f"{bias:+.5f}", f"{std[3 + i]:.5f}")
    Console().print(table)

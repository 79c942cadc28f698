"""`rig solve SAMPLES.csv --sweeps SWEEPS.csv`: the calibration from data recorded elsewhere, without a verdict.

There is no configuration, so there are no limits to judge it by.
"""

import json
from pathlib import Path
from typing import Any

from rich.console import Console

from rig.analysis.calibration import known_estimator, or_fault, solve_observations, solve_six_observation
from rig.errors import Refused, raised_as
from rig.estimation.six_observation import MODEL, PARAMETER_UNITS, PARAMETERS
from rig.observation.csv_import import read
from rig.report.sensor import estimate_document, outcome_document
from rig.report.table import estimate_table


def solve_external(samples: Path, sweeps: Path, estimator: str, *, as_json: bool) -> int:
    """Solve two CSV files and print the result, the six-observation solution beside it; returns 0.

    Raises Refused `unknown_estimator`, and whatever `csv_import.read` and the estimator find wrong.
    """
    chosen = known_estimator(estimator)
    with raised_as(Refused):  # nothing runs here: whatever is wrong with the data, no arm had to be stopped for it
        data = read(samples, sweeps)
        solution = solve_observations(data.sweeps, chosen, data.rests)
    document = {
        "schema": "rig.external/1",
        "samples": str(samples),
        "sweeps": str(sweeps),
        "model": MODEL,
        **estimate_document(solution),
        "covariance_order": list(PARAMETERS),
        "covariance_units": list(PARAMETER_UNITS),
        "rests": len(data.rests),
        # Three sweeps may do for the vector model, not for the six observations.
        "six_observation": outcome_document(or_fault(lambda: solve_six_observation(data.sweeps, "newton"))),
    }
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        _print(document, Console())
    return 0


def _print(document: dict[str, Any], console: Console) -> None:
    console.print(estimate_table(f"{document['samples']}, {document['model']}, {document['estimator']}", document))
    beside = document["six_observation"]
    if "error" in beside:
        console.print(f"six_observation: {beside['error']}")
    elif beside["estimator"] != document["estimator"]:
        console.print(estimate_table("six observations alone, the rests and the axes left out", beside))

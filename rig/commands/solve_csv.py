"""`rig solve SAMPLES.csv --sweeps SWEEPS.csv`: the calibration from data recorded elsewhere, without a verdict.

There is no configuration, so there are no limits to judge it by.
"""

from pathlib import Path

from rig.analysis.calibration import known_estimator, or_fault, solve_observations, solve_six_observation
from rig.errors import Refused, raised_as
from rig.estimation.vector_model import VectorSolution
from rig.observation.csv_import import read
from rig.report.external import External, print_external
from rig.report.sensor_entry import entry_or_error, estimate_entry, vector_entry


def solve_external(samples: Path, sweeps: Path, estimator: str, *, as_json: bool) -> int:
    """Solve two CSV files and print the result, the six-observation solution beside it; returns 0.

    Raises Refused `unknown_estimator`, and whatever `csv_import.read` and the estimator find wrong.
    """
    chosen = known_estimator(estimator)
    with raised_as(Refused):  # nothing runs here: whatever is wrong with the data, no arm had to be stopped for it
        data = read(samples, sweeps)
        solution = solve_observations(data.sweeps, chosen, data.rests)
    # Three sweeps may do for the vector model, not for the six observations.
    beside = entry_or_error(or_fault(lambda: solve_six_observation(data.sweeps, "newton")))
    vector = vector_entry(solution) if isinstance(solution, VectorSolution) else None
    found = External(samples, sweeps, len(data.rests), estimate_entry(solution), vector, beside)
    print_external(found, as_json=as_json)
    return 0

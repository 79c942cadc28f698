"""`rig solve SAMPLES.csv --sweeps SWEEPS.csv`: the calibration from data recorded elsewhere, without a verdict.

There is no configuration, so there are no limits to judge it by.
"""

from pathlib import Path

from rig.analysis.calibration import or_fault, solve_six_observation
from rig.analysis.external import known_external, solve_external
from rig.errors import Refused, raised_as
from rig.observation.csv_import import read
from rig.report.external import External, print_external
from rig.report.sensor_entry import entry_or_error


def solve_sweeps(samples: Path, sweeps: Path, estimator: str | None, *, as_json: bool) -> int:
    """Solve two CSV files and print the result, the six-observation solution beside it; returns 0.

    Raises Refused `unknown_estimator`, and whatever `csv_import.read` and the estimator find wrong.
    """
    chosen = known_external(estimator)
    with raised_as(Refused):  # nothing runs here: whatever is wrong with the data, no arm had to be stopped for it
        data = read(samples, sweeps)
        solved = solve_external(data, chosen)
    # Three sweeps may do for the vector model, not for the six observations.
    beside = entry_or_error(or_fault(lambda: solve_six_observation(data.sweeps, "newton")))
    print_external(External(samples, sweeps, data, solved, beside), as_json=as_json)
    return 0

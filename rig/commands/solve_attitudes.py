"""`rig solve SAMPLES.csv --attitudes ATTITUDES.csv`: calibrations from readings in known attitudes, without a verdict.

There is no configuration, so there are no limits to judge them by.
"""

from collections.abc import Mapping
from pathlib import Path

from rig.analysis.attitudes import Surrounding, known_method, solve_placed
from rig.data.quantity import Quantity
from rig.errors import Fault, Refused, raised_as
from rig.observation.attitude_import import read_placed
from rig.report.attitudes import Found, print_found


def solve_attitudes(
    samples: Path,
    attitudes: Path,
    estimator: str | None,
    surrounding: Surrounding,
    *,
    second_order: bool,
    find_clock: bool,
    exact_rates: bool,
    window_s: float | None,
    as_json: bool,
) -> int:
    """Solve two CSV files and print what they give; returns 0.

    Raises Refused `unknown_estimator`, whatever `read_placed` finds wrong, and where not one of the recorded quantities
    has a solution what the estimator does, or of several `nothing_solved` with every reason.
    """
    method = known_method(estimator)
    with raised_as(Refused):  # nothing runs here: whatever is wrong with the data, no arm had to be stopped for it
        placed = read_placed(samples, attitudes, find_clock=find_clock)
        results = solve_placed(
            placed, surrounding, method, second_order=second_order, exact_rates=exact_rates, window_s=window_s
        )
        faults = [result for result in results.values() if isinstance(result, Fault)]
        if len(faults) == len(results):
            raise faults[0] if len(faults) == 1 else _nothing_solved(results)
    print_found(Found(samples, attitudes, surrounding, results, placed.clock), as_json=as_json)
    return 0


def _nothing_solved(results: Mapping[Quantity, object]) -> Refused:
    """Every reason, each with its own remedy."""
    reasons = "; ".join(f"{quantity}: {str(fault).rstrip('.')}" for quantity, fault in results.items())
    return Refused(
        "nothing_solved", f"no sensor has a solution: {reasons}", "Do what is said of the sensor that is wanted"
    )

"""The check that the board's average of each sweep agrees with the computer's. Pure functions.

The check detects a mean reading that is paired with a wrong mean rate, which no residual shows.
"""

from collections.abc import Sequence

from rig.analysis.check import Check, fitness
from rig.observation.consistency.board_means import compare_board_means
from rig.observation.observed_run import ObservedRun

NAME = "board_average"
LIMIT = 6.0  # standard deviations of the mean: the two averages share its noise, and usually differ by a tenth of it


def board_averages(sensor: str, recordings: Sequence[ObservedRun]) -> tuple[Check, ...]:
    """Return a check for each sweep in which the averages of board and computer disagree.

    If they agree in all sweeps, return a single check for the largest difference. A check's value is the difference of
    the two averages on the worst axis, in standard deviations of the computer's average. If the board averaged nothing,
    there are no checks.
    """
    deviations = compare_board_means(sensor, recordings)
    if not deviations:
        return ()
    beyond = [sweep for sweep, value in deviations.items() if not value <= LIMIT]
    return tuple(fitness(sensor, "rate", NAME, deviations[sweep], LIMIT, sweep=sweep) for sweep in sorted(beyond)) or (
        fitness(sensor, "rate", NAME, max(deviations.values()), LIMIT),
    )

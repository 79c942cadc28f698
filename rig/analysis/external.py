"""From sweeps recorded elsewhere to a calibration, and to what its uncertainty is made of."""

from typing import Literal

import numpy as np

from rig.analysis.calibration import ESTIMATORS, Estimator, estimator_among, solve_observations
from rig.errors import Fault
from rig.estimation.budget import Budget, Contributor
from rig.estimation.estimate import Estimate
from rig.estimation.turned import TurnedSolution, solve_turned
from rig.estimation.vector_model import VectorSolution
from rig.observation.csv_import import ExternalData

Chosen = Estimator | Literal["increments"]
CHOICES: tuple[Chosen, ...] = (*ESTIMATORS, "increments")


def known_external(name: str | None) -> Chosen | None:
    """Raises Refused `unknown_estimator`."""
    return None if name is None else estimator_among(CHOICES, name)


def solve_external(data: ExternalData, estimator: Chosen | None) -> Estimate:
    """By `estimator`; None takes "increments" where the body was turned from rest to rest, else "vector".

    Raises Fault as the estimators do, and `no_turns`.
    """
    if estimator is None:
        estimator = "vector" if data.turned is None else "increments"
    if estimator != "increments":
        return solve_observations(data.sweeps, estimator, data.rests)
    if data.turned is None:
        raise Fault(
            "no_turns",
            "no row of the sweeps has an angle and begins and ends at rest",
            "Let the body lie still for a second before and after each turn, and give angle_rad; or use vector",
        )
    start = solve_observations(data.sweeps, "vector", data.rests)
    assert isinstance(start, VectorSolution)
    turned = data.turned
    return solve_turned(turned.gyroscope, turned.turns, turned.means, start.matrix, start.bias_rad_s)


def budget_of(solution: Estimate) -> Budget:
    """What its covariance is made of: of means nothing but their scatter."""
    if isinstance(solution, TurnedSolution):
        return solution.budget
    return Budget(
        (Contributor("noise", "A", "normal", None, "", "scatter of the readings", np.inf, solution.covariance),)
    )

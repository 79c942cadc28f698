"""From sweeps recorded elsewhere to a calibration, and to what its uncertainty is made of."""

from dataclasses import replace
from typing import Literal

import numpy as np

from rig.analysis.calibration import ESTIMATORS, Estimator, estimator_among, solve_observations, solve_vector
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.budget import Budget, Contributor
from rig.estimation.coverage import effective_freedom
from rig.estimation.estimate import Estimate
from rig.estimation.known_turns import BIAS, NOISE, TurnedSolution, solve_turned
from rig.estimation.vector_model import VectorSolution
from rig.observation.csv_import import ExternalData

Chosen = Estimator | Literal["increments"]
FROM_READINGS = "scatter of the readings"
CHOICES: tuple[Chosen, ...] = (*ESTIMATORS, "increments")


def known_external(name: str | None) -> Chosen | None:
    """Raises Refused `unknown_estimator`."""
    return None if name is None else estimator_among(CHOICES, name)


def solve_external(data: ExternalData, estimator: Chosen | None) -> Estimate:
    """Solves by `estimator`; None takes "increments" where the body was turned from rest to rest, else "vector".

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
    start, turned = solve_vector(data.sweeps, data.rests), data.turned
    return solve_turned(turned.gyroscope, turned.turns, turned.means, start.matrix, start.bias_rad_s)


def budget_of(solution: Estimate, data: ExternalData) -> Budget:
    """What its covariance is made of: of means nothing but their scatter."""
    if data.turned is None or not isinstance(solution, TurnedSolution):
        freedom = _noise_freedom(solution, data)
        return Budget((Contributor(NOISE, "A", "normal", None, "", FROM_READINGS, freedom, solution.covariance),))
    known = {NOISE: float(data.turned.noise_freedom), BIAS: float(data.turned.bias_freedom)}
    lines = solution.budget.contributors
    return Budget(tuple(replace(line, freedom=known.get(line.name, line.freedom)) for line in lines))


def _noise_freedom(solution: Estimate, data: ExternalData) -> float:
    """The noise's fewest degrees of freedom: by how the vector model weighs the means, else the fewest of any mean."""
    averages = [*(sweep.average for sweep in data.sweeps), *data.rests]
    freedom = np.array([np.broadcast_to(each.freedom, 3) for each in averages])
    if not isinstance(solution, VectorSolution):
        return float(freedom.min())
    parts: Array = solution.response**2 * np.array([each.variance_rad2_s2 for each in averages])
    return float(effective_freedom(parts.reshape(6, -1).T, freedom.reshape(-1, 1)).min())

"""The uncertainty budget of a sensor calibrated in known attitudes: scale and bias, by contributor."""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from rig.analysis.external.attitude_equations import Equations
from rig.data.entries.budget import INCLUDED_IN_U
from rig.estimation.arrays import Array, scale_of
from rig.estimation.external import increment_solution, placement
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.estimation.reference.reference_budget import (
    fewest_dof,
    response_in_attitudes,
    scale_and_bias,
    scale_and_bias_covariance,
)
from rig.estimation.reference.triaxial import TriaxialSolution

CONTRIBUTOR_SOURCES: Mapping[str, tuple[Literal["A", "B"], str]] = {
    placement.NOISE: ("A", "scatter of the readings"),
    placement.ATTITUDES: ("A", f"estimated from the residuals, {INCLUDED_IN_U}"),
    placement.PLACEMENTS: ("A", f"scatter of the placements beyond their attitudes, {INCLUDED_IN_U}"),
    placement.CHANGE: ("A", "half of a change that the residuals show"),
    increment_solution.DELAY: ("A", f"estimated, with the jitter of the stamps, {INCLUDED_IN_U}"),
    increment_solution.EARTH_RATE: ("B", "its size, whichever way it points"),
    increment_solution.AXES: ("B", f"inclinations that F imitates, {INCLUDED_IN_U}"),
    increment_solution.ROUNDING: ("B", "coarse steps of the readings at rest, at most"),
    increment_solution.INTERVAL_DIFFERENCES: ("A", f"change of F and b with attitude and time, {INCLUDED_IN_U}"),
}


def noise_dof(solution: TriaxialSolution, equations: Equations) -> float:
    """Return the smallest degrees of freedom, due to noise alone, of the three scale factors and three biases."""
    response = response_in_attitudes(solution, equations.measurements)
    rows = scale_and_bias(solution.matrix, scale_of(solution.matrix), len(response)) @ response
    return fewest_dof(rows, equations.variances.ravel(), equations.dof.ravel())


def budget_by_causes(matrix: Array, causes: Mapping[str, Array], noise_dof: float | None = None) -> Budget:
    """Return the budget of scale and bias, with a contributor for each of `causes`.

    Each cause is a part (p, p) of the covariance of p parameters, the first nine of which are the `matrix` F (3, 3),
    row by row. All degrees of freedom are infinite, except those of the noise if `noise_dof` is given. They may be
    infinite if the standard uncertainty already includes the uncertainty of the variances (JCGM 101, 6.4.9).
    """
    scale = scale_of(matrix)
    lines = []
    for name, cause in causes.items():
        kind, source = CONTRIBUTOR_SOURCES[name]
        dof = np.inf
        if name == placement.NOISE and noise_dof is not None:
            dof = noise_dof
        elif name == placement.NOISE:
            source = f"{source}, {INCLUDED_IN_U}"
        lines.append(
            Contributor(name, kind, "normal", None, "", source, dof, scale_and_bias_covariance(matrix, scale, cause))
        )
    return Budget(tuple(lines))

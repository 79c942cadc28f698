"""The vector model with all that a recording tells beside the sweeps: gravity, the Earth's rate, a bias that wanders.

Gravity stands still in the room and turns in the flange's frame, so attitudes tell what of a reading is sensitivity
to it; at rest the sensor reads bias, Earth and gravity alone. None of this is assumed: what the attitudes do not tell
apart stays out of the model and belongs into the uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.settings import Site
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.bias_process import BiasProcess, estimate_bias_process
from rig.estimation.vector_model import VectorSolution, design_matrix, solve_vector_model
from rig.observation.average import Average
from rig.observation.observe import Observation

UNTOLD = ("rank_deficient", "ill_conditioned", "too_few_observations")  # what more columns than sweeps bear ends in


@dataclass(frozen=True, slots=True)
class Seen:
    """What the vector model is made of: sweeps first, then rests, N in all.

    `means_rad_s`, `variances_rad2_s2` (N, 3) of the noise alone; `rates_rad_s` (N, 3) of the flange against the stars
    where the Earth's rate is known, else against the room; `speed_std_rad_s` (N,); `gravity_m_s2` (N, 3) downwards, in
    the flange's frame; `windows_s` (N, 2) on the clock of the first recording.
    """

    means_rad_s: Array
    variances_rad2_s2: Array
    rates_rad_s: Array
    speed_std_rad_s: Array
    gravity_m_s2: Array
    windows_s: Array


@dataclass(frozen=True, slots=True)
class Explained:
    """The vector model's solution, how the bias wandered, and what both were found from."""

    solution: VectorSolution
    bias: BiasProcess
    seen: Seen


def see(observations: Sequence[Observation], rests: Sequence[Average], windows_s: Array, site: Site) -> Seen:
    """Put together what the arm knows of each average. All of them must have an attitude."""
    averages = [*(observation.average for observation in observations), *rests]
    attitudes = np.array([average.attitude for average in averages], dtype=np.float64)
    turned = [observation.speed_rad_s * observation.axis_flange for observation in observations]
    earth = np.zeros(3) if site.earth_rate_rad_s is None else np.array(site.earth_rate_rad_s)
    return Seen(
        means_rad_s=np.array([average.mean_rad_s for average in averages]),
        variances_rad2_s2=np.array([average.variance_rad2_s2 - average.drift_rad2_s2 for average in averages]),
        rates_rad_s=np.array([*turned, *np.zeros((len(rests), 3))]) + attitudes @ earth,
        speed_std_rad_s=np.array([*(each.speed_std_rad_s for each in observations), *np.zeros(len(rests))]),
        gravity_m_s2=attitudes @ (-site.gravity_m_s2 * np.array(site.up)),
        windows_s=windows_s,
    )


def explain(seen: Seen, nominal_mounting: Array) -> Explained:
    """Scale, bias and mounting, with gravity's share where the attitudes tell it.

    Raises Fault as the vector model does.
    """
    try:
        return _explain(seen, nominal_mounting, seen.gravity_m_s2)
    except Fault as fault:
        if fault.name not in UNTOLD:
            raise
    return _explain(seen, nominal_mounting, None)


def _explain(seen: Seen, nominal_mounting: Array, gravity_m_s2: Array | None) -> Explained:
    def solve(shared: Array | None) -> VectorSolution:
        return solve_vector_model(
            seen.means_rad_s,
            seen.rates_rad_s,
            seen.variances_rad2_s2,
            speed_std_rad_s=seen.speed_std_rad_s,
            gravity_m_s2=gravity_m_s2,
            nominal_mounting=nominal_mounting,
            shared_covariance_rad2_s2=shared,
        )

    steady = solve(None)
    of_the_speed = (seen.speed_std_rad_s[:, None] * np.linalg.norm(steady.matrix, axis=1)) ** 2
    bias = estimate_bias_process(
        design_matrix(seen.rates_rad_s, gravity_m_s2),
        seen.means_rad_s,
        seen.variances_rad2_s2 + of_the_speed,
        seen.windows_s,
    )
    return Explained(steady if bias.steady else solve(bias.covariance(seen.windows_s)), bias, seen)

"""What a solve expects of its own residuals: noise, ends of turns and a wandering bias, less what the fit takes up."""

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.explained import Explained
from rig.estimation.vector_model import design_matrix, of_the_speed, regress


def residual_std_rad_s(explained: Explained) -> Array:
    """(N, 3) standard deviations of the vector model's residuals: of (1 − H) V (1 − H)ᵀ, with H that makes the fit."""
    seen, solution = explained.seen, explained.solution
    rates, pull = seen.rates_rad_s, None if solution.g_sensitivity is None else seen.pull_m_s2
    own = seen.variances_rad2_s2 + of_the_speed(rates, seen.speed_std_rad_s, solution.matrix) ** 2
    shared = explained.bias.covariance(seen.windows_s)
    design = design_matrix(rates, pull)
    _, inverse = regress(design, seen.means_rad_s, own, shared)
    left = np.eye(len(own)) - design @ inverse  # (3, N, N)
    noise = np.array([np.diag(each) for each in own.T]) + shared
    variances = np.einsum("inm,imk,ink->ni", left, noise, left)
    std: Array = np.sqrt(variances.clip(min=0.0))
    return std

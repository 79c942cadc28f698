"""What rounding to counts leaves in a mean, beside the rounding itself."""

import numpy as np
import pytest

from rig.observation.mean import rounding_left


@pytest.mark.parametrize("sigma_counts", [0.0, 0.1, 0.2, 0.3, 0.5])
def test_what_rounding_leaves_in_a_mean_is_bounded_and_the_bound_is_near(sigma_counts: float) -> None:
    """The mean of rounded readings x + noise, for x all over a count, by summing over the counts it can round to."""
    from scipy.stats import norm

    x = (np.arange(2000) + 0.5) / 2000
    edges = np.arange(-8, 9) - 0.5
    below = norm.cdf((edges - x[:, None]) / sigma_counts) if sigma_counts else (edges > x[:, None]).astype(np.float64)
    means = np.diff(below, axis=1) @ np.arange(-8, 8)
    left = np.mean((means - x) ** 2)
    bound = float(rounding_left(np.array([sigma_counts**2 + 1 / 12]), 1.0)[0])
    assert left <= bound * (1 + 1e-6)
    assert left >= 6 / np.pi**2 * bound * (1 - 1e-3)  # the first harmonic alone: never far above what is there

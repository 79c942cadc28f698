"""The changes of temperature that a sensor's own errors follow."""

import numpy as np

from rig.estimation.gyroscope.own_errors import subtract_mean


def test_temperatures_change_about_their_weighted_mean_and_unknown_ones_not_at_all() -> None:
    np.testing.assert_allclose(subtract_mean(np.array([20.0, 24.0]), np.array([3.0, 1.0])), [-1.0, 3.0])
    np.testing.assert_array_equal(subtract_mean(np.full(2, np.nan), np.ones(2)), 0.0)

"""Tests of the median, which must be NumPy's."""

import numpy as np
import pytest

from rig.estimation.arrays import median


@pytest.mark.parametrize("shape", ((1,), (2,), (7, 3), (8, 3), (3, 8, 5)))
@pytest.mark.parametrize("axis", (0, -1))
def test_medians_are_those_of_numpy(shape: tuple[int, ...], axis: int) -> None:
    values = np.random.default_rng(1).normal(size=shape)
    assert (median(values, axis) == np.median(values, axis=axis)).all()

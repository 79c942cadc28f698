"""Tests of the median and of distinct values, which must be NumPy's."""

import numpy as np
import pytest

from rig.estimation.arrays import distinct, median


@pytest.mark.parametrize("shape", ((1,), (2,), (7, 3), (8, 3), (3, 8, 5)))
@pytest.mark.parametrize("axis", (0, -1))
def test_medians_are_those_of_numpy(shape: tuple[int, ...], axis: int) -> None:
    values = np.random.default_rng(1).normal(size=shape)
    assert (median(values, axis) == np.median(values, axis=axis)).all()


@pytest.mark.parametrize("values", ([], [2.0], [3, 1, 3, 2, 1], [[1.0, 0.5], [0.5, 2.0]]))
def test_distinct_values_are_those_of_numpy(values: list[float]) -> None:
    assert distinct(np.array(values)).tolist() == np.unique(values).tolist()


def test_nothing_has_no_median() -> None:
    assert np.isnan(median(np.zeros(0)))
    assert np.isnan(median(np.zeros((0, 3)), axis=0)).tolist() == [True] * 3

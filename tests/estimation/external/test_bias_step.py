"""A step of the bias between rows: found where it is, never in sound rows or in wrong rates."""

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.estimation.external.bias_step import find_bias_step

SIX_WAYS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
WITH_RESTS = np.insert(SIX_WAYS, range(6), 0, axis=0)
MATRIX = np.eye(3) + 0.02 * np.random.default_rng(1).normal(size=(3, 3))
STD = 2e-5


def means(rates: Array, seed: int, wrong_rates: float = 0.0) -> Array:
    rng = np.random.default_rng(seed)
    errors = 1 + wrong_rates * rng.normal(size=(len(rates), 1))
    return np.asarray((rates * errors) @ MATRIX.T + 0.01 + STD * rng.normal(size=rates.shape))


@pytest.mark.parametrize("row", range(2, 11))
@pytest.mark.parametrize("size_rad_s", [1e-3, -0.02])
def test_a_step_is_found_before_its_row(row: int, size_rad_s: float) -> None:
    read = means(WITH_RESTS, row)
    read[row:, 1] += size_rad_s
    step = find_bias_step(read, np.full_like(read, STD**2), WITH_RESTS)
    assert step is not None and step.row == row
    assert step.size_rad_s == pytest.approx([0, size_rad_s, 0], abs=1e-4)


def test_a_large_step_is_found_without_rests() -> None:
    read = means(SIX_WAYS, 1)
    read[3:, 0] += 0.02
    step = find_bias_step(read, np.full_like(read, STD**2), SIX_WAYS)
    assert step is not None and step.row == 3


@pytest.mark.parametrize("wrong_rates", [0.0, 1e-4, 3e-3])
def test_sound_rows_and_wrong_rates_show_no_step(wrong_rates: float) -> None:
    for seed in range(10):
        for rates in (SIX_WAYS, WITH_RESTS):
            read = means(rates, seed, wrong_rates)
            assert find_bias_step(read, np.full_like(read, STD**2), rates) is None


def test_one_wrong_row_is_no_step() -> None:
    read = means(WITH_RESTS, 1)
    read[-1] *= 1.02
    assert find_bias_step(read, np.full_like(read, STD**2), WITH_RESTS) is None


def test_too_few_rows_and_rows_about_two_axes_show_no_step() -> None:
    for rates in (SIX_WAYS[:5], WITH_RESTS[:8]):
        read = means(rates, 1)
        read[3:] += 0.02
        find_bias_step(read, np.full_like(read, STD**2), rates)  # without a warning
    assert find_bias_step(means(SIX_WAYS[:5], 1), np.full((5, 3), STD**2), SIX_WAYS[:5]) is None

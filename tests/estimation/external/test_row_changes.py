"""An abrupt change between rows: found where it is, never in sound rows or in wrong rates."""

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.estimation.external.abrupt_change import AbruptChange
from rig.estimation.external.row_changes import MIN_EVIDENCE, find_row_change

SIX_WAYS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
WITH_RESTS = np.insert(SIX_WAYS, range(6), 0, axis=0)
MATRIX = np.eye(3) + 0.02 * np.random.default_rng(1).normal(size=(3, 3))
STD = 2e-5


def means(rates: Array, seed: int, wrong_rates: float = 0.0) -> Array:
    rng = np.random.default_rng(seed)
    errors = 1 + wrong_rates * rng.normal(size=(len(rates), 1))
    return np.asarray((rates * errors) @ MATRIX.T + 0.01 + STD * rng.normal(size=rates.shape))


def found(read: Array, rates: Array) -> AbruptChange | None:
    """The change, with the number of the row as its time."""
    return find_row_change(
        read, np.full_like(read, STD**2), rates, np.arange(len(rates), dtype=np.float64), (5e-3, 0.05)
    )


@pytest.mark.parametrize("row", range(2, 11))
@pytest.mark.parametrize("size_rad_s", [1e-3, -0.02])
def test_a_step_of_the_bias_is_found_before_its_row(row: int, size_rad_s: float) -> None:
    read = means(WITH_RESTS, row)
    read[row:, 1] += size_rad_s
    change = found(read, WITH_RESTS)
    assert change is not None and change.what == "bias" and change.from_s == row
    assert change.sizes == pytest.approx([0, size_rad_s, 0], abs=1e-4)


def test_a_large_step_is_found_without_rests() -> None:
    read = means(SIX_WAYS, 1)
    read[3:, 0] += 0.02
    change = found(read, SIX_WAYS)
    assert change is not None and change.what == "bias" and change.from_s == 3


@pytest.mark.parametrize("axis", range(3))
def test_a_step_before_the_last_of_some_sweeps_without_rests_is_found(axis: int) -> None:
    rates = np.tile(SIX_WAYS, (2, 1))
    read = means(rates, 1)
    read[-1, axis] += 2e-3
    change = found(read, rates)
    assert change is not None and change.what == "bias" and change.from_s == len(rates) - 1


@pytest.mark.slow
@pytest.mark.parametrize("wrong_rates", [0.0, 1e-3])
@pytest.mark.parametrize("axes", [[0, 1, 2], [2]])
def test_a_change_of_scale_factors_is_found_with_its_axes(wrong_rates: float, axes: list[int]) -> None:
    for one_round in (SIX_WAYS, WITH_RESTS):
        rates = np.tile(one_round, (3, 1))
        read = means(rates, 1, wrong_rates)
        later = np.arange(len(rates)) >= len(rates) // 2
        read[:, axes] += 0.02 * later[:, None] * (rates @ MATRIX.T)[:, axes]
        change = found(read, rates)
        assert change is not None and change.what == "scale"
        assert change.sizes == pytest.approx(0.02 * np.isin(np.arange(3), axes), abs=4e-3)


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize("wrong_rates", [0.0, 1e-4, 3e-3])
def test_sound_rows_and_wrong_rates_show_no_change(wrong_rates: float, thorough: bool) -> None:
    for seed in range(10 if thorough else 3):
        for rates in (SIX_WAYS, WITH_RESTS, np.tile(SIX_WAYS, (2, 1))):
            change = found(means(rates, seed, wrong_rates), rates)
            assert change is None or change.evidence < MIN_EVIDENCE


def test_one_wrong_row_is_no_change() -> None:
    read = means(WITH_RESTS, 1)
    read[-1] *= 1.02
    change = found(read, WITH_RESTS)
    assert change is None or change.evidence < MIN_EVIDENCE


def test_too_few_rows_and_rows_about_two_axes_show_no_change() -> None:
    for rates in (SIX_WAYS[:5], WITH_RESTS[:8]):
        read = means(rates, 1)
        read[3:] += 0.02
        found(read, rates)  # without a warning
    assert found(means(SIX_WAYS[:5], 1), SIX_WAYS[:5]) is None

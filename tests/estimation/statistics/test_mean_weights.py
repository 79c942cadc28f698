"""One linear functional: what its weights do to the readings they do to what turned."""

import numpy as np
import pytest

from rig.estimation.statistics.mean_weights import even_groups, mean_weights

COUNT, PARTS = 90, 3
RNG = np.random.default_rng(1)
GROUPS = even_groups(np.repeat(np.arange(PARTS), COUNT // PARTS), PARTS)
PASSING = RNG.standard_normal((COUNT, 4))


def test_the_weights_are_rows_of_least_squares_by_groups_and_nuisance() -> None:
    """Frisch, Waugh and Lovell."""
    together = np.linalg.pinv(np.column_stack([GROUPS, PASSING]))[:PARTS]
    assert mean_weights(GROUPS, PASSING) == pytest.approx(together, abs=1e-12)


def test_of_readings_they_make_the_model_s_image_of_what_they_make_of_the_rates() -> None:
    """Whatever came beside: that is the whole of the reference."""
    matrix, bias = RNG.standard_normal((3, 3)), RNG.standard_normal(3)
    rates = RNG.standard_normal((COUNT, 3))
    readings = rates @ matrix.T + bias + PASSING @ RNG.standard_normal((4, 3))
    weights = mean_weights(GROUPS, PASSING)
    assert weights @ readings == pytest.approx(weights @ rates @ matrix.T + bias, abs=1e-10)


def test_a_column_that_comes_twice_or_is_empty_takes_nothing_more() -> None:
    twice = np.column_stack([PASSING, 1e6 * PASSING[:, 0], np.zeros(COUNT)])
    assert mean_weights(GROUPS, twice) == pytest.approx(mean_weights(GROUPS, PASSING), abs=1e-9)


def test_a_part_without_samples_has_no_weights() -> None:
    weights = mean_weights(even_groups(np.zeros(COUNT, dtype=np.intp), 2), PASSING)
    assert weights[0].sum() == pytest.approx(1.0) and not weights[1].any()

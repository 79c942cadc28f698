"""By what a standard uncertainty is multiplied: k of EA-4/02's table, and the probability that it promises."""

import numpy as np
import pytest

from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.estimation.statistics.coverage import (
    PROBABILITY,
    coverage_factors,
    coverage_probability,
    effective_dof,
    tail_probability,
)

# EA-4/02 M:2022, annex E, table E1: k for a coverage probability of 95.45 %.
TABLE = {1: 13.97, 2: 4.53, 3: 3.31, 4: 2.87, 5: 2.65, 6: 2.52, 7: 2.43, 8: 2.37, 10: 2.28, 20: 2.13, 50: 2.05}


def test_coverage_factors_are_those_of_the_table_and_two_without_end() -> None:
    np.testing.assert_allclose(coverage_factors([float(each) for each in TABLE]), [*TABLE.values()], atol=0.005)
    assert coverage_factors([np.inf]) == 2.0


def test_freedom_is_cut_to_the_next_lower_whole_number() -> None:
    few, more, nearly = coverage_factors([5.0, 5.9, 6 - 1e-12])
    assert few == more > nearly == coverage_factors([6.0])


def test_an_interval_with_few_degrees_of_freedom_contains_the_true_value_with_its_stated_probability() -> None:
    rng = np.random.default_rng(1)
    for count in (3, 6, 27):
        readings = rng.normal(size=(40_000, count))
        found, std = readings.mean(axis=1), readings.std(axis=1, ddof=1) / np.sqrt(count)
        held = np.mean(np.abs(found) <= coverage_factors([count - 1.0]) * std)
        assert held == pytest.approx(PROBABILITY, abs=0.004)
        assert np.mean(np.abs(found) <= 2 * std) == pytest.approx(
            coverage_probability([2.0], [count - 1.0])[0], abs=0.006
        )


def test_beyond_is_a_tail_of_the_normal_distribution_where_all_is_known() -> None:
    assert tail_probability(1.0, np.inf) == pytest.approx(0.158655, abs=1e-6)
    assert tail_probability([2.0, 2.0], [3.0, 1e9]) == pytest.approx([0.0697, 0.02275], abs=1e-4)


def test_of_two_equal_parts_the_one_that_is_known_counts_by_nothing() -> None:
    assert effective_dof([[1.0], [1.0]], [[10.0], [np.inf]]) == pytest.approx([40.0])
    assert effective_dof([[0.0], [0.0]], [[10.0], [3.0]]) == np.inf  # of nothing at all


def test_each_value_of_a_budget_has_its_own_coverage_factor() -> None:
    found = Contributor("found", "A", "normal", None, "", "", 6.0, np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
    known = Contributor("known", "B", "rectangular", 1.0, "", "", np.inf, np.diag([0.0, 0.0, 1.0, 1.0, 1.0, 1.0]))
    both = Budget((found, known))
    assert both.coverage_factors == pytest.approx([2.52, 2.52, 2.11, 2.0, 2.0, 2.0], abs=0.005)
    assert both.expanded == pytest.approx(both.coverage_factors * both.std)

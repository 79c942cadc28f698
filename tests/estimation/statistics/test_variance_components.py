"""Sizes of errors that residuals show, however far they are from what was expected of them."""

import numpy as np
import pytest

from rig.estimation.statistics.variance_components import Mixed, MixedModel

GROUPS, REPEATS = 30, 6
BETWEEN, WITHIN = 4e-5, 2e-3


def one_way(scales: tuple[float, float], alone: tuple[float, float] = (0.0, 0.0)) -> MixedModel:
    """A mean, `GROUPS` groups with an error of their own, and an error of each of their `REPEATS` readings."""
    rng = np.random.default_rng(3)
    group = np.repeat(np.arange(GROUPS), REPEATS)
    observed = WITHIN * rng.standard_normal(GROUPS)[group] + BETWEEN * rng.standard_normal(len(group))
    components = np.array([(group[:, None] == group).astype(float), np.eye(len(group))])
    rounding = 1e-14 * np.eye(len(group))
    ones, nothing = np.ones((len(group), 1)), np.zeros(1)
    return MixedModel(Mixed(observed, ones, rounding, components, nothing, np.array(scales), np.array([(0, 0), alone])))


@pytest.mark.slow
@pytest.mark.parametrize("scales", [(5e-3, 5e-3), (1.0, 1.0), (1e-6, 1e-6)])
def test_sizes_are_found_from_any_expectation(scales: tuple[float, float]) -> None:
    std = one_way(scales).find_maxima()[0]
    assert std == pytest.approx([WITHIN, BETWEEN], rel=0.3)


@pytest.mark.slow
def test_a_size_that_was_measured_alone_is_that_of_both() -> None:
    model = one_way((5e-3, 5e-3), alone=(1e5 * (3 * BETWEEN) ** 2, 1e5))
    assert model.find_maxima()[0, 1] == pytest.approx(3 * BETWEEN, rel=0.05)


@pytest.mark.slow
@pytest.mark.kernels
def test_an_interval_holds_both_of_two_equally_likely_explanations() -> None:
    apart = Mixed(
        np.array([0.0, 1.0]),
        np.ones((2, 1)),
        1e-8 * np.eye(2),
        np.array([np.diag([1.0, 0.0]), np.diag([0.0, 1.0])]),  # either reading may be wrong
        np.zeros(1),
        np.array([0.01, 0.01]),
        np.zeros((2, 2)),
    )
    model = MixedModel(apart)
    maxima = model.find_maxima()
    estimates = sorted(float(model.solve(std).theta[0]) for std in maxima)
    assert estimates == pytest.approx([0.0, 1.0], abs=0.05)
    one, both = (float(model.expand(begins, np.eye(1))[0]) for begins in (maxima[:1], maxima))
    assert one < 0.5 and both > 0.95

"""What rounding to counts leaves in a mean, beside the rounding itself."""

import numpy as np
import pytest

from rig.estimation.statistics.rounding import Steps, bound_rounding_variance, find_steps
from rig.observation.statistics.mean import even_mean
from rig.observation.statistics.vibration_noise import average_rest
from rig.observation.windows import Window


@pytest.mark.parametrize("sigma_counts", [0.0, 0.1, 0.2, 0.3, 0.5])
def test_what_rounding_leaves_in_a_mean_is_bounded_and_the_bound_is_near(sigma_counts: float) -> None:
    """The mean of rounded readings x + noise, for x all over a count, by summing over the counts it can round to."""
    from scipy.stats import norm

    x = (np.arange(2000) + 0.5) / 2000
    edges = np.arange(-8, 9) - 0.5
    below = norm.cdf((edges - x[:, None]) / sigma_counts) if sigma_counts else (edges > x[:, None]).astype(np.float64)
    means = np.diff(below, axis=1) @ np.arange(-8, 8)
    left = np.mean((means - x) ** 2)
    on_three = np.tile([[-1.0], [0.0], [1.0]], (9, 3))  # readings that tell their noise
    scatter = np.full(3, sigma_counts**2 + 1 / 12)
    bound = float(bound_rounding_variance(on_three, Steps(1.0), np.zeros((27, 3)), scatter)[0])
    assert left <= bound * (1 + 1e-6)
    assert left >= 6 / np.pi**2 * bound * (1 - 1e-3)  # the first harmonic alone: never far above what is there


@pytest.mark.one_in(4)
@pytest.mark.parametrize("cut", [False, True], ids=["rounded", "cut toward zero"])
@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.3, 0.5, 0.8, 1.0, 1.5, 3.0])
def test_a_mean_of_numbers_in_coarse_steps_errs_as_predicted(sigma: float, *, cut: bool) -> None:
    """Whatever the noise, far below a step or above: of 150 means none is far beyond its U, and few too wide a one."""
    rng = np.random.default_rng(7)
    in_std = []
    for true in rng.uniform(-4, 4, (50, 3)):
        numbers = true + sigma * rng.standard_normal((400, 3))
        whole = np.trunc(numbers)
        readings = whole + 0.5 * np.sign(whole) if cut else np.rint(numbers)
        found = even_mean(readings, Steps(1.0, cut=cut))
        in_std.append((found.mean - true) / np.sqrt(found.variance))
    assert np.mean(np.abs(in_std) < 2) > 0.91 and np.abs(in_std).max() < 4


@pytest.mark.parametrize("step", [0.25, 0.061])
def test_the_steps_are_found_in_readings_that_come_in_them(step: float) -> None:
    rng = np.random.default_rng(3)
    readings = rng.standard_normal((3000, 3)) * [0.1, 0.3, 2000.0]
    found = find_steps(np.round(np.round(readings / step) * step, 2))
    assert found[:2] == pytest.approx(step, abs=0.006) and found[2] == 0, "noise of many steps hides them"
    assert np.all(find_steps(readings) == 0)


@pytest.mark.parametrize("other", [slice(0, 2), slice(2, 4), slice(0, 5), slice(0, 233, 2)])
def test_a_mean_of_readings_that_hardly_change_is_known(other: slice) -> None:
    """Readings that repeat the one before but for a few tell no spectrum."""
    readings = np.full((233, 3), -0.0025)
    readings[other, 0] = -0.0035
    time_s = np.arange(233) / 100
    steps = Steps(1e-3, cut=True)
    for mean in (even_mean(readings, steps), average_rest(readings, time_s, Window(0.0, 2.33), steps)):
        assert np.isfinite(mean.variance).all() and (mean.variance >= steps.variance).all()
        assert np.isfinite(mean.dof).all()

"""With how many degrees of freedom the variance of a mean is known: as its own scatter over many means says."""

from collections.abc import Callable

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.statistics.coloured_noise import fit_autoregression
from rig.observation.statistics.mean import mean_at_rest
from rig.observation.statistics.tapered_weights import dof_at_zero, noise_at_zero, vibrates
from rig.observation.windows import Window

RATE_HZ = 238.0
DRAWS = 300


def white(rng: np.random.Generator, count: int) -> Array:
    return rng.normal(size=count)


def remembering(rng: np.random.Generator, count: int) -> Array:
    from scipy.signal import lfilter

    return np.asarray(lfilter([1.0], [1.0, -0.6], rng.normal(size=count)))


def shaken(rng: np.random.Generator, count: int) -> Array:
    wave = 2 * np.pi * 14 * np.arange(count) / RATE_HZ + rng.uniform(0, 2 * np.pi)
    return np.asarray(rng.normal(size=count) + 3 * np.sin(wave))


def shown(variances: list[float]) -> float:
    """ν of variances that scatter so (JCGM 100, G.4.2)."""
    return 2 * float(np.mean(variances)) ** 2 / float(np.var(variances))


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize(("made", "within"), [(white, 1.3), (remembering, 2.0), (shaken, 1.7)])
def test_the_freedom_of_a_variance_is_what_its_scatter_shows(
    made: Callable[[np.random.Generator, int], Array], within: float
) -> None:
    rng = np.random.default_rng(1)
    draws = [made(rng, 1428) for _ in range(DRAWS)]
    found = [fit_autoregression(draw - draw.mean()) for draw in draws]
    scatter = shown([left.factor * float(np.var(draw)) for left, draw in zip(found, draws, strict=True)])
    assert 1 / within < np.median([left.dof for left in found]) / scatter < within


def test_readings_that_resemble_their_neighbours_tell_their_noise_from_few_of_them() -> None:
    """Of a first-order autoregression with coefficient a, 2 / ν = 2 / n + 4 (1 + a) / (1 − a) / n."""
    drawn = remembering(np.random.default_rng(4), 1428)
    assert fit_autoregression(drawn, memories=(1,)).dof == pytest.approx(1428 / 9, rel=0.2)


def test_a_rest_in_which_the_arm_vibrates_tells_its_noise_from_few_frequencies() -> None:
    rng = np.random.default_rng(2)
    variances = [noise_at_zero(rng.normal(size=(714, 1)))[0] for _ in range(DRAWS)]
    assert dof_at_zero(714) == pytest.approx(shown(variances), rel=0.3)


def test_white_readings_have_one_less_than_there_are_and_a_vibration_costs_most_of_them() -> None:
    rng, time_s = np.random.default_rng(3), np.arange(1428) / RATE_HZ
    quiet = rng.normal(size=(1428, 3))
    alone, _ = mean_at_rest(quiet, time_s, Window(0.0, 6.0), Steps(1e-6))
    np.testing.assert_array_equal(alone.dof, 1427)
    shaking = np.column_stack([shaken(rng, 1428) for _ in range(3)])
    assert vibrates(shaking)
    found, _ = mean_at_rest(shaking, time_s, Window(0.0, 6.0), Steps(1e-6))
    assert np.all(found.dof < 100)

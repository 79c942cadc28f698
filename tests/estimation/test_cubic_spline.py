"""The rig's cubic spline beside SciPy's, which is the oracle here."""

import numpy as np
import pytest
from scipy import interpolate

from rig.estimation.cubic_spline import CubicSpline

STEPS = {"even": 0.0, "uneven": 1.0, "with gaps of a thousand steps": 3.0}


@pytest.mark.parametrize("spread", STEPS.values(), ids=STEPS)
@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 7, 500])
def test_a_spline_is_the_one_of_scipy(count: int, spread: float) -> None:
    rng = np.random.default_rng(count)
    x = np.append(0.0, np.cumsum(0.008 * np.exp(spread * rng.normal(size=count - 1))))
    y = rng.normal(size=(count, 3))
    own, theirs = CubicSpline(x, y), interpolate.CubicSpline(x, y)
    beyond = [x[0] - 0.1 * (x[1] - x[0]), x[-1] + 0.1 * (x[-1] - x[-2])]
    at = np.concatenate([x, beyond, rng.uniform(x[0], x[-1], 200 + count % 2)]).reshape(2, -1)
    for derivative in (0, 1):
        expected = theirs(at, derivative)
        np.testing.assert_allclose(own(at, derivative), expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    assert own(x[0]).shape == (3,)


@pytest.mark.parametrize(
    ("x", "y"),
    [
        ([0.0, 1.0, 1.0], [0.0, 1.0, 2.0]),
        ([0.0], [0.0]),
        ([0.0, 1.0], [0.0, np.nan]),
        ([0.0, np.inf], [0.0, 1.0]),
        ([0.0, 1.0], [0.0, 1.0, 2.0]),
    ],
)
def test_what_no_spline_goes_through_is_refused(x: list[float], y: list[float]) -> None:
    with pytest.raises(ValueError, match="spline"):
        CubicSpline(np.array(x), np.array(y))

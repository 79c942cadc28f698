"""Where a library gives a solution up, an error by name says so, and a mistake of our own stays what it is."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from rig.analysis.numeric_errors import solvable
from rig.errors import Fault


def not_positive() -> None:
    np.linalg.cholesky(-np.eye(2))


def singular() -> None:
    np.linalg.inv(np.zeros((2, 2)))


def no_numbers() -> None:
    scipy.linalg.cho_factor(np.full((2, 2), np.nan))


def no_beginning() -> None:
    def left(at: np.ndarray) -> np.ndarray:
        return at * np.nan

    scipy.optimize.least_squares(left, np.ones(2))


@pytest.mark.parametrize("given_up", [not_positive, singular, no_numbers, no_beginning])
def test_what_linear_algebra_or_a_fit_gives_up_is_named(given_up: Callable[[], None]) -> None:
    with pytest.raises(Fault, match="not_solvable: "), solvable():
        given_up()


def test_a_mistake_of_one_s_own_stays_one() -> None:
    with pytest.raises(ValueError, match="a shape"), solvable():
        raise ValueError("a shape")

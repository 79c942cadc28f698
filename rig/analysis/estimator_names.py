"""The names of the estimators that can solve a recording."""

from collections.abc import Sequence
from typing import Final, Literal, TypeVar, get_args

from rig.errors import Refused

Estimator = Literal["vector", "newton", "algorithm_1", "levenberg_marquardt"]
ESTIMATORS: tuple[Estimator, ...] = get_args(Estimator)
DEFAULT_ESTIMATOR: Final = "vector"

Choice = TypeVar("Choice", bound=str)


def find_estimator(name: str) -> Estimator:
    """Return the estimator that is called `name`. Raise Refused `unknown_estimator`."""
    return choose_estimator(ESTIMATORS, name)


def choose_estimator(choices: Sequence[Choice], name: str) -> Choice:
    """Return the member of `choices` that is called `name`. Raise Refused `unknown_estimator`."""
    for choice in choices:
        if choice == name:
            return choice
    raise Refused("unknown_estimator", f"there is no estimator {name!r} here", f"Choose one of {', '.join(choices)}")

"""Independent attempts, some of which may fail: only here is a Fault stored as a value.

Everywhere else a Fault is raised, because nothing can continue after it. `attempt_each` and `attempt` store the Fault
of a failed attempt in `faults`, by the name of the attempt, never in place of a result.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from rig.errors import Fault

Key = TypeVar("Key")
Result = TypeVar("Result")
Converted = TypeVar("Converted")
ConvertedFault = TypeVar("ConvertedFault")


@dataclass(frozen=True, slots=True)
class Attempts(Generic[Key, Result]):
    """The `results` of successful attempts, and the `faults` of the others, by key."""

    results: Mapping[Key, Result] = field(default_factory=dict)
    faults: Mapping[Key, Fault] = field(default_factory=dict)

    def merge(self, later: "Attempts[Key, Result]") -> "Attempts[Key, Result]":
        """Return the attempts together with those in `later`, which replace earlier ones of the same key."""
        repeated = later.results.keys() | later.faults.keys()
        kept = {key: result for key, result in self.results.items() if key not in repeated}
        kept_faults = {key: fault for key, fault in self.faults.items() if key not in repeated}
        return Attempts({**kept, **later.results}, {**kept_faults, **later.faults})

    def results_by_key(
        self, of_result: Callable[[Result], Converted], of_fault: Callable[[Fault], ConvertedFault]
    ) -> dict[Key, Converted | ConvertedFault]:
        """Return, by key, each result converted by `of_result`, then each Fault converted by `of_fault`."""
        values: dict[Key, Converted | ConvertedFault] = {key: of_result(result) for key, result in self.results.items()}
        for key, fault in self.faults.items():
            values[key] = of_fault(fault)
        return values


def attempt_each(attempts: Mapping[Key, Callable[[], Result]]) -> Attempts[Key, Result]:
    """Return the result of each attempt, or the Fault that ends it."""
    results, faults = dict[Key, Result](), dict[Key, Fault]()
    for key, attempt in attempts.items():
        try:
            results[key] = attempt()
        except Fault as fault:
            faults[key] = fault
    return Attempts(results, faults)


def attempt(faults: dict[str, Fault], name: str, solve: Callable[[], Result]) -> Result | None:
    """Return the result of `solve`; if it raises a Fault, store the Fault in `faults` under `name` and return None."""
    try:
        return solve()
    except Fault as fault:
        faults[name] = fault
        return None


def all_failed(keys: Iterable[Key], fault: Fault) -> Attempts[Key, Result]:
    """Return attempts that all fail with the same Fault."""
    return Attempts({}, dict.fromkeys(keys, fault))

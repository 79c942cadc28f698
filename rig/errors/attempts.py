"""Attempts that stand side by side, of which some succeed: the one form that a Fault has as a value.

What cannot go on raises its Fault. Where others go on beside it, `attempt_each` and `attempt` make a value of it: it is
among the `faults`, by the name of what was attempted, and never in the place of a result.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from rig.errors import Fault

Key = TypeVar("Key")
Result = TypeVar("Result")
Made = TypeVar("Made")
MadeOfFault = TypeVar("MadeOfFault")


@dataclass(frozen=True, slots=True)
class Attempts(Generic[Key, Result]):
    """The `results` of attempts that succeeded, and the `faults` of those that did not, by what was attempted."""

    results: Mapping[Key, Result] = field(default_factory=dict)
    faults: Mapping[Key, Fault] = field(default_factory=dict)

    def updated(self, later: "Attempts[Key, Result]") -> "Attempts[Key, Result]":
        """Return all attempts; what was attempted again counts as it was `later`."""
        again = later.results.keys() | later.faults.keys()
        kept = {key: result for key, result in self.results.items() if key not in again}
        kept_faults = {key: fault for key, fault in self.faults.items() if key not in again}
        return Attempts({**kept, **later.results}, {**kept_faults, **later.faults})

    def by_key(
        self, of_result: Callable[[Result], Made], of_fault: Callable[[Fault], MadeOfFault]
    ) -> dict[Key, Made | MadeOfFault]:
        """Return what `of_result` makes of each result, then what `of_fault` makes of each Fault."""
        made: dict[Key, Made | MadeOfFault] = {key: of_result(result) for key, result in self.results.items()}
        for key, fault in self.faults.items():
            made[key] = of_fault(fault)
        return made


def attempt_each(attempts: Mapping[Key, Callable[[], Result]]) -> Attempts[Key, Result]:
    """Return what each of the attempts gives, or the Fault it ends in."""
    results, faults = dict[Key, Result](), dict[Key, Fault]()
    for key, attempt in attempts.items():
        try:
            results[key] = attempt()
        except Fault as fault:
            faults[key] = fault
    return Attempts(results, faults)


def attempt(faults: dict[str, Fault], name: str, solve: Callable[[], Result]) -> Result | None:
    """Return what `solve` gives; None if it ends in a Fault, which `faults` then holds under that name."""
    try:
        return solve()
    except Fault as fault:
        faults[name] = fault
        return None


def all_failed(keys: Iterable[Key], fault: Fault) -> Attempts[Key, Result]:
    """Return attempts that all end in the same Fault."""
    return Attempts({}, dict.fromkeys(keys, fault))

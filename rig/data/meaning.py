"""What a check of the verdict is about: the sensor, the quantity, the parameter and the criterion."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from rig.config.judging.verdict_limits import Kind, Parameter

JUDGED_PARAMETERS: tuple[Parameter, Parameter] = ("scale", "bias")


@dataclass(frozen=True, slots=True)
class Meaning:
    """The subject of a check: conformity of a property of the item, or fitness of the measurement for use.

    `sensor`, `quantity` and `parameter` are None if the check is about several of them or none. `sweep` is the index,
    in the plan, of a sweep that contradicts the others; `rig resume` repeats it. `what` names the criterion, such as
    `scale_std`.
    """

    kind: Kind
    sensor: str | None = None
    quantity: str | None = None
    parameter: Parameter | None = None
    sweep: int | None = None
    what: str | None = None


class Judged(Protocol):
    """A check of the verdict, computed or read from a result."""

    @property
    def means(self) -> Meaning: ...
    @property
    def limit(self) -> float | None: ...


def find_conformity_limit(checks: Iterable[Judged], sensor: str, quantity: str, parameter: Parameter) -> float | None:
    """Return the limit of conformity that judges a parameter of a sensor's quantity; None if no limit does."""
    subject = "conformity", sensor, quantity, parameter
    limits = ((check.means, check.limit) for check in checks)
    return next(
        (
            limit
            for meaning, limit in limits
            if (meaning.kind, meaning.sensor, meaning.quantity, meaning.parameter) == subject
        ),
        None,
    )

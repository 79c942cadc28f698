"""What a check of the verdict means."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from rig.config.judging.limits import Kind, Parameter

HELD: tuple[Parameter, Parameter] = ("scale", "bias")


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a check is of: conformity of the item, a property of which is held, or fitness of the measurement for use.

    `quantity` and `parameter` are those of the `sensor` that are held; None where it is of no single one. `sweep` is
    the one of the plan, by index, that contradicts the others and that `rig resume` repeats. `what` names what is told
    of the quantity, `scale_std`: by it the words of the check are found.
    """

    kind: Kind
    sensor: str | None = None
    quantity: str | None = None
    parameter: Parameter | None = None
    sweep: int | None = None
    what: str | None = None


class Judged(Protocol):
    """A check, as it was made or as a result tells it."""

    @property
    def means(self) -> Meaning: ...
    @property
    def limit(self) -> float | None: ...


def limit_held(checks: Iterable[Judged], sensor: str, quantity: str, parameter: Parameter) -> float | None:
    """The limit of conformity that a parameter of a sensor's quantity is held to, None where no check holds it."""
    held = "conformity", sensor, quantity, parameter
    of = ((each.means, each.limit) for each in checks)
    return next((limit for each, limit in of if (each.kind, each.sensor, each.quantity, each.parameter) == held), None)

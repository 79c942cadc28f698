"""The meaning of a check of the verdict."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from rig.config.judging.verdict_limits import Kind, Parameter

JUDGED_PARAMETERS: tuple[Parameter, Parameter] = ("scale", "bias")


@dataclass(frozen=True, slots=True)
class Meaning:
    """The subject of a check: conformity of a property of the item, or fitness of the measurement for use.

    `quantity` and `parameter` are those of the `sensor` that is judged; None for no single one. `sweep` is the index in
    the plan of the sweep that contradicts the others and that `rig resume` repeats. `what` names the criterion,
    `scale_std`: the words of the check are found by it.
    """

    kind: Kind
    sensor: str | None = None
    quantity: str | None = None
    parameter: Parameter | None = None
    sweep: int | None = None
    what: str | None = None


class Judged(Protocol):
    """A check, as it was made or as a result holds it."""

    @property
    def means(self) -> Meaning: ...
    @property
    def limit(self) -> float | None: ...


def limit_held(checks: Iterable[Judged], sensor: str, quantity: str, parameter: Parameter) -> float | None:
    """Return the limit of conformity that judges a parameter of a sensor's quantity, or None."""
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

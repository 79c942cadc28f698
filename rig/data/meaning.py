"""What a check of the verdict means, and what the names of checks meant before they said so themselves."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from rig.config.limits import Kind, Parameter


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a check is of: conformity of the item, a property of which is held, or fitness of the measurement for use.

    `quantity` and `parameter` are those of the `sensor` that are held; None where it is of no single one. `sweep` is
    the one of the plan, by index, that contradicts the others and that `rig resume` repeats.
    """

    kind: Kind
    sensor: str | None = None
    quantity: str | None = None
    parameter: Parameter | None = None
    sweep: int | None = None


# Frozen: names of results that say no more. What checks are called since must not change what these mean.
_OF_THE_ITEM = re.compile(
    r"(.+)\.(acceleration_)?(scale_deviation|bias|bias_drift|verification_rms|verification_mean|verification)"
)
_PARAMETERS: Mapping[str, Parameter] = {"scale_deviation": "scale", "bias": "bias", "bias_drift": "bias_drift"}
_OF_A_SWEEP = re.compile(r"(.+)\.disturbed_sweep\.(\d{1,9})")


def meaning_by_name(name: str) -> Meaning:
    """What a check of a result means that says nothing of it but its name."""
    if found := _OF_THE_ITEM.fullmatch(name):
        sensor, accelerates, what = found.groups()
        return Meaning("conformity", sensor, "acceleration" if accelerates else "rate", _PARAMETERS.get(what))
    if found := _OF_A_SWEEP.fullmatch(name):
        return Meaning("fitness", found[1], "rate", sweep=int(found[2]))
    return Meaning("fitness")

"""What a check of the verdict means, and what the names of checks meant before they said so themselves."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
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


# Frozen: names of results that say no more. What checks are called since must not change what these mean.
_OF_THE_ITEM = re.compile(
    r"(.+)\.(acceleration_)?(scale_deviation|bias|bias_drift|verification_rms|verification_mean|verification)"
)
_PARAMETERS: Mapping[str, Parameter] = {"scale_deviation": "scale", "bias": "bias", "bias_drift": "bias_drift"}
_OF_A_SWEEP = re.compile(r"(.+)\.(acceleration_)?disturbed_sweep\.(\d{1,9})")
# What was told of a quantity. The last part that is one counts: a sensor may be called as a check is.
_TOLD = re.compile(
    r"(?:.*\.)?(?:acceleration_|field_)?(asymmetry|attitude_error|axis_changed|bias|bias_changed|bias_drift|bias_jumped"
    r"|bias_std|bias_u|board_bias|board_scale|clipping|clocks_agree|condition|cw_against_ccw|disturbed_dwell"
    r"|disturbed_sweep|even_term|knocked_dwell|loose_mounting|non_orthogonality|odd_term|repeated_readings|residuals"
    r"|scale_changed|scale_deviation|scale_std|scale_u|skewed_noise|spikes|stuck_axis|stuck_bit|sweeps_against_dwells"
    r"|sweeps_against_rests|verification|verification_mean|verification_reference|verification_rms)(?:\..*)?"
)


def meaning_by_name(name: str) -> Meaning:
    """What a check of a result means that says nothing of it but its name."""
    if found := _OF_THE_ITEM.fullmatch(name):
        sensor, accelerates, what = found.groups()
        quantity = "acceleration" if accelerates else "rate"
        return completed_by_name(Meaning("conformity", sensor, quantity, _PARAMETERS.get(what)), name)
    if found := _OF_A_SWEEP.fullmatch(name):
        quantity = "acceleration" if found[2] else "rate"
        return completed_by_name(Meaning("fitness", found[1], quantity), name)
    return completed_by_name(Meaning("fitness"), name)


def completed_by_name(means: Meaning, name: str) -> Meaning:
    """The meaning of a check that says all but what is told of the quantity: that too, and which sweep it is told of.

    Sweeps that an accelerometer's readings contradict were named by such checks, and no more.
    """
    told, sweep = _TOLD.fullmatch(name), _OF_A_SWEEP.fullmatch(name)
    return replace(means, what=told and told[1], sweep=int(sweep[3]) if sweep else means.sweep)

"""What has changed since another calibration of the same sensor, in sentences. Pure."""

from collections.abc import Iterable, Sequence
from math import pi

from rig.data.installed_kinds import quantities
from rig.history.series import Change
from rig.report.findings.characteristics import every_characteristic
from rig.report.findings.followed import BIASES, SCALES, is_scale
from rig.report.words.rounding import figures

PERCENT, PPM = 1e-2, 1e-6
DEGREE_RAD = pi / 180


def changed_values(changes: Iterable[Change]) -> list[Change]:
    """Return the values that have changed by more than chance explains, the largest change for its U first."""
    return sorted((change for change in changes if change.has_changed), key=lambda change: -change.normalised_error)


def comparison_in_words(changes: Sequence[Change]) -> str:
    """Return how many of the values of one sensor have changed, and from which E_n on one has."""
    if not changes:
        return "the two have no value in common"
    changed, limits, compared = changed_values(changes), [change.limit for change in changes], changes[0].compared
    share = f"{len(changed) or 'none'} of {len(changes)} values changed"
    others = f" (with {compared - len(changes)} of the run's other sensors)" if compared > len(changes) else ""
    limit = " to ".join(dict.fromkeys(f"{size:.2f}" for size in (min(limits), max(limits))))
    return (
        f"{share}. As {compared} are compared{others}, one has changed if its E_n is above {limit}: "
        "chance alone takes one of them that far in 2 of 100 comparisons at most"
    )


def change_in_short(change: Change) -> str:
    """The change of one parameter in as few words as a line has room for; U is that of such a change."""
    name = name_in_words(change.name).removeprefix("the ")
    times = f"{change.normalised_error:.{1 if change.normalised_error < 10 else 0}f}"
    return f"{name} changed by {_size(change)}, {times} U"


def name_in_words(name: str) -> str:
    """A parameter of the history in words, as they stand within a sentence; a name that is not known stays."""
    if name in SCALES:
        return f"the scale factor of {name[1]}" if name[1:] else "the mean scale factor"
    if name in BIASES:
        return f"the bias of {name[1]}"
    return next((each.parameters[name] for each in every_characteristic() if name in each.parameters), name)


def _size(change: Change) -> str:
    """The size of a change with its sign: of a scale factor as a share, of others in the unit that a screen shows."""
    difference = change.now.value - change.before.value
    if is_scale(change.name):
        share = difference / change.before.value
        size, unit = (PERCENT, "%") if abs(share) >= PERCENT / 100 else (PPM, "ppm")
        return f"{signed(share / size)} {unit}"
    if change.unit == "rad":
        return f"{signed(difference / DEGREE_RAD)}°"
    shown = next((each.reading for each in quantities().values() if each.unit == change.unit), None)
    if shown is not None:
        return f"{signed(difference / shown.size)} {shown.name}"
    return signed(difference) + ("" if change.unit == "1" else f" {change.unit}")


def signed(value: float) -> str:
    """Return a difference in three figures at most, always with its sign."""
    return f"{'−' if value < 0 else '+'}{figures(abs(value))}"

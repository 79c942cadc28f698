"""Changes between two calibrations of a sensor, in sentences. Pure."""

from collections.abc import Iterable, Sequence
from math import pi

from rig.data.installed_kinds import quantities
from rig.history.series import Change
from rig.report.findings.characteristics import every_characteristic
from rig.report.findings.history_records import BIASES, SCALES, is_scale
from rig.report.words.printed_values import figures

PERCENT, PPM = 1e-2, 1e-6
DEGREE_RAD = pi / 180


def select_changed(changes: Iterable[Change]) -> list[Change]:
    """Return the significant changes, in decreasing order of the change's size in multiples of its U."""
    return sorted((change for change in changes if change.has_changed), key=lambda change: -change.normalised_error)


def comparison_in_words(changes: Sequence[Change]) -> str:
    """Return the number of one sensor's significant changes, and the limit of the normalised error E_n, in words."""
    if not changes:
        return "the two have no value in common"
    changed, limits, compared = select_changed(changes), [change.limit for change in changes], changes[0].compared
    fraction = f"{len(changed) or 'none'} of {len(changes)} values changed"
    others = f" (with {compared - len(changes)} of the run's other sensors)" if compared > len(changes) else ""
    limit = " to ".join(dict.fromkeys(f"{size:.2f}" for size in (min(limits), max(limits))))
    return (
        f"{fraction}. {compared} are compared{others}, so a change is significant if E_n is above {limit}: "
        "by chance one of them exceeds it in at most 2 of 100 comparisons"
    )


def change_in_short(change: Change) -> str:
    """Return the change of one parameter as a short phrase; U is the uncertainty of the difference."""
    name = name_in_words(change.name).removeprefix("the ")
    times = f"{change.normalised_error:.{1 if change.normalised_error < 10 else 0}f}"
    return f"{name} changed by {_size_words(change)}, {times} U"


def name_in_words(name: str) -> str:
    """Return words for the parameter `name`, to be used within a sentence; an unknown name is returned unchanged."""
    if name in SCALES:
        return f"the scale factor of {name[1]}" if len(name) > 1 else "the mean scale factor"
    if name in BIASES:
        return f"the bias of {name[1]}"
    return next((row.parameters[name] for row in every_characteristic() if name in row.parameters), name)


def _size_words(change: Change) -> str:
    """Return the size of a change with its sign: as a fraction for a scale factor, otherwise in the displayed unit."""
    difference = change.now.value - change.before.value
    if is_scale(change.name):
        relative = difference / change.before.value
        size, unit = (PERCENT, "%") if abs(relative) >= PERCENT / 100 else (PPM, "ppm")
        return f"{add_sign(relative / size)} {unit}"
    if change.unit == "rad":
        return f"{add_sign(difference / DEGREE_RAD)}°"
    shown = next((q.reading for q in quantities().values() if q.unit == change.unit), None)
    if shown is not None:
        return f"{add_sign(difference / shown.size)} {shown.name}"
    return add_sign(difference) + ("" if change.unit == "1" else f" {change.unit}")


def add_sign(value: float) -> str:
    """Return a value as text with a sign and at most three significant digits."""
    return f"{'−' if value < 0 else '+'}{figures(abs(value))}"

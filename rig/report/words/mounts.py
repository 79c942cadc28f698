"""How the item was found to sit in each stage of a run, in words for screens and certificates. Pure.

Turns about one axis of the item for each stage tell nothing of that: then there are no words.
"""

from collections.abc import Iterator
from math import degrees, hypot

from rig.data.result_file import MountEntry, ResultDocument
from rig.estimation.statistics.coverage import COVERAGE_FACTOR
from rig.report.words.rounding import plus_minus

ROUNDING = 1e-6  # of its uncertainty: a turn that is smaller was not found but is what was assumed


def mount_lines(result: ResultDocument) -> Iterator[str]:
    """A line for each stage but the first, against which the others are told; none where the item stayed mounted."""
    yield from map(_line, _found(result))


def farthest_off(result: ResultDocument) -> Iterator[str]:
    """The line of the stage whose mount was farthest off, and how many there are beside it."""
    found = _found(result)
    if not found:
        return
    others = len(found) - 1
    farthest = _line(max(found, key=lambda mount: hypot(*mount.rotation_rad)))
    yield farthest if not others else f"{farthest}; less in {others} other stage{'s' if others > 1 else ''}"


def _found(result: ResultDocument) -> list[MountEntry]:
    return [mount for mount in result.mounts if hypot(*mount.rotation_rad) > ROUNDING * hypot(*mount.std_rad)]


def _line(mount: MountEntry) -> str:
    angles = (
        f"{plus_minus(degrees(angle), degrees(COVERAGE_FACTOR * std))}°"
        for angle, std in zip(mount.rotation_rad, mount.std_rad, strict=True)
    )
    x, y, z = angles
    return f"mounted anew: in stage {mount.stage} the item sat off its mount by {x} about x, {y} about y, {z} about z"

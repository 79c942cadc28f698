"""How the item was found to sit in each stage of a run, in words for screens and certificates. Pure."""

from collections.abc import Iterator
from math import degrees, hypot

from rig.data.result_file import MountEntry, ResultDocument
from rig.estimation.coverage import COVERAGE_FACTOR
from rig.report.rounding import plus_minus


def mount_lines(result: ResultDocument) -> Iterator[str]:
    """A line for each stage but the first, against which the others are told; none where the item stayed mounted."""
    yield from map(_line, result.mounts)


def farthest_off(result: ResultDocument) -> Iterator[str]:
    """The line of the stage whose mount was farthest off, and how many there are beside it."""
    if not result.mounts:
        return
    others = len(result.mounts) - 1
    farthest = _line(max(result.mounts, key=lambda mount: hypot(*mount.turn_rad)))
    yield farthest if not others else f"{farthest}; less in {others} other stage{'s' if others > 1 else ''}"


def _line(mount: MountEntry) -> str:
    angles = (
        f"{plus_minus(degrees(angle), degrees(COVERAGE_FACTOR * std))}°"
        for angle, std in zip(mount.turn_rad, mount.std_rad, strict=True)
    )
    x, y, z = angles
    return f"mounted anew: in stage {mount.stage} the item sat off its mount by {x} about x, {y} about y, {z} about z"

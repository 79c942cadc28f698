"""The measured errors of the item's mounting in the stages of a run, in words. Pure.

If each stage turns the item about only one axis, the mounting cannot be measured, and these functions yield nothing.
"""

from collections.abc import Iterator
from math import degrees, hypot

from rig.data.result_file import MountEntry, ResultDocument
from rig.estimation.statistics.coverage import COVERAGE_FACTOR
from rig.report.words.printed_values import plus_minus

MIN_MEASURED_RATIO = 1e-6  # ratio to its uncertainty, below which a rotation is the assumed one and not a measured one


def mount_lines(result: ResultDocument) -> Iterator[str]:
    """Yield a line on the mounting error in each stage after the first, if the error was measured."""
    yield from map(_line, _significant_mounts(result))


def farthest_off(result: ResultDocument) -> Iterator[str]:
    """Yield a line of text on the stage with the largest mounting error, and on the number of other stages."""
    mounts = _significant_mounts(result)
    if not mounts:
        return
    others = len(mounts) - 1
    farthest = _line(max(mounts, key=lambda mount: hypot(*mount.rotation_rad)))
    yield farthest if not others else f"{farthest}; less in {others} other stage{'s' if others > 1 else ''}"


def _significant_mounts(result: ResultDocument) -> list[MountEntry]:
    return [mount for mount in result.mounts if hypot(*mount.rotation_rad) > MIN_MEASURED_RATIO * hypot(*mount.std_rad)]


def _line(mount: MountEntry) -> str:
    angles = (
        f"{plus_minus(degrees(angle), degrees(COVERAGE_FACTOR * std))}°"
        for angle, std in zip(mount.rotation_rad, mount.std_rad, strict=True)
    )
    x, y, z = angles
    return f"mounting error in stage {mount.stage}: {x} about x, {y} about y, {z} about z"

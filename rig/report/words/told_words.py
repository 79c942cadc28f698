"""What may happen in a run, and from what size on it is told: the same words at the terminal and on certificates."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rig.data.entries.result_types import DetectionLimitEntry
from rig.report.entry import entry

if TYPE_CHECKING:
    from rig.analysis.consistency.detection_limits import DetectionLimit

FACTORS = {"1": (100.0, " %"), "rad": (math.degrees(1), "°"), "T": (1e6, " µT")}  # by which a unit is shown


def told_from(damages: Sequence["DetectionLimit"]) -> dict[str, tuple[DetectionLimitEntry, ...]]:
    """The field of `result.json`, if there is anything to say."""
    return {"detection_limits": told_from_entries(damages)} if damages else {}


def told_from_entries(damages: Sequence["DetectionLimit"]) -> tuple[DetectionLimitEntry, ...]:
    """What `result.json` has of it: a size that is never told is null."""
    return tuple(
        entry(DetectionLimitEntry, each, size=each.size if math.isfinite(each.size) else None) for each in damages
    )


def told_lines(damages: Sequence[DetectionLimitEntry]) -> Iterator[str]:
    """A line at the terminal, where anything is known of it."""
    if damages:
        yield f"smallest disturbance that the checks of this run notice: {told_words(damages)}"


def told_words(damages: Sequence[DetectionLimitEntry]) -> str:
    """All that would be told, and from what size on, in one sentence."""
    return "; ".join(f"{each.fault}: {size_words(each.size, each.unit)}{_off_by(each)}" for each in damages)


def size_words(size: float | None, unit: str) -> str:
    """A size in its unit with two significant digits; "never" without one."""
    if size is None:
        return "never"
    factor, shown = FACTORS.get(unit, (1.0, f" {unit}"))
    return f"{factor * size:#.2g}{shown}"


def _off_by(damage: DetectionLimitEntry) -> str:
    return "" if damage.error_over_expanded is None else f" ({damage.error_over_expanded:.1f} U)"

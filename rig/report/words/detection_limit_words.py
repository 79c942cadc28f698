"""Detection limits: the smallest faults of a run that its checks detect, in words for terminal and certificates."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rig.data.entries.result_types import DetectionLimitEntry
from rig.report.entry import entry

if TYPE_CHECKING:
    from rig.analysis.consistency.detection_limits import DetectionLimit

FACTORS = {"1": (100.0, " %"), "rad": (math.degrees(1), "°"), "T": (1e6, " µT")}  # factor and unit in print


def detection_limit_field(limits: "Sequence[DetectionLimit]") -> dict[str, tuple[DetectionLimitEntry, ...]]:
    """Return `detection_limits`, the field of `result.json`; no field if there are no limits."""
    return {"detection_limits": detection_limit_entries(limits)} if limits else {}


def detection_limit_entries(limits: "Sequence[DetectionLimit]") -> tuple[DetectionLimitEntry, ...]:
    """Return the entries of `result.json`; the size of an undetectable fault is null."""
    return tuple(
        entry(DetectionLimitEntry, limit, size=limit.size if math.isfinite(limit.size) else None) for limit in limits
    )


def detection_limit_lines(limits: Sequence[DetectionLimitEntry]) -> Iterator[str]:
    """Yield a line for the terminal if there are limits."""
    if limits:
        yield f"smallest fault that the checks of this run detect: {list_limits(limits)}"


def list_limits(limits: Sequence[DetectionLimitEntry]) -> str:
    """Return a sentence that lists all faults with the smallest size detected."""
    return "; ".join(f"{limit.fault}: {size_words(limit.size, limit.unit)}{_largest_error(limit)}" for limit in limits)


def size_words(size: float | None, unit: str) -> str:
    """Return a size in its unit with two significant digits, or "never" if `size` is None."""
    if size is None:
        return "never"
    factor, shown = FACTORS.get(unit, (1.0, f" {unit}"))
    return f"{factor * size:#.2g}{shown}"


def _largest_error(limit: DetectionLimitEntry) -> str:
    return "" if limit.error_over_expanded is None else f" ({limit.error_over_expanded:.1f} U)"

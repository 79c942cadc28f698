"""When a sensor should come back: at the drift it has shown, by the control-chart method of ILAC-G24:2022."""

import numpy as np

from rig.estimation.arrays import Array
from rig.history.statistics.random_effects import Fitted

HORIZON_DAYS = 3653  # ten years; a drift says nothing of what comes later


def days_to_limit(line: Fitted, last_days: float, expanded: float, max_deviation: float, nominal: float) -> int | None:
    """Days after the last result until |value − nominal| + U reaches `max_deviation`; None within ten years.

    `line` is value = c₀ + c₁ t, t in days as `last_days`. U holds the line's own uncertainty at that time, the spread
    between runs, and the `expanded` uncertainty that the last result states.
    """
    ahead = np.arange(HORIZON_DAYS + 1.0)
    value, std = line.at(_line(last_days + ahead))
    own = line.coverage_factor * np.hypot(std, line.between_std)
    reached = np.abs(value - nominal) + np.hypot(own, expanded) >= max_deviation
    return int(np.argmax(reached)) if reached.any() else None


def _line(days: Array) -> Array:
    return np.stack([np.ones_like(days), days], axis=-1)

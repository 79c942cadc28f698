"""Recall dates of sensors by their drift: the control-chart method of ILAC-G24:2022."""

import numpy as np

from rig.history.statistics.random_effects import Fitted

HORIZON_DAYS = 3653  # ten years: a drift cannot be extrapolated further


def days_to_limit(line: Fitted, last_days: float, expanded: float, max_deviation: float, nominal: float) -> int | None:
    """Return the days after the last result until |value − nominal| + U reaches `max_deviation`, or None.

    None means more than ten years. `line` is value = c₀ + c₁ t, t in days like `last_days`. U combines the line's
    uncertainty at that time, the scatter between runs, and the `expanded` uncertainty of the last result.
    """
    ahead = np.arange(HORIZON_DAYS + 1.0)
    value, std = line.predict(np.stack([np.ones_like(ahead), last_days + ahead], axis=-1))
    line_expanded = line.coverage_factor * np.hypot(std, line.between_std)
    reached = np.abs(value - nominal) + np.hypot(line_expanded, expanded) >= max_deviation
    return int(np.argmax(reached)) if reached.any() else None

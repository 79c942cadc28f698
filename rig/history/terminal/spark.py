"""A series as a picture in one line of a terminal. Pure."""

import numpy as np

from rig.history.series import Trend

BLOCKS = "▁▂▃▄▅▆▇█"
PLAIN = str.maketrans(BLOCKS, "__..--''")  # for a terminal without blocks
MOST = 16  # number of the newest results


def picture(trend: Trend) -> str:
    """Return a block for each of the newest results, whose height shows the value.

    The lowest block is the lowest value − U, the highest block the highest value + U, so values with equal blocks
    differ by less than U. Empty for a single result.
    """
    newest = trend.parameters[-MOST:]
    if len(newest) < 2:
        return ""
    values, widths = (np.array([getattr(parameter, name) for parameter in newest]) for name in ("value", "expanded"))
    low, high = (values - widths).min(), (values + widths).max()
    heights = (values - low) / (high - low)
    return "".join(BLOCKS[min(int(height * len(BLOCKS)), len(BLOCKS) - 1)] for height in heights)

"""The load of this computer extends time-outs, so that an overloaded computer does not look like a lost link."""

import os
from pathlib import Path

MAX_LOAD_FACTOR = 5.0  # on a limit: the number of runnable programs per processor


def exceeds(delay: float, limit: float) -> bool:
    """Return whether `delay` exceeds `limit` times the load. The load is read only if `delay` exceeds `limit`."""
    return delay > limit and delay > limit * load_factor()


def load_factor() -> float:
    """Return the factor by which a delay may be longer: runnable programs per processor, limited to 1 … 5.

    The number of programs is the mean of the last minute, or the present number if that is larger, because after 15 s
    the mean shows only a quarter of a new load.
    """
    if not hasattr(os, "getloadavg"):  # Windows
        return 1.0
    return min(max(max(os.getloadavg()[0], _runnable()) / (os.cpu_count() or 1), 1.0), MAX_LOAD_FACTOR)


def _runnable() -> int:
    """Return the number of threads of the machine that run or wait for a processor now; 0 without proc(5)."""
    try:
        return int(Path("/proc/loadavg").read_text().split()[3].partition("/")[0])
    except (OSError, ValueError, IndexError):
        return 0

"""How much longer everything takes on a machine that has more to do than it can."""

import os


def crowding() -> float:
    """Programs that want to run for each processor, 1 to 5."""
    return min(max(os.getloadavg()[0] / (os.cpu_count() or 1), 1.0), 5.0)

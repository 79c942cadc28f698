"""CSV files for `rig solve`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rig.estimation.arrays import Array


def write_table(path: Path, columns: Sequence[str], *parts: Array) -> Path:
    """Write columns (n,) or (n, k) side by side."""
    np.savetxt(path, np.column_stack(parts), "%.10g", ",", header=",".join(columns), comments="")
    return path

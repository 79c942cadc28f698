"""CSV files for `rig solve`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rig.estimation.arrays import Array


def write_table(path: Path, columns: Sequence[str], *parts: Array) -> Path:
    """Write columns (n,) or (n, k) side by side, as `np.savetxt` does in three times the time."""
    table = np.column_stack(parts)
    row = ",".join(["%.10g"] * table.shape[1]) + "\n"
    path.write_text(f"{','.join(columns)}\n" + row * len(table) % tuple(table.ravel().tolist()), encoding="utf-8")
    return path

"""Readings of one sensor or several as a CSV file: the columns that every command takes.

`time_s`, which must increase, and any of `x_rad_s y_rad_s z_rad_s` (rate), `x_m_s2 y_m_s2 z_m_s2` (what an
accelerometer feels: at rest the opposite of gravity) and `x_t y_t z_t` (magnetic field, tesla). `temperature_c` may
stand there too, as `rig export` writes it; nothing depends on it. Columns may stand in any order; the first row holds
their names. One recording serves every command: each uses the quantities it knows what to do with.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.observation.csv_table import read_columns
from rig.observation.csv_windows import check_times

Quantity = Literal["rate", "acceleration", "field"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
UNITS: Mapping[Quantity, str] = {"rate": "rad/s", "acceleration": "m/s²", "field": "T"}
COLUMNS: Mapping[Quantity, tuple[str, ...]] = {
    "rate": ("x_rad_s", "y_rad_s", "z_rad_s"),
    "acceleration": ("x_m_s2", "y_m_s2", "z_m_s2"),
    "field": ("x_t", "y_t", "z_t"),
}
TIME, TEMPERATURE = "time_s", "temperature_c"
SAMPLES_MB = 256  # an hour at 1 kHz


@dataclass(frozen=True, slots=True)
class Samples:
    """A file's readings: `time_s` (n,), increasing, and (n, 3) of every quantity it holds, in SI units."""

    time_s: Array
    readings: Mapping[Quantity, Array]


def read_samples(path: Path, needed: Sequence[Quantity] = ()) -> Samples:
    """The readings of a file, those `needed` and whatever others it holds.

    Raises Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`, `time_not_increasing`.
    """
    required = (TIME, *(name for quantity in needed for name in COLUMNS[quantity]))
    others = [COLUMNS[quantity] for quantity in QUANTITIES if quantity not in needed]
    table = read_columns(path, required, (), SAMPLES_MB, (*others, (TEMPERATURE,)))
    given = [quantity for quantity in QUANTITIES if COLUMNS[quantity][0] in table]
    if not given:
        raise Refused(
            "wrong_columns",
            f"{path} holds no readings",
            f"Its first row must name time_s and {', or '.join(' '.join(names) for names in COLUMNS.values())}",
        )
    check_times(table[TIME])
    readings = {quantity: np.column_stack([table[name] for name in COLUMNS[quantity]]) for quantity in given}
    return Samples(table[TIME], readings)

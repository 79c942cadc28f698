"""Checks for numbers in a log that are no readings.

They are a logger's mark of a missing value, an axis that is frozen, or the end of a sensor's range.
"""

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import RATE, Quantity
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array, equal_runs
from rig.observation.windows import Window, inside

OF_MOST = 0.1  # of the largest reading that any part has: beyond most parts' range
BEYOND, USUAL = 20.0, 0.99  # times the largest of the usual readings, which are this fraction
CLIPPED, CLIPPED_RAD_S = 4, 1.0  # equal readings in a row at the end of an axis' readings; least range of these
FINE = 0.5  # of the noise: steps of readings below it, so that equal ones are no chance
FROZEN, COARSE = 50, 10  # equal readings in a row; more than so many a second time: a coarse axis repeats readings
TURNED_RAD_S = 0.2  # change of another axis meanwhile
INNER = (0.05, 0.95)  # quantiles: single readings count for nothing
COLDEST_C, HOTTEST_C = -273.15, 1000.0


def check_possible(readings: Array, rows: NDArray[np.intp], quantity: Quantity, where: str) -> None:
    """Raise Refused `not_a_number` if a few readings (n, 3) are far beyond all others and most parts' range.

    `rows` (n,) are their numbers in the file, from 0, and messages call the file `where`. If more than a few are, the
    unit is wrong.
    """
    if quantity.mistaken is None or not len(readings):
        return
    sizes = np.abs(readings).max(axis=1)
    limit = max(OF_MOST * quantity.mistaken.most, BEYOND * float(np.quantile(sizes, USUAL, method="lower")))
    wrong = np.flatnonzero(sizes > limit)
    if len(wrong):
        axis = int(np.argmax(np.abs(readings[wrong[0]])))
        value = readings[wrong[0], axis]
        raise Refused(
            "not_a_number",
            f"{where} has {len(wrong)} samples that no {quantity.sensor} reads, the first is sample "
            f"{rows[wrong[0]] + 1}, with {value:.6g} {quantity.unit} in {quantity.columns[axis]}",
            "If the logger marks a missing value so, state its text with --columns (samples_missing); otherwise leave "
            "out these rows",
        )


def check_temperatures(temperature_c: Array, rows: NDArray[np.intp], where: str) -> None:
    """Raise Refused `wrong_unit` for a temperature (n,) that nothing in a laboratory has; arguments as above."""
    wrong = np.flatnonzero((temperature_c < COLDEST_C) | (temperature_c > HOTTEST_C))
    if len(wrong):
        raise Refused(
            "wrong_unit",
            f"{where} has {len(wrong)} samples whose temperature_c is no temperature in °C, the first is sample "
            f"{rows[wrong[0]] + 1}, with {temperature_c[wrong[0]]:.6g}",
            "Convert counts to °C, as the data sheet says, or give the column another name, so that it is not read",
        )


def find_clipped(readings: Array) -> NDArray[np.bool_]:
    """Return which readings (n,) repeat the largest or smallest value of their axis several times.

    A sensor at rest repeats values too, but then its largest and smallest ones are close together.
    """
    clipped = np.zeros(len(readings), dtype=np.bool_)
    for axis in readings.T:
        if np.ptp(axis) < CLIPPED_RAD_S:
            continue
        starts, ends = equal_runs(axis).T
        at_end = np.isin(axis[starts], [axis.min(), axis.max()])
        clipped |= np.repeat(at_end & (ends - starts >= CLIPPED), ends - starts)
    return clipped


def check_unclipped(time_s: Array, readings: Array, windows: list[Window]) -> None:
    """Raise Fault `saturation` if rates (n, 3) in a window are at the end of their range.

    An axis in steps as coarse as its noise repeats its largest reading without being at an end, and is not judged.
    """
    for axis, letter in enumerate(RATE.axes):
        column = readings[:, axis]
        noise = float(np.median(np.abs(np.diff(column)))) / 0.954  # of white noise, from its differences
        steps = np.diff(np.unique(column))
        if not len(steps) or steps.min() > FINE * noise:
            continue
        clipped = find_clipped(column[:, None])
        for row, window in enumerate(windows, start=1):
            within = inside(time_s, window)
            if count := int(clipped[within].sum()):
                value = column[within][clipped[within]][0]
                raise Fault(
                    "saturation",
                    f"in row {row}, from {window.start_s:.6g} to {window.end_s:.6g} s, {count} readings of the "
                    f"gyroscope are {value:.6g} rad/s on {letter}, the end of its range",
                    "Choose a wider range, or turn more slowly",
                )


def check_frozen(time_s: Array, readings: Array) -> None:
    """Raise Fault `stuck_sensor` if an axis of rates (n, 3) repeats one value while another axis turns."""
    for axis, letter in enumerate(RATE.axes):
        column = readings[:, axis]
        runs = equal_runs(column)
        lengths = np.diff(runs, axis=1)[:, 0]
        longest = int(np.argmax(lengths))
        run = slice(*runs[longest].tolist())
        value = column[run.start]
        is_coarse = len(lengths) > 1 and int(np.delete(lengths, longest).max()) > COARSE
        if lengths[longest] < FROZEN or is_coarse or value in {column.max(), column.min()}:
            continue
        low, high = np.quantile(np.delete(readings[run], axis, axis=1), INNER, axis=0)
        if (high - low).max() > TURNED_RAD_S:
            raise Fault(
                "stuck_sensor",
                f"from {time_s[run.start]:.6g} to {time_s[run.stop - 1]:.6g} s the gyroscope reads {value:.6g} rad/s "
                f"on {letter} always, while it turns about its other axes",
                "Check the sensor's supply and its bus wires, then record again; or solve what was read before",
            )

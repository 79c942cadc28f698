"""Checks for numbers in a log that are not readings.

Examples are a logger's mark of a missing value, a frozen axis, and the end of a sensor's range.
"""

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, MAX_TEMPERATURE_C, MIN_TEMPERATURE_C, RATE, Quantity
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array, equal_runs
from rig.observation.windows import Window, inside

MAX_RATIO, USUAL_QUANTILE = 20.0, 0.99  # of the largest reading to this quantile
# equal readings in a row at the largest value that show clipping; least range of the axis
MIN_CLIPPED_READINGS, MIN_CLIPPED_RANGE_RAD_S = 4, 1.0
MAX_FINE_RATIO = 0.5  # of the resolution to the noise, at which equal readings are not chance
MAX_STEP_INTERVALS = 1.5  # without a missing reading
MIN_FROZEN_READINGS, COARSE_READINGS = (
    50,
    10,
)  # equal readings in a row that show a frozen axis, unless a second run of COARSE_READINGS shows a coarse one
MIN_OTHER_CHANGE_RAD_S = 0.2  # of another axis during them
MOTION_QUANTILES = (0.05, 0.95)  # which bound an axis' motion, so that single readings do not count
# fractions of an axis' span: an overflow is larger than the first, all other steps are smaller than the second
OVERFLOW_SPAN_FRACTION, SMOOTH_SPAN_FRACTION = 0.8, 0.25
MAX_ASYMMETRY = 0.1  # sum of the smallest and the largest reading, relative to the span, for a signed number
MIN_SPAN_STEPS = 100  # of the readings: a coarse axis that toggles has fewer
MIN_SPAN = {RATE: 2.0, ACCELERATION: 25.0}  # span of the smallest range; more than gravity when a body is turned over
RISE, MIN_RISE_NOISES = 4, 4.0  # readings before and after an overflow that must rise; the rise in noises of a step
TOGGLE_READINGS = 10  # readings between two opposite jumps that noise causes close to the end of the range


def check_possible(readings: Array, rows: NDArray[np.intp], quantity: Quantity, where: str) -> None:
    """Raise Refused `not_a_number` if a few readings (n, 3) far exceed all others, and the range of most sensors.

    `rows` (n,) are the readings' numbers in the file, from 0; messages call the file `where`. Many such readings raise
    nothing here, because they are due to a wrong unit.
    """
    if quantity.mistaken is None or not len(readings):
        return
    sizes = np.abs(readings).max(axis=1)
    limit = max(quantity.mistaken.unusual, MAX_RATIO * float(np.quantile(sizes, USUAL_QUANTILE, method="lower")))
    wrong = np.flatnonzero(sizes > limit)
    if len(wrong):
        axis = int(np.argmax(np.abs(readings[wrong[0]])))
        value = readings[wrong[0], axis]
        raise Refused(
            "not_a_number",
            f"{where} has {len(wrong)} samples that no {quantity.sensor} can read; the first is sample "
            f"{rows[wrong[0]] + 1}, with {value:.6g} {quantity.unit} in {quantity.columns[axis]}",
            "If the logger marks a missing value so, state its text with --columns (samples_missing); otherwise leave "
            "out these rows",
        )


def check_temperatures(temperature_c: Array, rows: NDArray[np.intp], where: str) -> None:
    """Raise Refused `wrong_unit` for a temperature too low or high for a laboratory.

    `rows` (n,) are the readings' numbers in the file, from 0; messages call the file `where`.
    """
    wrong = np.flatnonzero((temperature_c < MIN_TEMPERATURE_C) | (temperature_c > MAX_TEMPERATURE_C))
    if len(wrong):
        raise Refused(
            "wrong_unit",
            f"{where} has {len(wrong)} samples whose temperature_c is not a temperature in °C; the first is sample "
            f"{rows[wrong[0]] + 1}, with {temperature_c[wrong[0]]:.6g}",
            "Convert kelvins, or counts by the data sheet, to °C; or give the column another name: then it is not read",
        )


def check_unwrapped(time_s: Array, readings: Array, rows: NDArray[np.intp], quantity: Quantity, where: str) -> None:
    """Raise Refused `readings_overflow` if an axis of readings (n, 3) jumps from one end of its span to the other.

    Such jumps are overflows: a signed 16-bit number continues after 32767 at −32768. `rows` (n,) are the readings'
    numbers in the file, from 0; messages call the file `where`.
    """
    if quantity not in MIN_SPAN or len(readings) < 2:
        return
    for axis, name in enumerate(quantity.columns):
        jumps = _find_overflows(time_s, readings[:, axis], MIN_SPAN[quantity])
        if not len(jumps):
            continue
        first = jumps[0]
        before, after = readings[first : first + 2, axis]
        raise Refused(
            "readings_overflow",
            f"{where}: {name} jumps from {before:.6g} to {after:.6g} {quantity.unit} between two readings, from one "
            f"end of its range to the other, as a number does that overflows: {len(jumps)} such steps, the first "
            f"before sample {rows[first + 1] + 1}, at {time_s[first + 1]:.10g} s",
            f"Choose a wider range of the {quantity.sensor}, or turn more slowly; or store its readings in more bits",
        )


def _find_overflows(time_s: Array, axis: Array, narrowest: float) -> NDArray[np.intp]:
    """Return the indices (k,) of the readings (n,) before an overflow of the number that they are stored in.

    A change of sign between two joined recordings looks similar. But before an overflow the readings rise towards one
    end of the range. After it they rise on from the other end, or soon jump back, because noise makes a number at the
    limit overflow in both directions. No overflow is sought in readings that span less than `narrowest`.
    """
    none = np.zeros(0, dtype=np.intp)
    span, steps, steps_s = float(np.ptp(axis)), np.diff(axis), np.diff(time_s)
    large = np.abs(steps) > OVERFLOW_SPAN_FRACTION * span
    if span < narrowest or not large.any() or abs(axis.max() + axis.min()) > MAX_ASYMMETRY * span:
        return none
    jumps = np.flatnonzero(large & (steps_s <= MAX_STEP_INTERVALS * np.median(steps_s)))
    small_steps = np.abs(steps[~large])
    if not len(jumps) or small_steps.max(initial=0.0) > SMOOTH_SPAN_FRACTION * span:
        return none
    if span < MIN_SPAN_STEPS * float(np.diff(np.unique(axis)).min()):
        return none
    noise = float(np.median(np.abs(np.diff(steps))))
    inner = jumps[(jumps >= RISE) & (jumps + RISE + 1 < len(axis))]
    rise = np.minimum(*(np.sign(-steps[inner]) * (axis[end] - axis[end - RISE]) for end in (inner, inner + 1 + RISE)))
    goes_on = bool((rise > MIN_RISE_NOISES * noise).any())
    returns = bool(((np.diff(jumps) <= TOGGLE_READINGS) & (np.diff(np.sign(steps[jumps])) != 0)).any())
    return jumps if goes_on or returns else none


def find_clipped(readings: Array) -> NDArray[np.bool_]:
    """Return a mask (n,) of the readings that repeat the largest or smallest value of an axis several times.

    A sensor at rest repeats these values too. So axes whose readings span less than `MIN_CLIPPED_RANGE_RAD_S` are
    ignored.
    """
    clipped = np.zeros(len(readings), dtype=np.bool_)
    for axis in readings.T:
        if np.ptp(axis) < MIN_CLIPPED_RANGE_RAD_S:
            continue
        starts, ends = equal_runs(axis).T
        at_end = np.isin(axis[starts], [axis.min(), axis.max()])
        clipped |= np.repeat(at_end & (ends - starts >= MIN_CLIPPED_READINGS), ends - starts)
    return clipped


def check_unclipped(time_s: Array, readings: Array, windows: list[Window]) -> None:
    """Raise Fault `saturation` if rates (n, 3) in one of the windows are at the end of their range.

    An axis with steps as coarse as its noise is not checked, because it repeats its largest reading anyway.
    """
    for axis, letter in enumerate(RATE.axes):
        column = readings[:, axis]
        # standard deviation of white noise, from the median of its differences
        noise = float(np.median(np.abs(np.diff(column)))) / 0.954
        steps = np.diff(np.unique(column))
        if not len(steps) or steps.min() > MAX_FINE_RATIO * noise:
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
        is_coarse = len(lengths) > 1 and int(np.delete(lengths, longest).max()) > COARSE_READINGS
        if lengths[longest] < MIN_FROZEN_READINGS or is_coarse or value in {column.max(), column.min()}:
            continue
        low, high = np.quantile(np.delete(readings[run], axis, axis=1), MOTION_QUANTILES, axis=0)
        if (high - low).max() > MIN_OTHER_CHANGE_RAD_S:
            raise Fault(
                "stuck_sensor",
                f"from {time_s[run.start]:.6g} to {time_s[run.stop - 1]:.6g} s the gyroscope always reads {value:.6g} "
                f"rad/s on {letter} while it turns about its other axes",
                "Check the sensor's supply and its bus wires, then record again; or solve what was read before",
            )

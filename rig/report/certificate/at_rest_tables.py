"""Numbers of accelerometers, of magnetometers and of bias drifts, as a certificate prints them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.bias_drift import DriftEntry
from rig.data.entries.magnetometer import MagnetometerEntry, ReversalEntry
from rig.data.entries.result_types import ErrorEntry
from rig.estimation.temperature.bias_by_repeat import largest_change_std
from rig.report.tables.certificate import AXES, AxisRow, Pair, pair, rows_of
from rig.report.words.expanded_uncertainty import expanded

MICRO = 1e6


@dataclass(frozen=True, slots=True)
class ReversalRow:
    """One magnetometer axis after a reversal: its scale factor, its own bias, and the arm's field along it.

    If `mixed`, this axis was not turned over. Then `bias` includes the arm's field, and `arm_field` is None.
    """

    axis: str
    scale: Pair
    bias: Pair
    arm_field: Pair | None
    mixed: bool


@dataclass(frozen=True, slots=True)
class DriftRow:
    """The bias of one axis in the first and the last repeat of the attitudes, and the largest change between repeats.

    `slope` is the bias change per degree of temperature, None if not determined.
    """

    axis: str
    first: Pair
    last: Pair
    change: Pair
    slope: Pair | None


def acceleration_rows(entry: AccelerometerEntry) -> list[AxisRow]:
    """Return a row with U for each accelerometer axis; biases are in m/s² and in thousandths of the stated gravity."""
    return rows_of(entry.scale, entry.bias_m_s2, entry.budget.expanded, too=1000 / entry.gravity_m_s2)


def field_rows(entry: MagnetometerEntry) -> list[AxisRow]:
    """Return a row with U for each magnetometer axis; biases are in µT."""
    return rows_of(entry.scale, entry.bias_t, entry.budget.expanded, size=MICRO)


def reversal_rows(entry: ReversalEntry) -> list[ReversalRow]:
    """Return a row per magnetometer axis: scale, bias and arm's field in µT with U, in the first mounting's axes."""
    scale = expanded(entry.scale_std, entry.scale_degrees_of_freedom).widths
    bias = expanded(entry.bias_std_t, entry.bias_degrees_of_freedom).widths
    field = expanded(entry.arm_field_std_t, entry.arm_field_degrees_of_freedom).widths
    return [
        ReversalRow(
            axis,
            pair(entry.scale[i], scale[i]),
            pair(MICRO * entry.bias_t[i], MICRO * bias[i]),
            None if mixed else pair(MICRO * entry.arm_field_t[i], MICRO * field[i]),
            mixed,
        )
        for i, (axis, mixed) in enumerate(zip(AXES, entry.arm_field_in_bias, strict=True))
    ]


def drift_rows(entry: DriftEntry) -> list[DriftRow]:
    """Return a row for each axis of a bias drift, with U, in the quantity's unit of drift."""
    bias, std = (np.array([getattr(repeat.scale_fixed, name) for repeat in entry.repeats]) for name in ("bias", "std"))
    total = np.hypot(std, entry.common_std)  # of the bias itself: in a change of the bias the common error cancels
    change_std, slope = largest_change_std(bias, std), entry.temperature_slope
    first, last, change = (
        expanded(stds.tolist(), entry.degrees_of_freedom).widths for stds in (total[0], total[-1], change_std)
    )
    per_c = () if isinstance(slope, ErrorEntry) else expanded(slope.std, slope.degrees_of_freedom).widths
    return [
        DriftRow(
            axis,
            pair(float(bias[0, i]), first[i]),
            pair(float(bias[-1, i]), last[i]),
            pair(entry.largest_change[i], change[i]),
            None if isinstance(slope, ErrorEntry) else pair(slope.slope[i], per_c[i]),
        )
        for i, axis in enumerate(AXES)
    ]


def distance(vector: Sequence[float]) -> float:
    """Return the length of a vector."""
    return math.hypot(*vector)

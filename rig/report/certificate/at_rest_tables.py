"""The numbers of accelerometers, of magnetometers and of biases by repeat as a certificate prints them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.drift import DriftEntry
from rig.data.entries.magnetometer import MagnetometerEntry, ReversalEntry
from rig.data.entries.result_types import ErrorEntry
from rig.estimation.temperature.bias_by_repeat import largest_change_std
from rig.report.tables.certificate import AXES, AxisRow, Pair, pair, rows_of
from rig.report.words.expanded import expanded

MICRO = 1e6


@dataclass(frozen=True, slots=True)
class ReversalRow:
    """One axis of a magnetometer that was turned over; `mixed` where it was not, and the bias is that as mounted."""

    axis: str
    scale: Pair
    bias: Pair
    arm_field: Pair | None
    mixed: bool


@dataclass(frozen=True, slots=True)
class DriftRow:
    """One axis' bias: in the first and in the last repeat, how far it ever moved, and over temperature if known."""

    axis: str
    first: Pair
    last: Pair
    change: Pair
    slope: Pair | None


def acceleration_rows(entry: AccelerometerEntry) -> list[AxisRow]:
    """An accelerometer's axes with U; the bias in m/s² and in thousandths of the stated gravity."""
    return rows_of(entry.scale, entry.bias_m_s2, entry.budget.expanded, too=1000 / entry.gravity_m_s2)


def field_rows(entry: MagnetometerEntry) -> list[AxisRow]:
    """A magnetometer's axes with U; the bias in µT."""
    return rows_of(entry.scale, entry.bias_t, entry.budget.expanded, size=MICRO)


def reversal_rows(entry: ReversalEntry) -> list[ReversalRow]:
    """The sensor's own bias, and the arm's field in its axes as it was mounted first, in µT, with U."""
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
    """The rows of a drift, in its own unit, with U."""
    bias, std = (np.array([getattr(each.scale_fixed, name) for each in entry.repeats]) for name in ("bias", "std"))
    whole = np.hypot(std, entry.common_std)  # what all repeats share is no part of a change
    changed, slope = largest_change_std(bias, std), entry.temperature_slope
    first, last, change = (
        expanded(each.tolist(), entry.degrees_of_freedom).widths for each in (whole[0], whole[-1], changed)
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
    """The length of it."""
    return math.hypot(*vector)

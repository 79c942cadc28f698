"""The numbers of a certificate in print: rounded, with their signs and units."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.recording.layout_keys import NOT_STATED
from rig.data.result_file import CheckEntry, GyroscopeEntry, VerificationEntry
from rig.report.findings.characteristic import Term
from rig.report.words.expanded_uncertainty import expanded
from rig.report.words.printed_values import percent, round_to_u

AXES = ("x", "y", "z")
DEG = math.degrees(1)
MAX_FINE_DEG_S = 1e-3


@dataclass(frozen=True, slots=True)
class Pair:
    """A value and its uncertainty, as texts."""

    value: str
    uncertainty: str


@dataclass(frozen=True, slots=True)
class AxisRow:
    """One axis: scale factor and bias, the bias also in a second unit, if any."""

    axis: str
    scale: Pair
    bias: Pair
    bias_too: Pair | None


@dataclass(frozen=True, slots=True)
class CheckRow:
    """One check as texts: the value and its U, the limit, and the probability of a false acceptance."""

    name: str
    value: str
    uncertainty: str
    limit: str
    false_acceptance: str
    passed: bool
    unit: str


def kind(part: str) -> str:
    """Return a part's name in the maker's spelling."""
    return part if part == NOT_STATED else part.removesuffix("_magnetometer").upper()


def pair(value: float, uncertainty: float) -> Pair:
    """Return a value and its uncertainty, rounded together; without an uncertainty the value has nine digits."""
    if not uncertainty > 0:
        return Pair(f"{value:.9g}".replace("-", "−"), "0")
    rounded_pair = round_to_u(value, uncertainty)
    return Pair(rounded_pair.value_text, rounded_pair.uncertainty_text)


def axis_rows(sensor: GyroscopeEntry) -> list[AxisRow]:
    """Return a row for each gyroscope axis, with U from the budget, or with the statistical uncertainty without one."""
    return rows_of(sensor.scale, sensor.bias_rad_s, _widths(sensor), too=degrees_of(sensor)[1])


def rows_of(
    scale: Sequence[float],
    bias: Sequence[float],
    widths: Sequence[float],
    *,
    size: float = 1.0,
    too: float | None = None,
) -> list[AxisRow]:
    """Return the certificate's row of each axis; `widths` (6,) are U of the scale factors, then of the biases.

    Biases are multiplied by `size` for print, and by `too`, if given, for a second unit.
    """

    def bias_in(unit: float, i: int) -> Pair:
        return pair(unit * bias[i], unit * widths[3 + i])

    return [
        AxisRow(axis, pair(scale[i], widths[i]), bias_in(size, i), None if too is None else bias_in(too, i))
        for i, axis in enumerate(AXES)
    ]


def degrees_of(sensor: GyroscopeEntry) -> tuple[str, float]:
    """Return the second unit of printed biases and its factor from rad/s: °/h if U is small, °/s otherwise."""
    return ("°/s", DEG) if DEG * max(_widths(sensor)[3:]) >= MAX_FINE_DEG_S else ("°/h", 3600 * DEG)


def _widths(sensor: GyroscopeEntry) -> Sequence[float]:
    if sensor.budget is None:
        return [sensor.covariance[i][i] ** 0.5 for i in range(6)]
    return sensor.budget.expanded


def check_row(check: CheckEntry) -> CheckRow:
    """Return the printed row of a check, with words for a missing value or limit."""
    value, uncertainty = ("not measured" if check.value is None else f"{check.value:.4g}"), "not stated"
    if check.value is not None and check.uncertainty:
        printed = pair(check.value, check.uncertainty)
        value, uncertainty = printed.value, printed.uncertainty
    limit = "not set" if check.limit is None else f"{check.limit:g}"
    risk = "–" if check.false_acceptance_probability is None else percent(check.false_acceptance_probability)
    return CheckRow(check.name, value, uncertainty, limit, risk, check.passed, check.unit)


def verification_rows(entry: VerificationEntry) -> Iterator[tuple[str, ...]]:
    """Yield the cells of each axis: its errors, in rad/s, against the reference before and after calibration.

    The order is RMS before and after, then the largest mean over a revolution before and after.
    """
    for i, axis in enumerate(AXES):
        yield (
            axis,
            "–" if entry.before is None else f"{entry.before.movement.rms_rad_s[i]:.5f}",
            f"{entry.after.movement.rms_rad_s[i]:.5f}",
            "–" if entry.before is None else _largest_turn([t.error_rad_s for t in entry.before.revolutions], i),
            _largest_turn([turn.error_rad_s for turn in entry.after.revolutions], i),
        )


def _largest_turn(errors: Sequence[Sequence[float]], axis: int) -> str:
    return f"{max(abs(error[axis]) for error in errors):.5f}" if errors else "–"


def pairs(term: Term) -> list[tuple[str, Pair]]:
    """Return a characteristic's numbers by label, with U, in the printed unit."""
    return [(label, pair(value, width)) for label, value, width in term.printed]


def earth_rate_rows(entry: EarthRateEntry) -> list[tuple[str, str, Pair]]:
    """Return the name, unit, and value with U of each number of the Earth's rate."""
    (k,) = expanded([1.0], entry.dofs(1)).factors
    std = np.sqrt(np.diag(entry.covariance_rad2_s2))
    rows = [("size", "rad/s", pair(entry.norm_rad_s, k * entry.norm_std_rad_s))]
    rows += [(axis, "rad/s", pair(entry.rate_rad_s[i], k * float(std[i]))) for i, axis in enumerate(AXES)]
    rows.append(("latitude", "°", pair(DEG * entry.latitude_rad, k * DEG * entry.latitude_std_rad)))
    if entry.heading_rad is not None and entry.heading_std_rad is not None:
        rows.append(("heading", "°", pair(DEG * entry.heading_rad % 360, k * DEG * entry.heading_std_rad)))
    return rows

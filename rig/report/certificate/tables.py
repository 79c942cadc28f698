"""The numbers of a certificate as they are printed: rounded, with their signs and units."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.budget_entries import BudgetEntry, ContributorEntry
from rig.data.earth_rate_entries import EarthRateEntry
from rig.data.result_file import CheckEntry, SensorEntry, VectorEntry, VerificationEntry
from rig.report.certificate.rounding import rounded

AXES = ("x", "y", "z")
ANGLES = ("yz", "zx", "xy")
NEGLIGIBLE = 0.001  # of every variance: lines below are summed up in one
NOTHING = 1e-12  # of a variance
ENOUGH_FREEDOM = 50.0  # degrees of it, for k = 2 to cover 95 % (EA-4/02 M:2022, annex E)
JOINT_FACTOR = 3.548  # of six values at once: √χ² of six degrees of freedom at 95 %
DEG = math.degrees(1)
FINE_DEG_S = 1e-3


@dataclass(frozen=True, slots=True)
class Pair:
    """A value and its uncertainty, as texts."""

    value: str
    uncertainty: str


@dataclass(frozen=True, slots=True)
class AxisRow:
    """One axis: scale factor and bias, the latter in two units."""

    axis: str
    scale: Pair
    bias: Pair
    bias_too: Pair


@dataclass(frozen=True, slots=True)
class BudgetRow:
    """One contributor: what it does to the axis it matters most to, and its share of that variance."""

    name: str
    kind: str
    distribution: str
    assumed: str
    freedom: str
    scale: str
    scale_share: str
    bias: str
    bias_share: str


@dataclass(frozen=True, slots=True)
class CheckRow:
    """One limit, and what was found."""

    name: str
    value: str
    uncertainty: str
    limit: str
    false_acceptance: str
    passed: bool
    unit: str


def kind(part: str) -> str:
    """What the maker calls it."""
    return part.removesuffix("_magnetometer").upper()


def pair(value: float, uncertainty: float) -> Pair:
    """Rounded together; a value that has no uncertainty at all is printed with nine digits."""
    if not uncertainty > 0:
        return Pair(f"{value:.9g}".replace("-", "−"), "0")
    found = rounded(value, uncertainty)
    return Pair(found.value_text, found.uncertainty_text)


def axis_rows(sensor: SensorEntry) -> list[AxisRow]:
    """With U of the budget; without one, with the standard deviation of the noise, which the page then calls so."""
    spread, (_, factor) = _spread(sensor), degrees_of(sensor)
    return [
        AxisRow(
            axis,
            pair(sensor.scale[i], spread[i]),
            pair(sensor.bias_rad_s[i], spread[3 + i]),
            pair(factor * sensor.bias_rad_s[i], factor * spread[3 + i]),
        )
        for i, axis in enumerate(AXES)
    ]


def degrees_of(sensor: SensorEntry) -> tuple[str, float]:
    """In which unit the biases are printed beside rad/s, and what takes rad/s there: hours where it is a fine one."""
    return ("°/s", DEG) if DEG * max(_spread(sensor)[3:]) >= FINE_DEG_S else ("°/h", 3600 * DEG)


def _spread(sensor: SensorEntry) -> Sequence[float]:
    return _noise(sensor) if sensor.budget is None else sensor.budget.expanded


def _noise(sensor: SensorEntry) -> list[float]:
    return [sensor.covariance[i][i] ** 0.5 for i in range(6)]


def budget_rows(budget: BudgetEntry, per_unit: float = 1.0) -> list[BudgetRow]:
    """The largest of three axes, largest shares first; all negligible ones in one line.

    Uncertainties of biases times `per_unit`.
    """
    lines = sorted(budget.contributors, key=lambda line: -max(line.share))
    rows = [_budget_row(line, per_unit) for line in lines if max(line.share) >= NEGLIGIBLE]
    small = [line for line in lines if max(line.share) < NEGLIGIBLE]
    if small:
        std = np.sqrt(np.sum(np.square([line.std for line in small]), axis=0))
        names = ", ".join(line.name for line in small)
        shares = np.square(std) / np.square(budget.std)
        rows.append(_row((f"below 0.1 %: {names}", "", "", "", ""), std, shares, per_unit))
    return rows


def _budget_row(line: ContributorEntry, per_unit: float) -> BudgetRow:
    stated = " (k = 2)" if line.distribution == "normal" else ""
    assumed = "from readings" if line.half_width is None else f"±{line.half_width:.3g} {line.unit}{stated}"
    said = line.name, line.kind, line.distribution, assumed, freedom_text(line.freedom)
    return _row(said, line.std, line.share, per_unit)


def _row(
    said: tuple[str, str, str, str, str], std: Sequence[float], share: Sequence[float], per_unit: float
) -> BudgetRow:
    numbers = [
        text
        for part, unit in ((slice(0, 3), 1.0), (slice(3, 6), per_unit))
        for text in (_part(unit * max(std[part]), max(share[part])), percent(max(share[part])))
    ]
    return BudgetRow(*said, *numbers)


def _part(std: float, share: float) -> str:
    """What is nothing but the arithmetic's rounding is not printed."""
    return "0" if share < NOTHING else small(std)


def small(value: float) -> str:
    """Two digits, in powers of ten."""
    if value == 0:
        return "0"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}\u00a0×\u00a010{str(int(exponent)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def percent(share: float) -> str:
    """Of the variance."""
    return "<\u00a00.1\u00a0%" if share < 0.001 else f"{100 * share:.1f}\u00a0%"


def freedom_text(freedom: float | None) -> str:
    """Degrees of freedom."""
    return "∞" if freedom is None or freedom > 1e4 else f"{freedom:.0f}"


def fewest_freedom(budget: BudgetEntry) -> float:
    """Effective degrees of freedom of the result that has the fewest."""
    return min(math.inf if each is None else each for each in budget.freedom)


def coverage_sentence(budget: BudgetEntry) -> str:
    """What k = 2 stands for: the sentence of EA-4/02 M:2022, 6.4, or that of its annex E where freedom is scarce."""
    k = f"{budget.coverage_factor:g}"
    begins = (
        "The reported expanded uncertainty of measurement is the standard uncertainty of measurement multiplied by the "
        f"coverage factor k\u00a0=\u00a0{k}, which for a "
    )
    freedom = fewest_freedom(budget)
    if freedom >= ENOUGH_FREEDOM:
        return f"{begins}normal distribution corresponds to a coverage probability of approximately 95 %."
    from scipy.special import stdtr

    covered = 1 - 2 * float(stdtr(freedom, -budget.coverage_factor))
    return (
        f"{begins}t-distribution with ν_eff\u00a0=\u00a0{freedom:.0f} effective degrees of freedom, the fewest "
        f"of any value here, corresponds to a coverage probability of approximately {100 * covered:.0f} %."
    )


def check_row(check: CheckEntry) -> CheckRow:
    """What was not measured or not limited reads so."""
    value, uncertainty = ("not measured" if check.value is None else f"{check.value:.4g}"), "not stated"
    if check.value is not None and check.uncertainty:
        found = pair(check.value, check.uncertainty)
        value, uncertainty = found.value, found.uncertainty
    limit = "not set" if check.limit is None else f"{check.limit:g}"
    risk = "–" if check.false_acceptance is None else percent(check.false_acceptance)
    return CheckRow(check.name, value, uncertainty, limit, risk, check.passed, check.unit)


def verification_rows(found: VerificationEntry) -> Iterator[tuple[str, ...]]:
    """Axis; RMS as found and as left; largest mean over a revolution as found and as left. All in rad/s."""
    for i, axis in enumerate(AXES):
        yield (
            axis,
            "–" if found.before is None else f"{found.before.movement.rms_rad_s[i]:.5f}",
            f"{found.after.movement.rms_rad_s[i]:.5f}",
            "–" if found.before is None else _largest_turn([t.error_rad_s for t in found.before.revolutions], i),
            _largest_turn([turn.error_rad_s for turn in found.after.revolutions], i),
        )


def _largest_turn(errors: Sequence[Sequence[float]], axis: int) -> str:
    return f"{max(abs(error[axis]) for error in errors):.5f}" if errors else "–"


def skew_rows(angles_rad: Sequence[float], stds_rad: Sequence[float]) -> list[tuple[str, Pair]]:
    """Angles by which the axes are off right ones, in degrees, with two standard deviations."""
    return [
        (name, pair(DEG * angle, 2 * DEG * std)) for name, angle, std in zip(ANGLES, angles_rad, stds_rad, strict=True)
    ]


def gravity_rows(vector: VectorEntry) -> list[tuple[str, list[Pair]]]:
    """What 1 m/s² along x, y, z of the flange adds to each axis' reading, in rad/s, with two standard deviations."""
    assert vector.g_sensitivity_rad_s_per_m_s2 is not None and vector.g_sensitivity_std_rad_s_per_m_s2 is not None
    rows = zip(
        AXES, vector.g_sensitivity_rad_s_per_m_s2, vector.g_sensitivity_std_rad_s_per_m_s2, strict=True
    )  # gravity points down where the specific force points up
    return [(axis, [pair(-g, 2 * std) for g, std in zip(row, stds, strict=True)]) for axis, row, stds in rows]


def earth_rate_rows(found: EarthRateEntry) -> list[tuple[str, str, Pair]]:
    """Name, unit, and value with two standard deviations."""
    std = np.sqrt(np.diag(found.covariance_rad2_s2))
    rows = [("size", "rad/s", pair(found.norm_rad_s, 2 * found.norm_std_rad_s))]
    rows += [(axis, "rad/s", pair(found.rate_rad_s[i], 2 * float(std[i]))) for i, axis in enumerate(AXES)]
    rows.append(("latitude", "°", pair(DEG * found.latitude_rad, 2 * DEG * found.latitude_std_rad)))
    if found.heading_rad is not None and found.heading_std_rad is not None:
        rows.append(("heading", "°", pair(DEG * found.heading_rad % 360, 2 * DEG * found.heading_std_rad)))
    return rows

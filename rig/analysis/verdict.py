"""Passed or failed: every limit beside what was measured. A measurement or a limit that is missing fails."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from rig.analysis.acceleration import AccelerometerResult
from rig.analysis.bias_drift import BiasDrift
from rig.analysis.clock import PPM, ClockCheck, worst_differences
from rig.analysis.verification import Verification
from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.data.settings import DecisionRule, Limits
from rig.estimation.arrays import Array
from rig.estimation.budget import Budget
from rig.estimation.coverage import COVERAGE_FACTOR, beyond, coverage_factors
from rig.estimation.estimate import Estimate


@dataclass(frozen=True, slots=True)
class Check:
    """One limit: it passes when `value` is a number not above `limit` less `guard`. `unit` belongs to all of them.

    `value` is None where nothing was measured, `limit` where none was set, `uncertainty` where the value has none. It
    is the expanded one, by `coverage_factor` and so many degrees of `freedom`. The `guard` is that uncertainty where
    the decision rule is the guard band (ILAC-G8, 4.2).
    """

    name: str
    value: float | None
    limit: float | None
    unit: str
    uncertainty: float | None = None
    guard: float = 0.0
    coverage_factor: float = COVERAGE_FACTOR
    freedom: float = math.inf

    @property
    def passed(self) -> bool:
        """False for a measurement that is missing or not a number, and without a limit."""
        if self.value is None or self.limit is None:
            return False
        return math.isfinite(self.value) and self.value <= self.limit - self.guard

    @property
    def false_acceptance(self) -> float | None:
        """The probability that what passed is beyond the limit all the same; None where nothing passed."""
        if self.value is None or self.limit is None or not self.uncertainty or not self.passed:
            return None
        return float(beyond((self.limit - self.value) * self.coverage_factor / self.uncertainty, self.freedom))


@dataclass(frozen=True, slots=True)
class Spread:
    """Expanded uncertainties (3,) with their coverage factors and degrees of freedom, (3,) each."""

    expanded: Array
    factors: Array
    freedom: Array


def judge(
    solutions: Mapping[str, Estimate],
    limits: Limits,
    budgets: Mapping[str, Budget] = MappingProxyType({}),
    rule: DecisionRule = "simple",
) -> tuple[Check, ...]:
    """The checks of every sensor, by sensor name; what the limits mean is said in the names.

    With a sensor's budget its combined uncertainties are judged, and values by the decision rule; else the noise alone.
    """
    return tuple(
        check
        for name, solution in solutions.items()
        for check in _checks(name, solution, limits, budgets.get(name), rule)
    )


def verification_checks(sensor: str, verification: Verification | None, limits: Limits) -> tuple[Check, ...]:
    """Calibrated readings against the reference: the worst axis, and the worst mean over a revolution.

    The reference in its turn is held against the arm, by the limit of those means: it may be the one that is wrong.
    None is a verification that did not happen.
    """
    rms = mean = known = None
    if verification is not None:
        rms = _largest(verification.after.movement.rms_rad_s)
        mean = _largest(np.array([turn.error_rad_s for turn in verification.after.revolutions]))
        known = verification.reference_error_rad_s
    return (
        Check(f"{sensor}.verification_rms", rms, limits.verification_rms_rad_s, "rad/s"),
        Check(f"{sensor}.verification_mean", mean, limits.verification_mean_rad_s, "rad/s"),
        Check(f"{sensor}.verification_reference", known, limits.verification_mean_rad_s, "rad/s"),
    )


def clock_checks(clocks: Sequence[ClockCheck]) -> tuple[Check, ...]:
    """Whether the clocks of a run agree: every two of them, or what is stated of them, to within what both may err.

    Of several recordings those in which they agree least, each pair for itself.
    """
    return tuple(
        Check(f"clocks_agree.{one}_and_{other}", each.size / PPM, each.limit / PPM, "ppm")
        for each in worst_differences(clocks)
        for one, other in [each.clocks]
    )


def acceleration_checks(
    sensor: str, result: AccelerometerResult, limits: Limits, rule: DecisionRule = "simple"
) -> tuple[Check, ...]:
    """An accelerometer's scale and bias, their standard deviations, gravity's size in attitudes that were held out.

    With a budget its combined uncertainties are judged; else the solution's, relative to the stated gravity.
    """
    std = np.sqrt(np.diag(result.covariance)) if result.budget is None else result.budget.std
    of = f"{sensor}.acceleration"
    scale, bias = (_twice(std[:3]), _twice(std[3:])) if result.budget is None else _spreads(result.budget)
    found = [
        _held(f"{of}_scale_deviation", (result.scale - 1, scale), limits.acceleration_scale_deviation, "1", rule),
        Check(f"{of}_scale_std", _largest(std[:3]), limits.acceleration_scale_std, "1"),
        _held(f"{of}_bias", (result.bias_m_s2, bias), limits.acceleration_bias_m_s2, "m/s²", rule),
        Check(f"{of}_bias_std", _largest(std[3:]), limits.acceleration_bias_std_m_s2, "m/s²"),
    ]
    if result.held_out is not None:
        limit = limits.acceleration_verification_m_s2
        found.append(Check(f"{of}_verification", result.held_out.rms_m_s2, limit, "m/s²"))
    return tuple(found)


def drift_checks(
    sensor: str, drifts: Mapping[Quantity, BiasDrift], limits: Limits, rule: DecisionRule = "simple"
) -> tuple[Check, ...]:
    """The largest change of a bias between any two repeats."""
    allowed: Mapping[Quantity, tuple[str, float | None, str]] = {
        RATE: ("bias_drift", limits.bias_drift_rad_s, "rad/s"),
        ACCELERATION: ("acceleration_bias_drift", limits.acceleration_bias_drift_m_s2, "m/s²"),
    }
    found = []
    for quantity, drift in drifts.items():
        name, limit, unit = allowed[quantity]
        held = drift.held
        std = held.largest_change_std
        spread = _twice(std) if drift.freedom is None else _by_freedom(std, drift.freedom)
        found.append(_held(f"{sensor}.{name}", (held.largest_change, spread), limit, unit, rule))
    return tuple(found)


def verdict(checks: Sequence[Check]) -> Literal["pass", "fail"]:
    """ "pass" when there are checks and all of them passed."""
    return "pass" if checks and all(check.passed for check in checks) else "fail"


def _checks(
    sensor: str, solution: Estimate, limits: Limits, budget: Budget | None, rule: DecisionRule
) -> tuple[Check, ...]:
    std = np.sqrt(np.diag(solution.covariance)) if budget is None else budget.std
    scale, bias = (None, None) if budget is None else _spreads(budget)
    return (
        _held(f"{sensor}.scale_deviation", (solution.scale - 1, scale), limits.scale_deviation, "1", rule),
        Check(f"{sensor}.scale_std", _largest(std[:3]), limits.scale_std, "1"),
        _held(f"{sensor}.bias", (solution.bias_rad_s, bias), limits.bias_rad_s, "rad/s", rule),
        Check(f"{sensor}.bias_std", _largest(std[3:]), limits.bias_std_rad_s, "rad/s"),
        Check(f"{sensor}.condition", _largest(np.array([solution.condition])), limits.condition, "1"),
    )


def _spreads(budget: Budget) -> tuple[Spread, Spread]:
    """Of scale factors and of biases; twice a standard uncertainty is taken for a normal distribution's."""
    freedom = budget.freedom if budget.by_freedom else np.full(6, np.inf)
    of = budget.expanded, budget.coverage_factors, freedom
    return Spread(*(each[:3] for each in of)), Spread(*(each[3:] for each in of))


def _twice(std: Array) -> Spread:
    """Of what has no budget."""
    return Spread(COVERAGE_FACTOR * std, np.full(3, COVERAGE_FACTOR), np.full(3, np.inf))


def _by_freedom(std: Array, freedom: Array) -> Spread:
    factors = coverage_factors(freedom)
    return Spread(factors * std, factors, freedom)


def _held(name: str, found: tuple[Array, Spread | None], limit: float | None, unit: str, rule: DecisionRule) -> Check:
    """Of values (3,) and their uncertainties that which comes nearest to its limit, and what the rule makes of it."""
    values, spread = found
    largest = _largest(values)
    if spread is None or largest is None:
        return Check(name, largest, limit, unit)
    guards = spread.expanded * (rule == "guard_band")
    worst = int(np.argmax(np.abs(values) + guards))
    of_the_worst = (float(each[worst]) for each in (spread.expanded, guards, spread.factors, spread.freedom))
    return Check(name, abs(float(values[worst])), limit, unit, *of_the_worst)


def _largest(values: np.ndarray) -> float | None:
    """The largest magnitude; None when any of them is not a number."""
    return float(np.abs(values).max()) if np.isfinite(values).all() else None

"""Passed or failed: every limit beside what was measured. A measurement or a limit that is missing fails."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from rig.analysis.check import Check, check_name, fitness
from rig.analysis.clock import PPM, ClockCheck, worst_differences
from rig.analysis.gyroscope.verification import Verification
from rig.analysis.reference.acceleration import AccelerometerResult
from rig.analysis.temperature.bias_drift import BiasDrift
from rig.config.judging.judged_by import DecisionRule
from rig.config.judging.limits import Limits, limit_of
from rig.data.meaning import Meaning
from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.gyroscope.estimate import Estimate
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, coverage_factors

CLOCKS = "clocks_agree"


@dataclass(frozen=True, slots=True)
class Spread:
    """Expanded uncertainties (3,) with their coverage factors and degrees of freedom, (3,) each."""

    expanded: Array
    factors: Array
    freedom: Array


@dataclass(frozen=True, slots=True)
class _Held:
    """One quantity of a sensor, held against its limits by a decision rule."""

    sensor: str
    quantity: str
    limits: Limits | None
    rule: DecisionRule = "simple"

    def check(self, what: str, value: float | None) -> Check:
        """The check of one limit."""
        row, limit = limit_of(self.limits, self.quantity, what)
        means = Meaning(row.kind, self.sensor, self.quantity, row.parameter, what=what)
        return Check(check_name(self.sensor, self.quantity, what), value, limit, row.unit, means)

    def nearest(self, what: str, values: Array, spread: Spread | None) -> Check:
        """The check of the value, of three, that comes nearest to its limit, and what the rule makes of it."""
        check = self.check(what, _largest(values))
        if spread is None or check.value is None:
            return check
        guards = spread.expanded * (self.rule == "guard_band")
        worst = int(np.argmax(np.abs(values) + guards))
        return replace(
            check,
            value=abs(float(values[worst])),
            uncertainty=float(spread.expanded[worst]),
            guard=float(guards[worst]),
            coverage_factor=float(spread.factors[worst]),
            freedom=float(spread.freedom[worst]),
        )

    def calibration(
        self, scale: Array, bias: Array, std: Array, spreads: tuple[Spread | None, Spread | None]
    ) -> tuple[Check, ...]:
        """The checks of scale and bias, (3,) each, and of their standard deviations (6,)."""
        return (
            self.nearest("scale_deviation", scale - 1, spreads[0]),
            self.check("scale_std", _largest(std[:3])),
            self.nearest("bias", bias, spreads[1]),
            self.check("bias_std", _largest(std[3:])),
        )

    def wanted(self, **expanded: Array) -> Iterator[Check]:
        """The checks of expanded uncertainties (3,) by their names, where somebody has said how large they may be."""
        for what, each in expanded.items():
            if limit_of(self.limits, self.quantity, what)[1] is not None:
                yield self.check(what, _largest(each))


def judge(
    solutions: Mapping[str, Estimate],
    limits: Limits | None,
    budgets: Mapping[str, Budget] = MappingProxyType({}),
    rule: DecisionRule = "simple",
) -> tuple[Check, ...]:
    """The checks of every gyroscope, by its name.

    With a sensor's budget its combined uncertainties are judged, and values by the decision rule; else the noise alone.
    """
    checks: list[Check] = []
    for name, solution in solutions.items():
        held, budget = _Held(name, "rate", limits, rule), budgets.get(name)
        std = np.sqrt(np.diag(solution.covariance)) if budget is None else budget.std
        spreads = (None, None) if budget is None else _spreads(budget)
        checks += held.calibration(solution.scale, solution.bias_rad_s, std, spreads)
        expanded = COVERAGE_FACTOR * std if budget is None else budget.expanded
        checks += held.wanted(scale_u=expanded[:3], bias_u=expanded[3:])
        checks.append(held.check("condition", _largest(np.array([solution.condition]))))
    return tuple(checks)


def verification_checks(sensor: str, verification: Verification | None, limits: Limits | None) -> tuple[Check, ...]:
    """Calibrated readings against the reference: the worst axis, and the worst mean over a revolution.

    The reference in its turn is held against the arm, by the limit of those means: it may be the one that is wrong.
    None is a verification that did not happen.
    """
    rms = mean = known = None
    if verification is not None:
        rms = _largest(verification.after.movement.rms_rad_s)
        mean = _largest(np.array([turn.error_rad_s for turn in verification.after.revolutions]))
        known = verification.reference_error_rad_s
    held, (_, largest) = _Held(sensor, "rate", limits), limit_of(limits, "rate", "verification_mean")
    return (
        held.check("verification_rms", rms),
        held.check("verification_mean", mean),
        fitness(sensor, "rate", "verification_reference", known, largest, unit="rad/s"),
    )


def clock_checks(clocks: Sequence[ClockCheck]) -> tuple[Check, ...]:
    """Whether the clocks of a run agree: every two of them, or what is stated of them, to within what both may err.

    Of several recordings those in which they agree least, each pair for itself.
    """
    means = Meaning("fitness", what=CLOCKS)
    return tuple(
        Check(f"{CLOCKS}.{one}_and_{other}", worst_difference.size / PPM, worst_difference.limit / PPM, "ppm", means)
        for worst_difference in worst_differences(clocks)
        for one, other in [worst_difference.clocks]
    )


def acceleration_checks(
    sensor: str, result: AccelerometerResult, limits: Limits | None, rule: DecisionRule = "simple"
) -> tuple[Check, ...]:
    """An accelerometer's scale and bias, their standard deviations, gravity's size in attitudes that were held out.

    The budget's combined uncertainties are judged.
    """
    held = _Held(sensor, "acceleration", limits, rule)
    checks = held.calibration(result.triad.scale, result.bias_m_s2, result.budget.std, _spreads(result.budget))
    return checks if result.held_out is None else (*checks, held.check("verification", result.held_out.rms_m_s2))


def drift_checks(
    sensor: str, drifts: Mapping[Quantity, BiasDrift], limits: Limits | None, rule: DecisionRule = "simple"
) -> tuple[Check, ...]:
    """The largest change of a bias between any two repeats."""
    checks = []
    for quantity, drift in drifts.items():
        std = drift.scale_fixed.largest_change_std
        spread = _by_freedom(std, drift.freedom)
        checks.append(
            _Held(sensor, quantity.name, limits, rule).nearest("bias_drift", drift.scale_fixed.largest_change, spread)
        )
    return tuple(checks)


def verdict(checks: Sequence[Check]) -> Literal["pass", "fail"]:
    """ "pass" when there are checks and all of them passed."""
    return "pass" if checks and all(check.passed for check in checks) else "fail"


def _spreads(budget: Budget) -> tuple[Spread, Spread]:
    """The spreads of scale factors and of biases; twice a standard uncertainty is taken for a normal distribution's."""
    of = budget.expanded, budget.coverage_factors, budget.freedom
    return Spread(*(each[:3] for each in of)), Spread(*(each[3:] for each in of))


def _twice(std: Array) -> Spread:
    """The spread of what has no budget: twice its standard deviation."""
    return Spread(COVERAGE_FACTOR * std, np.full(3, COVERAGE_FACTOR), np.full(3, np.inf))


def _by_freedom(std: Array, freedom: Array) -> Spread:
    factors = coverage_factors(freedom)
    return Spread(factors * std, factors, freedom)


def _largest(values: np.ndarray) -> float | None:
    """The largest magnitude; None when any of them is not a number."""
    return float(np.abs(values).max()) if np.isfinite(values).all() else None

"""The verdict: measured values against their limits. A missing measurement or limit fails."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

import numpy as np

from rig.analysis.check import Check, fitness, name_check
from rig.analysis.clock_comparison import PPM, ClockCheck, worst_differences
from rig.config.judging.judging_keys import DecisionRule
from rig.config.judging.verdict_limits import Limits, limit_of
from rig.data.meaning import Meaning
from rig.data.quantity import Quantity
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.gyroscope.estimate import Estimate
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, coverage_factors

if TYPE_CHECKING:
    from rig.analysis.gyroscope.verification import Verification
    from rig.analysis.reference.accelerometer import AccelerometerResult
    from rig.analysis.temperature.bias_drift import BiasDrift

CLOCKS = "clocks_agree"


@dataclass(frozen=True, slots=True)
class ExpandedUncertainty:
    """Expanded uncertainties of three axes, with their coverage factors and degrees of freedom, (3,) each."""

    expanded: Array
    factors: Array
    dof: Array


@dataclass(frozen=True, slots=True)
class _LimitSet:
    """The limits of one quantity of a sensor, and the decision rule."""

    sensor: str
    quantity: str
    limits: Limits | None
    rule: DecisionRule = "simple"

    def check(self, what: str, value: float | None) -> Check:
        """Return the check of `value` against the limit of the criterion `what`."""
        row, limit = limit_of(self.limits, self.quantity, what)
        means = Meaning(row.kind, self.sensor, self.quantity, row.parameter, what=what)
        return Check(name_check(self.sensor, self.quantity, what), value, limit, row.unit, means)

    def nearest(self, what: str, values: Array, uncertainty: ExpandedUncertainty | None) -> Check:
        """Return the check of the worst of three axes: the one with the largest |value| plus guard."""
        check = self.check(what, _largest_magnitude(values))
        if uncertainty is None or check.value is None:
            return check
        guards = uncertainty.expanded * (self.rule == "guard_band")
        worst = int(np.argmax(np.abs(values) + guards))
        return replace(
            check,
            value=abs(float(values[worst])),
            uncertainty=float(uncertainty.expanded[worst]),
            guard=float(guards[worst]),
            coverage_factor=float(uncertainty.factors[worst]),
            dof=float(uncertainty.dof[worst]),
        )

    def calibration(
        self,
        scale: Array,
        bias: Array,
        std: Array,
        uncertainties: tuple[ExpandedUncertainty | None, ExpandedUncertainty | None],
    ) -> tuple[Check, ...]:
        """Return the checks of `scale` (3,) and `bias` (3,), and of their standard uncertainties `std` (6,).

        `uncertainties` are the expanded ones of scale and of bias, None if there is no budget.
        """
        return (
            self.nearest("scale_deviation", scale - 1, uncertainties[0]),
            self.check("scale_std", _largest_magnitude(std[:3])),
            self.nearest("bias", bias, uncertainties[1]),
            self.check("bias_std", _largest_magnitude(std[3:])),
        )

    def check_expanded(self, **expanded: Array) -> Iterator[Check]:
        """Yield a check of each of the `expanded` uncertainties (3,) that has a limit; keywords name the criteria."""
        for what, uncertainty in expanded.items():
            if limit_of(self.limits, self.quantity, what)[1] is not None:
                yield self.check(what, _largest_magnitude(uncertainty))


def judge(
    solutions: Mapping[str, Estimate],
    limits: Limits | None,
    budgets: Mapping[str, Budget] = MappingProxyType({}),
    rule: DecisionRule = "simple",
) -> tuple[Check, ...]:
    """Return the checks of the solutions of all gyroscopes against `limits`.

    If a gyroscope has a budget, its combined uncertainties are judged, and the decision `rule` applies to the values.
    Otherwise only the uncertainty due to noise is judged.
    """
    checks: list[Check] = []
    for name, solution in solutions.items():
        limit_set, budget = _LimitSet(name, "rate", limits, rule), budgets.get(name)
        std = np.sqrt(np.diag(solution.covariance)) if budget is None else budget.std
        uncertainties = (None, None) if budget is None else _split_expanded(budget)
        checks += limit_set.calibration(solution.scale, solution.bias_rad_s, std, uncertainties)
        expanded = COVERAGE_FACTOR * std if budget is None else budget.expanded
        checks += limit_set.check_expanded(scale_u=expanded[:3], bias_u=expanded[3:])
        checks.append(limit_set.check("condition", _largest_magnitude(np.array([solution.condition]))))
    return tuple(checks)


def verification_checks(sensor: str, verification: "Verification | None", limits: Limits | None) -> tuple[Check, ...]:
    """Return the checks of the readings that the board has calibrated.

    They are of the largest RMS error of an axis, of the largest mean error in a revolution, and of the reference's own
    error, which may be the cause of these and has the limit of the mean error. If `verification` is None, the checks
    have no value, so they fail.
    """
    rms = mean = verified = None
    if verification is not None:
        rms = _largest_magnitude(verification.after.movement.rms_rad_s)
        mean = _largest_magnitude(np.array([turn.error_rad_s for turn in verification.after.revolutions]))
        verified = verification.reference_error_rad_s
    limit_set, (_, largest) = _LimitSet(sensor, "rate", limits), limit_of(limits, "rate", "verification_mean")
    return (
        limit_set.check("verification_rms", rms),
        limit_set.check("verification_mean", mean),
        fitness(sensor, "rate", "verification_reference", verified, largest, unit="rad/s"),
    )


def clock_checks(clocks: Sequence[ClockCheck]) -> tuple[Check, ...]:
    """Return a check for each pair of a run's clocks that they agree within their stated and measured uncertainty.

    Each is of the recording in which the two differ most.
    """
    means = Meaning("fitness", what=CLOCKS)
    return tuple(
        Check(f"{CLOCKS}.{one}_and_{other}", worst_difference.size / PPM, worst_difference.limit / PPM, "ppm", means)
        for worst_difference in worst_differences(clocks)
        for one, other in [worst_difference.clocks]
    )


def acceleration_checks(
    sensor: str, result: "AccelerometerResult", limits: Limits | None, rule: DecisionRule = "simple"
) -> tuple[Check, ...]:
    """Return the checks of an accelerometer's scale and bias, and of their combined uncertainties in the budget.

    If a repeat of the attitudes was left out of the solution, the error of gravity in these attitudes is checked too.
    """
    limit_set = _LimitSet(sensor, "acceleration", limits, rule)
    uncertainties = _split_expanded(result.budget)
    checks = limit_set.calibration(result.triad.scale, result.bias_m_s2, result.budget.std, uncertainties)
    return (
        checks if result.validation is None else (*checks, limit_set.check("verification", result.validation.rms_m_s2))
    )


def drift_checks(
    sensor: str, drifts: Mapping[Quantity, "BiasDrift"], limits: Limits | None, rule: DecisionRule = "simple"
) -> tuple[Check, ...]:
    """Return for each quantity a check of the largest change of its bias between any two repeats."""
    checks = []
    for quantity, drift in drifts.items():
        std = drift.scale_fixed.largest_change_std
        limit_set, uncertainty = _LimitSet(sensor, quantity.name, limits, rule), _expand(std, drift.dof)
        checks.append(limit_set.nearest("bias_drift", drift.scale_fixed.largest_change, uncertainty))
    return tuple(checks)


def verdict(checks: Sequence[Check]) -> Literal["pass", "fail"]:
    """Return "pass" if there are checks and all passed, else "fail"."""
    return "pass" if checks and all(check.passed for check in checks) else "fail"


def _split_expanded(budget: Budget) -> tuple[ExpandedUncertainty, ExpandedUncertainty]:
    """Return the expanded uncertainties of scale factors and of biases."""
    rows = budget.expanded, budget.coverage_factors, budget.dof
    return ExpandedUncertainty(*(row[:3] for row in rows)), ExpandedUncertainty(*(row[3:] for row in rows))


def _expand(std: Array, dof: Array) -> ExpandedUncertainty:
    factors = coverage_factors(dof)
    return ExpandedUncertainty(factors * std, factors, dof)


def _largest_magnitude(values: np.ndarray) -> float | None:
    """Return the largest magnitude; None if any of the values is not a number."""
    return float(np.abs(values).max()) if np.isfinite(values).all() else None

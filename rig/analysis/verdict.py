"""Passed or failed: every limit beside what was measured. A measurement or a limit that is missing fails."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.analysis.verification import Verification
from rig.data.settings import Limits
from rig.estimation.estimate import Estimate


@dataclass(frozen=True, slots=True)
class Check:
    """One limit: it passes when `value` is a number not above `limit`. `unit` belongs to both.

    `value` is None where nothing was measured, `limit` where none was set.
    """

    name: str
    value: float | None
    limit: float | None
    unit: str

    @property
    def passed(self) -> bool:
        """False for a measurement that is missing or not a number, and without a limit."""
        if self.value is None or self.limit is None:
            return False
        return math.isfinite(self.value) and self.value <= self.limit


def judge(solutions: Mapping[str, Estimate], limits: Limits) -> tuple[Check, ...]:
    """The checks of every sensor, by sensor name; what the limits mean is said in the names."""
    return tuple(check for name, solution in solutions.items() for check in _checks(name, solution, limits))


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


def verdict(checks: Sequence[Check]) -> Literal["pass", "fail"]:
    """ "pass" when there are checks and all of them passed."""
    return "pass" if checks and all(check.passed for check in checks) else "fail"


def _checks(sensor: str, solution: Estimate, limits: Limits) -> tuple[Check, ...]:
    std = np.sqrt(np.diag(solution.covariance))
    return (
        Check(f"{sensor}.scale_deviation", _largest(solution.scale - 1), limits.scale_deviation, "1"),
        Check(f"{sensor}.scale_std", _largest(std[:3]), limits.scale_std, "1"),
        Check(f"{sensor}.bias", _largest(solution.bias_rad_s), limits.bias_rad_s, "rad/s"),
        Check(f"{sensor}.bias_std", _largest(std[3:]), limits.bias_std_rad_s, "rad/s"),
        Check(f"{sensor}.condition", _largest(np.array([solution.condition])), limits.condition, "1"),
    )


def _largest(values: np.ndarray) -> float | None:
    """The largest magnitude; None when any of them is not a number."""
    return float(np.abs(values).max()) if np.isfinite(values).all() else None

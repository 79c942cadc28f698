"""The verdict: every limit is checked, and what was not measured does not pass."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from rig.analysis.check import Check
from rig.analysis.reference.accelerometer import AccelerometerResult
from rig.analysis.temperature.bias_drift import BiasDrift
from rig.analysis.verdict import (
    acceleration_checks,
    drift_checks,
    judge,
    verdict,
    verification_checks,
)
from rig.config.judging.judging_keys import DecisionRule
from rig.config.judging.verdict_limits import Limits
from rig.data.meaning import Meaning
from rig.data.quantity import RATE
from rig.estimation.gyroscope.accumulator import Solution
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.estimation.temperature.bias_by_repeat import BiasByRepeat

LIMITS = Limits(scale_deviation=0.3, scale_std=0.002, bias_rad_s=0.1, bias_std_rad_s=0.001, condition=100)
BIAS = Meaning("conformity", "gyro", "rate", "bias")
GOOD = Solution(
    estimator="newton",
    scale=np.array([1.1771, 1.1554, 0.9]),
    bias_rad_s=np.array([0.0077, -0.0100, -0.0051]),
    covariance=np.diag(np.array([9e-4, 8e-4, 8e-4, 6e-4, 7e-4, 6e-4]) ** 2),
    observations=6,
    rank=6,
    condition=1.07,
    iterations=2,
)


def test_a_good_calibration_passes_with_every_value_beside_its_limit() -> None:
    checks = judge({"gyro": GOOD}, LIMITS)
    assert verdict(checks) == "pass"
    assert [(check.name, check.value, check.limit, check.unit, check.passed) for check in checks] == [
        ("gyro.scale_deviation", pytest.approx(0.1771), 0.3, "1", True),
        ("gyro.scale_std", pytest.approx(9e-4), 0.002, "1", True),
        ("gyro.bias", pytest.approx(0.01), 0.1, "rad/s", True),
        ("gyro.bias_std", pytest.approx(7e-4), 0.001, "rad/s", True),
        ("gyro.condition", 1.07, 100, "1", True),
    ]


@pytest.mark.parametrize(
    ("solution", "name"),
    [
        (replace(GOOD, scale=np.array([1.0, 0.69, 1.0])), "gyro.scale_deviation"),
        (replace(GOOD, bias_rad_s=np.array([0.0, -0.11, 0.0])), "gyro.bias"),
        (replace(GOOD, covariance=np.diag([0, 0, 5e-6, 0, 0, 0])), "gyro.scale_std"),
        (replace(GOOD, covariance=np.diag([0, 0, 0, 0, 0, 2e-6])), "gyro.bias_std"),
        (replace(GOOD, condition=101.0), "gyro.condition"),
        (replace(GOOD, condition=float("inf")), "gyro.condition"),
        (replace(GOOD, scale=np.array([1.0, np.nan, 1.0])), "gyro.scale_deviation"),
    ],
)
def test_one_value_beyond_its_limit_or_missing_fails_the_run(solution: Solution, name: str) -> None:
    checks = judge({"reference": GOOD, "gyro": solution}, LIMITS)
    assert [check.name for check in checks if not check.passed] == [name]
    assert verdict(checks) == "fail"


@pytest.mark.parametrize("value", [None, float("nan"), float("inf"), 1.0001])
def test_a_measurement_that_is_missing_does_not_pass(value: float | None) -> None:
    assert not Check("gyro.bias", value, 1.0, "rad/s", BIAS).passed
    assert Check("gyro.bias", 1.0, 1.0, "rad/s", BIAS).passed


def test_without_a_limit_nothing_passes() -> None:
    """A limit that nobody set is no limit of zero, which a perfect reading would pass and `result.json` would state."""
    unset = LIMITS.model_copy(update={"verification_rms_rad_s": 0.1})
    checks = verification_checks("gyro", None, unset)
    assert [check.limit for check in checks] == [0.1, None, None]
    assert not Check("gyro.verification_mean", 0.0, None, "rad/s", BIAS).passed


def test_the_guard_band_keeps_the_expanded_uncertainty_away_from_the_limit() -> None:
    std = np.array([0.001, 0.001, 0.001, 4e-4, 4e-4, 4e-4])
    noise = Contributor("noise", "A", "normal", None, "", "", np.inf, np.diag(std**2))
    budgets = {"gyro": Budget((noise,))}
    near = replace(GOOD, bias_rad_s=np.array([0.0077, -0.0995, -0.0051]))
    simple, guarded = (judge({"gyro": near}, LIMITS, budgets, rule)[2] for rule in ("simple", "guard_band"))
    assert simple.passed and not guarded.passed
    assert simple.uncertainty == guarded.guard == pytest.approx(8e-4)
    assert simple.false_acceptance == pytest.approx(0.106, abs=0.001)  # 0.0005 is 1.25 standard uncertainties
    good = judge({"gyro": GOOD}, LIMITS, budgets, "guard_band")[2]
    assert good.passed and good.false_acceptance is not None and good.false_acceptance < 0.025


def test_an_uncertainty_known_from_few_readings_keeps_a_wider_guard_at_the_same_risk() -> None:
    std = np.array([0.001, 0.001, 0.001, 4e-4, 4e-4, 4e-4])
    scarce = Budget((Contributor("noise", "A", "normal", None, "", "", 5.0, np.diag(std**2)),))
    sure = Budget((Contributor("noise", "A", "normal", None, "", "", np.inf, np.diag(std**2)),))
    wide, twice = (judge({"gyro": GOOD}, LIMITS, {"gyro": each}, "guard_band")[2] for each in (scarce, sure))
    assert wide.guard == pytest.approx(2.649 * 4e-4, rel=1e-3)  # t of five degrees of freedom, EA-4/02, annex E
    assert twice.guard == pytest.approx(8e-4)
    assert wide.coverage_factor == pytest.approx(2.649, rel=1e-3) and twice.coverage_factor == 2.0
    assert replace(twice, limit=0.01 + 4e-4, guard=0.0).false_acceptance == pytest.approx(0.1587, abs=1e-4)  # as before
    just = replace(wide, limit=0.01 + wide.guard)
    assert just.passed and just.false_acceptance == pytest.approx((1 - 0.9545) / 2, rel=1e-3)


def test_nothing_measured_is_not_a_pass() -> None:
    assert verdict(judge({}, LIMITS)) == "fail"


def _line(name: str, scale: float, bias: float) -> Contributor:
    """Of a budget, by its standard uncertainties."""
    return Contributor(name, "A", "normal", None, "", "", np.inf, np.diag(np.square([scale] * 3 + [bias] * 3)))


FOREVER = np.full(3, np.inf)


@pytest.mark.parametrize(("rule", "passes"), [("simple", True), ("guard_band", False)])
def test_accelerometers_and_drifts_are_held_against_their_limits_with_their_uncertainty(
    rule: DecisionRule, passes: bool
) -> None:
    limits = Limits(
        **{name: limit for name, limit in LIMITS if limit is not None},
        acceleration_scale_deviation=0.02,
        acceleration_scale_std=1e-3,
        acceleration_bias_m_s2=0.5,
        acceleration_bias_std_m_s2=0.01,
        bias_drift_rad_s=1e-4,
    )
    found = SimpleNamespace(
        triad=SimpleNamespace(
            scale=np.array([1.0, 0.981, 1.0]), covariance=np.diag(np.square([6e-4] * 3 + [3e-3] * 3))
        ),
        bias_m_s2=np.array([0.1, 0.0, -0.495]),
        budget=Budget((_line("noise", 6e-4, 3e-3), _line("gravity", 13**0.5 * 1e-4, 7**0.5 * 1e-3))),
        validation=None,
    )
    checks = {check.name: check for check in acceleration_checks("a", cast(AccelerometerResult, found), limits, rule)}
    held = BiasByRepeat(
        np.array([[0.0, 0, 0], [9.5e-5, 0, 0], [4e-5, 0, 0]]), np.full((3, 3), 3e-6), np.ones(3), (), FOREVER
    )
    drift = cast(BiasDrift, SimpleNamespace(scale_fixed=held, dof=FOREVER))
    checks |= {check.name: check for check in drift_checks("a", {RATE: drift}, limits, rule)}
    for name, uncertainty in (
        ("a.acceleration_scale_deviation", 1.4e-3),
        ("a.acceleration_bias", 8e-3),
        ("a.bias_drift", 2 * 2**0.5 * 3e-6),  # of both repeats that it lies between
    ):
        check = checks[name]
        assert check.uncertainty == pytest.approx(uncertainty), name
        assert (check.passed, check.false_acceptance is not None) == (passes, passes), name
    assert checks["a.acceleration_scale_std"].passed and checks["a.acceleration_bias_std"].passed

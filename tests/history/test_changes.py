"""What has changed since another calibration: chance raises the alarm in 2 of 100 comparisons at most."""

import numpy as np
import pytest

from rig.estimation.statistics.coverage import coverage_factors
from rig.history.series import NO_CHANGE_PROBABILITY, changes_in
from rig.report.findings.history_records import Parameter

pytestmark = pytest.mark.slow

ALARMS = 1 - NO_CHANGE_PROBABILITY
PAIRS = 1500
# How many values a sensor has, and their degrees of freedom.
SENSORS = {
    "the demonstration's": [np.inf] * 19,
    "a few of few repeats": [*[np.inf] * 7, *[5.0] * 12],
    "all of very few repeats": [3.0] * 9,
    "one value": [np.inf],
}


def drawn(random: np.random.Generator, dof: np.ndarray, correlation: float, shift: float = 0.0) -> dict[str, Parameter]:
    """A calibration of values that are zero, their u as so few readings tell it; the first is off by `shift`."""
    common = np.sqrt(correlation) * random.standard_normal()
    errors = common + np.sqrt(1 - correlation) * random.standard_normal(len(dof))
    finite = np.where(np.isfinite(dof), dof, 1.0)
    found = np.where(np.isfinite(dof), np.sqrt(random.chisquare(finite) / finite), 1.0)
    errors[0] += shift
    factors = coverage_factors(dof)
    return {
        str(i): Parameter(str(i), errors[i], found[i], None, "1", coverage_factor=float(factors[i]))
        for i in range(len(dof))
    }


def alarms(pairs: list[tuple[dict[str, Parameter], dict[str, Parameter]]]) -> float:
    return float(np.mean([any(change.has_changed for change in changes_in([pair])[0]) for pair in pairs]))


@pytest.mark.thorough
@pytest.mark.one_in(4)
@pytest.mark.parametrize("correlation", [0.0, 0.9])
@pytest.mark.parametrize("sensor", SENSORS)
def test_an_undamaged_part_has_changed_in_one_of_fifty_comparisons_at_most(sensor: str, correlation: float) -> None:
    random, dof = np.random.default_rng(1), np.array(SENSORS[sensor])
    pairs = [(drawn(random, dof, correlation), drawn(random, dof, correlation)) for _ in range(PAIRS)]
    allowed = ALARMS + 3 * np.sqrt(ALARMS * (1 - ALARMS) / PAIRS)  # by chance of the draw
    share = alarms(pairs)
    print(f"{sensor}, correlation {correlation}: {share:.1%}")
    assert share <= allowed
    assert correlation or share > 0.006, "and the limit is no wider than it must be"


@pytest.mark.thorough
def test_all_values_of_a_run_are_one_comparison() -> None:
    random, dof = np.random.default_rng(2), np.full(12, np.inf)
    sensors = [[(drawn(random, dof, 0.0), drawn(random, dof, 0.0)) for _ in range(4)] for _ in range(400)]
    share = np.mean([any(each.has_changed for of in changes_in(pairs) for each in of) for pairs in sensors])
    assert share <= ALARMS + 3 * np.sqrt(ALARMS / 400)


def test_a_change_of_2_u_in_one_value_of_nineteen_is_reported() -> None:
    """2 U of the change: noise hides it in a quarter of the comparisons, and in none if it is what both results say."""
    random, dof = np.random.default_rng(3), np.full(19, np.inf)
    shift = 2 * 2 * np.sqrt(2)
    told = alarms([(drawn(random, dof, 0.0), drawn(random, dof, 0.0, shift)) for _ in range(400)])
    assert 0.70 < told < 0.85
    before = {str(i): Parameter(str(i), 0.0, 1.0, None, "1") for i in range(19)}
    (changes,) = changes_in([(before, before | {"7": Parameter("7", shift, 1.0, None, "1")})])
    assert [change.name for change in changes if change.has_changed] == ["7"]
    assert changes[7].normalised_error == pytest.approx(2.0) and changes[7].limit == pytest.approx(1.64, abs=0.01)

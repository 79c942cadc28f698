"""What is said of a series holds: against other programs where they say the same, by simulation where nobody does."""

import numpy as np
import pytest
from scipy import stats

from rig.estimation.arrays import Array
from rig.history.series import Change, days_to_limit
from rig.history.statistics.charts import MIN_RESULTS, Chart, chart
from rig.history.statistics.random_effects import fit
from rig.history.statistics.rig_effects import RigEffect, rig_effects
from rig.report.findings.history_records import Parameter

RIGS, SENSORS = ("A", "B"), ("s1", "s2", "s3", "s4")


def random(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def ones(n: int) -> Array:
    return np.ones((n, 1))


def line(days: Array) -> Array:
    return np.stack([np.ones_like(days), days], axis=1)


@pytest.mark.slow
def test_the_mean_and_the_spread_are_those_of_statsmodels() -> None:
    from statsmodels.stats.meta_analysis import combine_effects  # with pandas

    std = random(1).uniform(0.5, 1.5, 12)
    values = 3 + random(2).normal(size=12) * np.hypot(std, 2.0)
    found, other = fit(ones(12), values, std), combine_effects(values, std**2, method_re="dl", use_t=True)
    assert found.between_std**2 == pytest.approx(other.tau2)
    assert found.coefficients[0] == pytest.approx(other.mean_effect_re)
    scatter = max(1.0, other.scale_hksj_re)
    assert found.std[0] == pytest.approx(other.sd_eff_w_re * np.sqrt(scatter))


def test_of_equal_uncertainties_the_drift_is_the_line_of_ordinary_least_squares() -> None:
    days = np.sort(random(3).uniform(0, 400, 20))
    values = 1 + 2e-3 * days + random(4).normal(size=20)
    found, other = fit(line(days), values, np.full(20, 0.1)), stats.linregress(days, values)
    assert found.coefficients[1] == pytest.approx(other.slope)
    assert found.std[1] == pytest.approx(other.stderr)
    assert found.p_value(1) == pytest.approx(other.pvalue)


def test_an_uncertainty_is_never_below_what_the_values_say_of_themselves() -> None:
    found = fit(ones(6), np.full(6, 2.0), np.full(6, 0.3))
    assert found.between_std == 0
    assert found.std[0] == pytest.approx(0.3 / np.sqrt(6))


@pytest.mark.slow
@pytest.mark.parametrize("spread", [0.0, 2.0])
def test_a_drift_s_uncertainty_covers_it(spread: float) -> None:
    rng, covered = random(5), 0
    for _ in range(400):
        days, std = np.sort(rng.uniform(0, 100, 8)), rng.uniform(0.5, 1.5, 8)
        found = fit(line(days), 0.03 * days + rng.normal(size=8) * np.hypot(std, spread), std)
        covered += abs(found.coefficients[1] - 0.03) <= found.coverage_factor * found.std[1]
    assert covered / 400 >= 0.92


def test_too_few_values_determine_nothing() -> None:
    with pytest.raises(ValueError, match="do not determine"):
        fit(ones(1), np.ones(1), np.ones(1))


def test_deviations_are_those_of_student_from_the_results_before() -> None:
    values = random(6).normal(size=15)
    found = chart(values, np.full(15, 0.2)).deviation
    for i in range(MIN_RESULTS - 1, 15):
        before = values[:i]
        student = (values[i] - before.mean()) / (before.std(ddof=1) * np.sqrt(1 + 1 / i))
        assert found[i] == pytest.approx(stats.norm.ppf(stats.t.cdf(student, i - 1)), abs=1e-9)
    assert np.isnan(found[: MIN_RESULTS - 1]).all()


def test_one_bad_run_is_one_alarm() -> None:
    values = random(7).normal(size=60)
    values[40] += 1000
    found = chart(values, np.full(60, 0.2))
    assert np.flatnonzero(found.alarm[30:48]).tolist() == [10]


def test_a_jump_stays_out_of_control_until_somebody_acts() -> None:
    values = random(8).normal(size=80)
    values[40:] += 6
    found = chart(values, np.full(80, 0.2))
    assert found.alarm[40:].all()
    assert found.out_of_control


def test_equal_values_raise_no_alarm() -> None:
    assert not chart(np.full(30, 1.0123), np.full(30, 1e-5)).alarm.any()


def runs_to_alarm(found: Chart, begin: int) -> Array:
    """Of every serial that had none before: runs from `begin` to its first alarm; all there are if it has none."""
    quiet = ~found.alarm[:, :begin].any(axis=1)
    after = found.alarm[quiet, begin:]
    counted: Array = np.where(after.any(axis=1), after.argmax(axis=1) + 1.0, float(after.shape[1]))
    return counted


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize("equal", [True, False], ids=["equal uncertainties", "differing uncertainties"])
def test_false_alarms_are_300_runs_apart(thorough: bool, equal: bool) -> None:
    """From the first run that is judged on: what is not known of the process costs no false alarm."""
    shape, rng = (1000 if thorough else 250, 250), random(9)
    std = np.full(shape, 0.5) if equal else rng.uniform(0.5, 1.0, shape)
    found = chart(rng.normal(size=shape) * np.hypot(std, 0.8), std)
    runs, alarms = runs_to_alarm(found, MIN_RESULTS - 1), found.alarm.any(axis=1).sum()
    apart = runs.sum() / alarms
    print(f"{apart:.0f} runs between false alarms, {alarms} alarms")
    assert apart >= (300 if thorough else 240)  # of 170 alarms an eighth, 2σ, is chance


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize(("change", "most"), [("drift", 15), ("shift", 10)])
def test_a_drift_of_a_tenth_and_a_shift_of_one_sigma_are_found(thorough: bool, change: str, most: float) -> None:
    """A check standard of a year, then 0.1 σ a run, or 1 σ at once."""
    serials, before, rng = (1000 if thorough else 250), 250, random(10)
    values = rng.normal(size=(serials, before + 60))
    values[:, before:] += 0.1 * np.arange(1, 61) if change == "drift" else 1.0
    found = runs_to_alarm(chart(values, np.full(values.shape, 0.5)), before)
    print(f"{change}: {found.mean():.1f} ± {found.std() / np.sqrt(len(found)):.1f} runs, {len(found)} serials")
    assert found.mean() <= most + (0 if thorough else 0.8)


def test_results_agree_or_do_not() -> None:
    first, second = Parameter("kx", 1.0, 0.015, None, "1"), Parameter("kx", 1.05, 0.02, None, "1")
    assert Change("kx", "1", first, second).normalised_error == pytest.approx(1.0)
    assert Change("kx", "1", second, first).normalised_error == pytest.approx(1.0)


def test_the_recall_is_when_value_and_uncertainty_reach_the_limit() -> None:
    days = np.arange(0.0, 400, 20)
    drifting = fit(line(days), 1 + 1e-5 * days, np.full(len(days), 1e-7))
    ahead = days_to_limit(drifting, float(days[-1]), 1e-4, max_deviation=0.01, nominal=1.0)
    assert ahead is not None
    assert ahead == pytest.approx((0.01 - 1e-4) / 1e-5 - days[-1], abs=2)
    assert days_to_limit(drifting, float(days[-1]), 0.02, 0.01, 1.0) == 0
    still = fit(line(days), 1 + 0 * days, np.full(len(days), 1e-9))
    assert days_to_limit(still, float(days[-1]), 1e-4, 0.01, 1.0) is None


def shared(seed: int, runs: int = 5) -> tuple[list[str], list[str], Array, Array]:
    """Sensors that differ by percents, calibrated on both rigs; the clock of B is 40 ppm off."""
    rng = random(seed)
    of = {sensor: rng.normal() * 0.02 for sensor in SENSORS}
    rows = [(rig, sensor) for sensor in SENSORS for rig in RIGS for _ in range(runs)]
    std = np.full(len(rows), 20e-6)
    values = np.array([of[sensor] + 40e-6 * (rig == "B") for rig, sensor in rows])
    rigs, sensors = map(list, zip(*rows, strict=True))
    return rigs, sensors, values + rng.normal(size=len(rows)) * np.hypot(std, 5e-6), std


@pytest.mark.slow
def test_two_rigs_whose_clocks_differ_by_40_ppm_are_told_apart_from_four_shared_sensors() -> None:
    within = seen = 0
    for seed in range(200):
        (effect,) = rig_effects(*shared(seed))
        assert (effect.rig, effect.reference, effect.sensors) == ("B", "A", 4)
        within += abs(effect.value - 40e-6) < 3 * effect.std
        seen += effect.value > 3 * effect.std
    assert within >= 197 and seen >= 197


def test_the_two_way_fit_is_not_misled_by_who_calibrated_what() -> None:
    """B got the sensor that reads high more often: the mean of its results is no effect of B."""
    rigs, sensors = ["A", "A", "A", "B", "B", "B", "B"], ["low", "low", "high", "low", "high", "high", "high"]
    values = np.array([{"low": 0.0, "high": 0.05}[sensor] for sensor in sensors])
    values += 1e-6 * np.arange(7)
    (effect,) = rig_effects(rigs, sensors, values, np.full(7, 1e-5))
    assert abs(effect.value) < 1e-5


def test_rigs_that_share_no_sensor_have_no_effect_that_anybody_knows() -> None:
    found: tuple[RigEffect, ...] = rig_effects(["A", "A", "B", "B"], ["x", "x", "y", "y"], np.ones(4), np.ones(4))
    assert found == ()

"""The mean of a turn's readings and that of its rate, of arms that ripple and vibrate by any order of the turn."""

from dataclasses import dataclass

import numpy as np
import pytest

from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.statistics.mean import Mean
from rig.observation.statistics.spectral_lines import SIDEBANDS, harmonics
from rig.observation.turn_mean import SLOW_CYCLES, SampledTurn, turn_mean
from support.recordings.drawn_ripple import Ripple, drawn_ripple

AXIS = np.array([0.6, 0.0, 0.8])
SPEED_RAD_S, RATE_HZ = 1.05, 200.0
TURN_HZ = SPEED_RAD_S / (2 * np.pi)
SCALE, BIAS_RAD_S, NOISE_RAD_S, STEP_RAD_S = 1.07, np.array([0.01, -0.02, 0.005]), 4.5e-4, 1e-5
# these a scale factor was 12 to 42 standard uncertainties off by, where lines in the readings were fitted to the rate
SLOW_BESIDE_FAST = [((6, 11, 75), 0.037), ((5, 68, 82), 0.082), ((5, 6, 9), 0.05)]


@dataclass(frozen=True, slots=True)
class Sampled:
    """Readings (n, 3) of a turn, and the turn as the samples have it."""

    readings: Array
    turn: SampledTurn


def sampled(
    ripple: Ripple,
    seed: int,
    *,
    complete: bool = True,
    encoders_true: bool = True,
    lag_s: float = 0.0,
    noise_rad_s: float = NOISE_RAD_S,
    encoder_noise_rad: float = 0.0,
    rate_hz: float = RATE_HZ,
) -> Sampled:
    """Readings of a turn that begins and ends anywhere between two samples, by a sensor that lags."""
    rng = np.random.default_rng(seed)
    count = int(rate_hz / TURN_HZ)
    fraction = (np.arange(count, dtype=np.float64) + rng.uniform()) / (rate_hz / TURN_HZ)
    size = SPEED_RAD_S * ripple.fraction * np.sqrt(2 / len(ripple.orders))
    phases = rng.uniform(0, 2 * np.pi, len(ripple.orders))
    phases_seen = rng.uniform(0, 6, 3)

    def rates_at(fraction: Array) -> Array:
        uneven = size * np.sum(np.cos(2 * np.pi * np.outer(fraction, ripple.orders) + phases), axis=1)
        seen = np.cos(2 * np.pi * ripple.seen_hz / TURN_HZ * fraction[:, None] + phases_seen)
        found: Array = np.outer(SPEED_RAD_S + uneven, AXIS) + np.sqrt(2) * ripple.seen_rad_s * seen
        return found

    rates, late = rates_at(fraction), rates_at(fraction - lag_s * TURN_HZ)
    unseen = np.zeros((count, 3))
    for hertz in ripple.unseen_hz:
        wave = np.cos(2 * np.pi * hertz / TURN_HZ * fraction[:, None] + rng.uniform(0, 6, 3))
        unseen += ripple.unseen_rad_s * np.sqrt(2 / len(ripple.unseen_hz)) * wave
    readings = SCALE * (late + unseen) + BIAS_RAD_S + noise_rad_s * rng.standard_normal((count, 3))
    rates += rate_hz * encoder_noise_rad * np.outer(np.diff(rng.standard_normal(count + 1)), AXIS)
    turn = SampledTurn(
        fraction=fraction,
        rates_rad_s=rates,
        uneven_rad_s=rates @ AXIS - SPEED_RAD_S,
        regressors=harmonics(2 * np.pi * fraction, 2 * SIDEBANDS),
        sidebands=SIDEBANDS,
        closed=True,
        encoders_true=encoders_true,
        complete=complete,
    )
    return Sampled(np.round(readings / STEP_RAD_S) * STEP_RAD_S, turn)


def error(found: Mean, weights: Array, turn: SampledTurn) -> Array:
    """(3,) of the mean reading beside what turned by the same weights, in standard deviations."""
    off: Array = (found.mean - BIAS_RAD_S - SCALE * (weights @ turn.rates_rad_s)) / np.sqrt(found.variance)
    return off


@pytest.mark.slow
@pytest.mark.parametrize("lag_s", [0.0, 0.004])
@pytest.mark.parametrize(("orders", "fraction"), SLOW_BESIDE_FAST)
def test_a_slow_ripple_beside_faster_ones_is_in_both_means_alike(
    orders: tuple[int, ...], fraction: float, lag_s: float
) -> None:
    ripple = Ripple(orders, fraction, unseen_rad_s=1e-3, unseen_hz=(1.7,), seen_rad_s=1e-3, seen_hz=0.9)
    for seed in range(4):
        case = sampled(ripple, seed, lag_s=lag_s)
        found, weights = turn_mean(case.readings, Steps(STEP_RAD_S), case.turn)
        assert np.abs(error(found, weights, case.turn)).max() < 4.5
        assert weights.sum() == pytest.approx(1.0)


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.proof
def test_errors_are_as_large_as_is_stated_by_whatever_the_arm_ripples(thorough: bool) -> None:
    """Of orders from 1 to 400, near each other, near the turn's own and near the ends of the band."""
    found = []
    for seed in range(1000 if thorough else 60):
        ripple = drawn_ripple(np.random.default_rng([seed, 47]), TURN_HZ, [RATE_HZ])
        case = sampled(ripple, seed)
        mean, weights = turn_mean(case.readings, Steps(STEP_RAD_S), case.turn)
        found.append(error(mean, weights, case.turn))
    off = np.array(found)
    print(f"{len(off)} turns: RMS {np.sqrt(np.mean(off**2)):.3f}, largest {np.abs(off).max():.1f}")
    assert 0.85 < np.sqrt(np.mean(off**2)) < 1.15
    assert np.mean(np.abs(off) < 2) > 0.92


@pytest.mark.parametrize("complete", [True, False])
def test_where_nothing_vibrates_unseen_the_mean_rate_is_that_of_a_turn(*, complete: bool) -> None:
    """2π/T: exactly where the rate is taken out, and to the samples' ends of the turn where it turns evenly."""
    ripple = Ripple((6, 11), 0.0 if complete else 0.05, unseen_rad_s=0.0, unseen_hz=(2.0,), seen_rad_s=0.0, seen_hz=1.0)
    case = sampled(ripple, 1, complete=complete)
    _, weights = turn_mean(case.readings, Steps(STEP_RAD_S), case.turn)
    assert float(weights @ case.turn.rates_rad_s @ AXIS) == pytest.approx(SPEED_RAD_S, rel=1e-12)


def test_weights_that_would_amplify_the_noise_of_the_arms_angles_leave_slow_lines_in_the_mean() -> None:
    """Lines at 5.7 and 9.6 cycles, with their sidebands, leave weights that rise to thirteen times the mean."""
    ripple = Ripple(
        (60,), 0.001, unseen_rad_s=1e-3, unseen_hz=(5.67 * TURN_HZ, 9.64 * TURN_HZ), seen_rad_s=0.0, seen_hz=0.9
    )
    for seed in range(4):
        made = sampled(ripple, seed)
        found, weights = turn_mean(made.readings, Steps(STEP_RAD_S), made.turn)
        assert (found.cycles < SLOW_CYCLES).any() and len(found.cycles) >= 2
        assert np.linalg.norm(np.diff(weights, prepend=0, append=0)) * len(weights) < 5 * np.sqrt(2)
        assert np.abs(error(found, weights, made.turn)).max() < 3


@pytest.mark.parametrize("cycles", [5.5, 7.4])
def test_weights_that_hardly_amplify_the_noise_of_the_arms_angles_cancel_a_slow_line(cycles: float) -> None:
    ripple = Ripple((50, 100), 0.003, unseen_rad_s=2.8e-3, unseen_hz=(cycles * TURN_HZ,), seen_rad_s=0.0, seen_hz=1.0)
    made = sampled(ripple, 0, noise_rad_s=3e-4, encoder_noise_rad=2.4e-5)
    _, weights = turn_mean(made.readings, Steps(STEP_RAD_S), made.turn)
    assert abs(weights @ np.exp(2j * np.pi * cycles * made.turn.fraction)) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("cycles", [6.4, 6.99, 7.4])
def test_a_slow_vibration_beside_fast_ones_is_one_line(cycles: float) -> None:
    """The encoders see another slow ripple; the noise of the gyroscope is above theirs."""
    ripple = Ripple(
        (50, 100), 0.003, unseen_rad_s=2.8e-3, unseen_hz=(cycles * TURN_HZ, 27.3), seen_rad_s=3e-3, seen_hz=2 * TURN_HZ
    )
    for seed in range(4):
        case = sampled(ripple, seed, noise_rad_s=3e-4, encoder_noise_rad=2.4e-5)
        mean, weights = turn_mean(case.readings, Steps(STEP_RAD_S), case.turn)
        slow = mean.cycles[mean.cycles < 20]
        assert slow == pytest.approx([cycles], abs=0.05)
        assert np.abs(error(mean, weights, case.turn)).max() < 3.5


@pytest.mark.slow
def test_errors_of_turns_of_few_readings_are_as_stated() -> None:
    """Turns of 45 to 120 readings without a filter: where no lines were sought, 83 % of the means were within U."""
    errors = []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        count = int(rng.integers(45, 120))
        orders = rng.choice(np.arange(10, int(0.45 * count)), rng.integers(1, 4), replace=False)
        unseen_hz = tuple((rng.uniform(9, 0.47 * count, rng.integers(1, 3)) * TURN_HZ).tolist())
        unseen_rad_s = float(10 ** rng.uniform(-3.7, -2.5))
        seen_hz = float(rng.uniform(3, 20))
        ripple = Ripple(tuple(orders.tolist()), rng.uniform(0.001, 0.02), unseen_rad_s, unseen_hz, 1e-4, seen_hz)
        case = sampled(ripple, seed, noise_rad_s=5.5e-5, encoder_noise_rad=1e-5, rate_hz=count * TURN_HZ)
        errors.append(error(*turn_mean(case.readings, Steps(STEP_RAD_S), case.turn), case.turn))
    assert np.mean(np.abs(errors) < 2) > 0.87


@pytest.mark.slow
def test_noise_of_the_encoders_beside_an_unseen_vibration_is_no_slow_line() -> None:
    """Both ends of the turn leave 11 ppm of the mean rate; false slow lines left 250 ppm, 670 at most."""
    ripple = Ripple((100, 200), 0.005, unseen_rad_s=4e-3, unseen_hz=(13.3,), seen_rad_s=1e-3, seen_hz=26.8)
    for seed in range(6):
        case = sampled(ripple, seed, noise_rad_s=5.5e-5, encoder_noise_rad=5e-5)
        _, weights = turn_mean(case.readings, Steps(STEP_RAD_S), case.turn)
        assert float(weights @ case.turn.rates_rad_s @ AXIS) == pytest.approx(SPEED_RAD_S, rel=5e-5)

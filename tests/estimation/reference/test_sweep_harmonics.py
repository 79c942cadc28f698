"""From a revolution's samples to mean, cosine and sine: ripple, encoder steps, a clock that errs."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import DELAY, LEVER, NO_DWELLS, Movement, jacobian, predicted
from rig.estimation.reference.imu import solve_imu
from rig.estimation.reference.imu_fit import covariance_bound
from rig.estimation.reference.reference_model import BIAS, REFERENCE
from rig.estimation.reference.sweep_harmonics import FirstHarmonic, JointTurn, first_harmonic
from rig.observation.statistics.vibration_noise import fit_inflation, line_columns
from support.motions.arm_attitudes import draw_true_arm
from support.motions.arm_sweeps import (
    MICRO_G,
    Samples,
    Sampling,
    Truth,
    make_sweeps,
    plan_sweeps,
    record_samples,
    record_sweeps,
)

NORM = 9.80665
TRUTH = Truth(
    matrix=np.array([[1.013, 0.004, -0.011], [-0.006, 0.985, 0.008], [0.009, -0.012, 1.021]]),
    bias_m_s2=np.array([0.31, -0.22, 0.12]),
    reference_m_s2=NORM * np.array([0.02, -0.01, 1.0]) / np.linalg.norm([0.02, -0.01, 1.0]),
    lever_arm_m=np.array([0.025, 0.01, 0.03]),
    delay_s=0.004,
)
EXACT = draw_true_arm(0.0, np.random.default_rng(0))


def sampling(density_ug: float, vibration: float = 0.05) -> Sampling:
    return Sampling(noise_m_s2=density_ug * MICRO_G * np.sqrt(Sampling(0.0).rate_hz), vibration=vibration)


def reduced(samples: Samples) -> FirstHarmonic:
    return reduced_with(samples, samples.readings_m_s2, lambda _: 1.0)


def reduced_with(
    samples: Samples, readings_m_s2: Array, coloured: Callable[[Array], float], swayed_m_s2: Array | None = None
) -> FirstHarmonic:
    return first_harmonic(
        samples.time_s,
        readings_m_s2,
        samples.turn,
        np.zeros_like(readings_m_s2) if swayed_m_s2 is None else swayed_m_s2,
        coloured=coloured,
        swings=line_columns,
    )


def revolution(seed: int, density_ug: float, vibration: float = 0.05, sweep: int = 3) -> Samples:
    rng = np.random.default_rng(seed)
    return record_samples(TRUTH, EXACT, plan_sweeps(6)[sweep], sampling(density_ug, vibration), rng)


@pytest.mark.kernels
@pytest.mark.slow
@pytest.mark.parametrize("sweep", range(12))
def test_vibration_neither_turns_the_result_nor_counts_as_noise(sweep: int) -> None:
    """ADIS16465: at 0.2 m from the axis a ripple of 5 % is 50 mg, its noise 0.35 mg a sample."""
    samples = revolution(sweep, 23.0, sweep=sweep)
    still, shaken = reduced(revolution(sweep, 23.0, vibration=0.0, sweep=sweep)), reduced(samples)
    np.testing.assert_allclose(shaken.noise_m_s2, sampling(23.0).noise_m_s2, rtol=0.15)
    off = (shaken.harmonic_m_s2 - still.harmonic_m_s2).ravel() / np.sqrt(np.diag(shaken.covariance_m2_s4))
    assert np.abs(off).max() < 6
    assert shaken.speed_rad_s == pytest.approx(still.speed_rad_s, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("vibration", [0.0, 1e-12, 0.002])
def test_a_speed_that_changes_slowly_takes_nothing_from_gravity(vibration: float) -> None:
    """Once a turn by 0.2 % it is felt as 60 µg; a regression on it could take half of gravity along."""
    slow = replace(sampling(0.0, vibration), cycles=(1,), encoder_step_rad=1e-15)
    even = replace(slow, vibration=0.0)
    found, expected = (
        reduced(record_samples(TRUTH, EXACT, plan_sweeps(6)[3], each, np.random.default_rng(1)))
        for each in (slow, even)
    )
    np.testing.assert_allclose(found.harmonic_m_s2, expected.harmonic_m_s2, atol=1e-9 + 0.6 * vibration)
    assert np.abs(expected.harmonic_m_s2).max() > 9


@pytest.mark.one_in(4)
@pytest.mark.slow
@pytest.mark.parametrize("cycles", [(1, 4), (1,), (2,), (3,)])
def test_what_a_slow_ripple_adds_is_what_the_model_makes_of_the_same_weights(cycles: tuple[int, ...]) -> None:
    """Centripetal, Euler and, by the lag, gravity: 5 % of the speed once a turn is felt as 20 mm/s²."""
    rippled, even = (
        replace(sampling(0.0), cycles=cycles, encoder_step_rad=1e-15, clock_error_s=0.0),
        replace(sampling(0.0, 0.0), encoder_step_rad=1e-15, clock_error_s=0.0),
    )
    sweeps = plan_sweeps(6)
    off = []
    for each in (rippled, even):
        turns = [reduced(record_samples(TRUTH, EXACT, sweep, each, np.random.default_rng(1))) for sweep in sweeps]
        read = make_sweeps(
            np.array([turn.harmonic_m_s2 for turn in turns]), np.tile(np.eye(9), (len(turns), 1, 1)), sweeps
        )
        read = replace(read, turning_rad2_s2=np.array([turn.turning_rad2_s2 for turn in turns]))
        movement = Movement(NO_DWELLS, read)
        off.append(movement.readings() - predicted(TRUTH.theta(), movement))
    assert np.abs(off[0] - off[1]).max() < 6e-5  # α is a mean over 2°


@pytest.mark.one_in(2)  # the orders between: `make proof`
@pytest.mark.kernels
@pytest.mark.slow
@pytest.mark.parametrize("cycles", [(50,), (6.5,), (5.4, 9.1), (50.3,), (97.4,)])
def test_a_ripple_of_any_order_leaves_the_mean_of_a_turn_right(cycles: tuple[float, ...]) -> None:
    """The mean of α, as the speed differs at both ends of a turn, and of ω², which one frequency alone could hide."""
    rippled = replace(sampling(23.0), cycles=cycles, encoder_step_rad=83e-6, rate_hz=100.0, clock_error_s=0.0)
    found: list[Array] = []
    stated: list[Array] = []
    for seed, sweep in enumerate(plan_sweeps(6)):
        turn = reduced(record_samples(TRUTH, EXACT, sweep, rippled, np.random.default_rng(seed)))
        read = make_sweeps(turn.harmonic_m_s2[None], np.eye(9)[None], (sweep,))
        movement = Movement(NO_DWELLS, replace(read, turning_rad2_s2=turn.turning_rad2_s2[None]))
        found.append((movement.readings() - predicted(TRUTH.theta(), movement)).reshape(3, 3)[0])
        stated.append(turn.covariance_m2_s4.diagonal()[:3])
    noise = sampling(23.0).noise_m_s2 / np.sqrt(600)
    assert np.sqrt(np.mean(np.square(found))) < 2 * noise, cycles
    assert np.sqrt(np.mean(np.square(found) / stated)) < 2, cycles


def test_the_model_s_derivatives_are_those_of_its_readings_in_an_uneven_turn() -> None:
    rng = np.random.default_rng(3)
    sweeps = make_sweeps(np.zeros((12, 3, 3)), np.tile(np.eye(9), (12, 1, 1)), plan_sweeps(6))
    uneven = 0.1 * sweeps.speeds_rad_s[:, None, None] ** 2 * rng.standard_normal((12, 6, 3))
    movement = Movement(NO_DWELLS, replace(sweeps, turning_rad2_s2=sweeps.turning_rad2_s2 + uneven))
    theta, step = TRUTH.theta(), 1e-6
    by_step = [
        (predicted(theta + way, movement) - predicted(theta - way, movement)).ravel() / (2 * step)
        for way in step * np.eye(len(theta))
    ]
    np.testing.assert_allclose(jacobian(theta, movement), np.transpose(by_step), atol=1e-6)


@pytest.mark.slow
@pytest.mark.proof
def test_the_stated_covariance_is_the_scatter(thorough: bool) -> None:
    found = [reduced(revolution(seed, 300.0)) for seed in range(40 if thorough else 16)]
    scatter = np.std([each.harmonic_m_s2.ravel() for each in found], axis=0)
    stated = np.sqrt(np.mean([np.diag(each.covariance_m2_s4) for each in found], axis=0))
    assert np.sqrt(np.mean((scatter / stated) ** 2)) == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
def test_coloured_noise_widens_the_covariance() -> None:
    samples = revolution(1, 300.0)
    white = reduced(samples)
    wide = reduced_with(samples, samples.readings_m_s2, lambda _: 4.0)
    np.testing.assert_allclose(wide.covariance_m2_s4, 4 * white.covariance_m2_s4)


@pytest.mark.slow
def test_a_vibration_in_one_direction_says_nothing_of_the_noise_across_it(thorough: bool) -> None:
    """2.4 mg at 14 Hz that no encoder sees: in x and z nearly all that is read, and of a turn's mean hardly any."""
    rng = np.random.default_rng(4)
    still = reduced(revolution(0, 0.0)).harmonic_m_s2
    squares = []
    for seed in range(40 if thorough else 15):
        samples = revolution(seed, 23.0)
        wave = 2400 * MICRO_G * np.sin(2 * np.pi * (14.0 * samples.time_s + rng.uniform()))
        shaken = samples.readings_m_s2 + wave[:, None] * np.array([0.65, 0.0, -0.76])
        found = reduced_with(samples, shaken, fit_inflation)
        off = (found.harmonic_m_s2 - still).ravel()
        squares.append(off @ np.linalg.solve(found.covariance_m2_s4, off) / 9)
        np.testing.assert_allclose(found.noise_m_s2, sampling(23.0).noise_m_s2, rtol=0.15)
    assert (0.7 if thorough else 0.55) < np.mean(squares) < (1.4 if thorough else 1.7)


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize(("part", "density_ug"), [("MPU-9250", 300.0), ("ADIS16465", 23.0), ("LSM9DS1", 150.0)])
def test_a_calibration_from_samples_reaches_the_bound_of_their_noise(part: str, density_ug: float) -> None:
    """Ripple, encoder steps, a clock that is late by 0.2 ms: this is part of the delay."""
    sweeps, theta = plan_sweeps(6), TRUTH.theta()
    ideal = record_sweeps(TRUTH, EXACT, sweeps, density_ug, np.random.default_rng(0))
    bound = np.diag(covariance_bound(theta, Movement(NO_DWELLS, ideal), 0.0)[0])
    theta[DELAY] += Sampling(0.0).clock_error_s
    off = []
    stated = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        turns = [reduced(record_samples(TRUTH, EXACT, sweep, sampling(density_ug), rng)) for sweep in sweeps]
        harmonics, covariances = (
            np.array([getattr(turn, name) for turn in turns]) for name in ("harmonic_m_s2", "covariance_m2_s4")
        )
        turning = np.array([turn.turning_rad2_s2 for turn in turns])
        recorded = replace(make_sweeps(harmonics, covariances, sweeps), turning_rad2_s2=turning)
        solution = solve_imu(NO_DWELLS, recorded, gravity_m_s2=NORM)
        assert solution.lever_arm_m is not None and solution.delay_s is not None
        found = np.concatenate([solution.matrix.ravel(), solution.reference_m_s2, solution.bias_m_s2])
        off.append(np.concatenate([found, solution.lever_arm_m, [solution.delay_s]]) - theta[: DELAY + 1])
        stated.append(np.diag(solution.covariance)[: DELAY + 1])
    of_reference = range(REFERENCE.start, REFERENCE.stop)
    variances = np.delete(stated, of_reference, axis=1)
    squares = np.delete(np.square(off), of_reference, axis=1)
    over_stated = float(np.sqrt(np.mean(squares / variances)))
    over_bound = float(np.sqrt(np.mean(squares / np.delete(bound[: DELAY + 1], of_reference))))
    bias, lever, delay = (np.sqrt(np.mean(np.square(off)[:, place])) for place in (BIAS, LEVER, DELAY))
    print(f"\n{part}: bias {bias / MICRO_G:.3g} µg, lever arm {1e3 * lever:.2g} mm, delay {1e6 * delay:.3g} µs")
    print(f"  over bound {over_bound:.2f}, over stated {over_stated:.2f}")
    assert over_bound < 1.15 and 0.85 < over_stated < 1.2


def test_half_a_revolution_is_refused() -> None:
    samples = revolution(1, 300.0)
    half = slice(0, len(samples.time_s) // 2)
    turn = samples.turn
    turn = JointTurn(turn.speed_rad_s, turn.angle_rad[half], turn.acceleration_rad_s2[half])
    with pytest.raises(Fault, match="incomplete_revolution"):
        reduced(Samples(samples.time_s[half], samples.readings_m_s2[half], turn))


def test_what_is_no_number_is_refused() -> None:
    samples = revolution(1, 300.0)
    samples.readings_m_s2[7, 1] = np.nan
    with pytest.raises(Fault, match="not_finite"):
        reduced(samples)


@pytest.mark.slow
def test_a_sway_of_other_joints_is_read_along_the_true_axes_of_the_sensor() -> None:
    """Sensors are mounted askew by degrees: along nominal axes a sway of 2 mrad would be wrong by a mm/s²."""
    sweeps, even = plan_sweeps(6), replace(sampling(0.0, 0.0), encoder_step_rad=1e-15)
    turns = []
    for sweep in sweeps:
        samples = record_samples(TRUTH, EXACT, sweep, even, np.random.default_rng(1))
        fraction = (samples.time_s - samples.time_s[0]) / np.ptp(samples.time_s)
        swayed_m_s2 = 0.02 * np.sin(2 * np.pi * np.outer(fraction, [1.05, 0.6, 2.05]) + [0.0, 1.0, 2.0])
        readings_m_s2 = samples.readings_m_s2 + swayed_m_s2 @ TRUTH.matrix.T
        turns.append([reduced(samples), reduced_with(samples, readings_m_s2, lambda _: 1.0, swayed_m_s2)])
    off_m_s2 = []
    for still in (True, False):
        harmonics = [steady if still else swaying for steady, swaying in turns]
        read = make_sweeps(np.array([turn.harmonic_m_s2 for turn in harmonics]), np.tile(np.eye(9), (12, 1, 1)), sweeps)
        swayed_m_s2 = np.array([turn.swayed_m_s2 for turn in harmonics])
        movement = Movement(NO_DWELLS, replace(read, swayed_m_s2=swayed_m_s2))
        off_m_s2.append(movement.readings() - predicted(TRUTH.theta(), movement))
    np.testing.assert_allclose(off_m_s2[1], off_m_s2[0], atol=1e-6)
    assert np.abs(turns[0][1].swayed_m_s2).max() > 0.005

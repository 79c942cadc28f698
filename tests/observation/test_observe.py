"""From a recording to averaged revolutions: clocks, whole turns, noise without vibration, refusals by name."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.data.quantity import RATE
from rig.data.recording.recorded_events import Event, SweepFinished, SweepStarted
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.motion.state_rows import ARM_STATE_DTYPE
from rig.observation.clocks.clock_estimate import estimate_time_base
from rig.observation.clocks.time_base import TimeBase
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.observe import SensorObservations
from rig.observation.observed_run import observe_run
from rig.observation.statistics.coloured_noise import correlation_inflation, fit_noise_factor
from rig.observation.windows import swept
from rig.report.entries.gyroscope import sensor_entry
from support.recordings.recorded import change_channel
from support.recordings.solving import solve_runs
from support.recordings.synthetic_run import (
    BIAS_RAD_S,
    SENSITIVITY,
    Motion,
    Setup,
    readings,
    run_data,
    sample_times,
    synthetic_run,
    true_rate,
    truth,
)

USUAL = synthetic_run(Setup())
ROUGH_ORDERS = (18, 31, 50)  # of a ripple much larger than that of real arms
SETTINGS = USUAL.settings.observation


def look(run: RunData, settings: ObservationThresholds = SETTINGS) -> SensorObservations:
    return observe_run(run, settings).sensors["gyro"]


def feeling_gravity(run: RunData, rad_s_per_g: float) -> RunData:
    """The same readings, as of a sensor whose first axis feels 1 g that turns with each sweep."""
    samples = run.samples["gyro"].copy()
    seen = look(run)
    time_s = seen.time_base.controller_time_s(samples["board_time_us"] * 1e-6)
    for turn in seen.revolutions:
        inside = (time_s >= turn.average.start_s) & (time_s <= turn.average.end_s)
        felt = rad_s_per_g * np.cos(turn.speed_rad_s * (time_s[inside] - turn.average.start_s))
        samples["counts"][inside, 0] += np.round(felt / SENSITIVITY).astype(np.int16)
    return replace(run, samples={"gyro": samples})


@pytest.mark.slow
def test_gravity_that_turns_with_the_sensor_is_no_noise() -> None:
    """0.3 °/s/g of a sensor with a noise of 0.002 rad/s: over a revolution nothing of it is left in the mean."""
    quiet = synthetic_run(Setup(noise_rad_s=0.002))
    felt = look(feeling_gravity(quiet, np.radians(0.3)))
    for without, turn in zip(look(quiet).revolutions, felt.revolutions, strict=True):
        std = np.sqrt(without.average.variance_rad2_s2)
        assert turn.average.noise_rad_s == pytest.approx(without.average.noise_rad_s, rel=0.02)
        assert np.sqrt(turn.average.variance_rad2_s2) == pytest.approx(std, rel=0.1)
        assert np.all(np.abs(turn.average.mean_rad_s - without.average.mean_rad_s) < 0.3 * std)


def clock_errors(setup: Setup, clock: TimeBase) -> tuple[float, float]:
    """Offset (s) and drift, found less true."""
    return clock.offset_s - (setup.boot_s + setup.drift * clock.reference_s), clock.drift - setup.drift


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize(
    "setup",
    [
        Setup(),
        Setup(boot_s=99.9, drift=400e-6),  # the board was switched on after the arm
        Setup(boot_s=-3e6),  # … and 35 days before
        Setup(vibration=0.0),  # only the ramps tell the time
        Setup(speed_deg_s=10.0, rest_s=0.5),
        Setup(noise_rad_s=0.2),
        Setup(state_rate_hz=500.0, sample_rate_hz=952.0, speed_deg_s=120.0, noise_rad_s=0.005),
        Setup(state_rate_hz=500.0, encoder_step_rad=80e-6),  # whose steps are more than what the arm does in between
        Setup(bias_rad_s=(0.2, -0.15, 0.1), scale=(1.9, 1.6, 0.8)),
        Setup(sample_rate_hz=14.9, noise_rad_s=0.005),  # the part's slowest rate: few samples meet the vibration
        Setup(sample_rate_hz=14.9, noise_rad_s=0.001, speed_deg_s=163.0, seed=100),
        Setup(drift=0.02),  # no crystal holds the board's oscillator
        Setup(drift=-0.02, speed_deg_s=120.0),
        Setup(rest_s=60.0, drift=-600e-6),  # over a long run even a crystal wanders by ramps
    ],
    ids=lambda setup: (
        f"boot{setup.boot_s:g}-{setup.speed_deg_s:g}deg-noise{setup.noise_rad_s:g}-ripple{setup.vibration:g}"
        f"-{setup.sample_rate_hz:g}Hz-rest{setup.rest_s:g}-drift{setup.drift:g}"
    ),
)
def test_the_board_s_clock_is_found_within_its_uncertainty(setup: Setup) -> None:
    seen = look(synthetic_run(setup))
    offset, drift = clock_errors(setup, seen.time_base)
    assert abs(offset) < 4 * seen.time_base.offset_std_s + 2e-6
    assert abs(drift) < 4 * seen.time_base.drift_std
    assert seen.time_base.offset_std_s < 2e-3
    np.testing.assert_allclose(seen.time_base.zero_rate_rad_s, -np.array(setup.bias_rad_s), atol=0.02)


@pytest.mark.parametrize("joint", ["wrist_3", "wrist_1", "wrist_2"])
def test_a_board_that_was_heard_late_is_not_taken_for_an_earlier_sweep(joint: str) -> None:
    """All sweeps turn equally fast; only the axis they turn about tells them apart."""
    begun = next(made.window.start_s for made in swept(USUAL) if made.sweep.joint_name == joint)
    sensor, samples = USUAL.sensors["gyro"], USUAL.samples["gyro"]
    board_s = samples["board_time_us"] * 1e-6
    heard = np.abs(board_s * (1 + Setup().drift) + Setup().boot_s - begun - 10) < 12.5
    readings_rad_s = samples["counts"][heard] * sensor.channel(RATE).unit_per_count
    clock = estimate_time_base(board_s[heard], readings_rad_s, ArmMotion(USUAL.states))
    assert abs(clock_errors(Setup(), clock)[0]) < 4 * clock.offset_std_s


@pytest.mark.parametrize("bias_rad_s", [0.45, -0.8])
def test_a_single_sweep_tells_the_clock_whatever_the_bias(bias_rad_s: float) -> None:
    """A bias about as large as the turn rate hides the turning in the readings' magnitude, or turns it upside down."""
    setup = Setup(bias_rad_s=(bias_rad_s, -0.01, -0.005), noise_rad_s=0.005)
    run = synthetic_run(setup)
    sensor, samples = run.sensors["gyro"], run.samples["gyro"]
    board_s = samples["board_time_us"] * 1e-6
    for made in swept(run):
        if made.sweep.joint_name != "wrist_1":  # which turns about x
            continue
        start_s, end_s = made.window.start_s, made.window.end_s
        begun_s = board_s * (1 + setup.drift) + setup.boot_s - start_s
        heard = (begun_s > -1) & (begun_s < end_s - start_s + 0.1)
        arm = run.states[(run.states["time_s"] > start_s - 1) & (run.states["time_s"] < end_s + 0.1)]
        readings_rad_s = samples["counts"][heard] * sensor.channel(RATE).unit_per_count
        clock = estimate_time_base(board_s[heard], readings_rad_s, ArmMotion(arm))
        assert abs(clock_errors(setup, clock)[0]) < 4 * clock.offset_std_s < 1e-3


@pytest.mark.slow
def test_the_demo_s_clock_is_known_to_half_a_millisecond() -> None:
    clock = look(USUAL).time_base
    assert clock.offset_std_s < 0.5e-3
    later = clock.reference_s + np.array([0.0, 10.0])
    np.testing.assert_allclose(np.diff(clock.controller_time_s(later)), 10 * (1 + clock.drift))


@pytest.mark.slow
def test_every_sweep_becomes_one_whole_revolution() -> None:
    seen = look(USUAL).revolutions
    assert [(o.joint_name, o.direction, o.axis, o.sign) for o in seen] == [
        ("wrist_3", "cw", "z", -1),
        ("wrist_3", "ccw", "z", 1),
        ("wrist_1", "cw", "x", 1),
        ("wrist_1", "ccw", "x", -1),
        ("wrist_2", "cw", "y", 1),
        ("wrist_2", "ccw", "y", -1),
    ]
    for observation in seen:
        assert observation.speed_rad_s == pytest.approx(np.pi / 3, rel=2e-5)  # by encoders with 24 µrad of noise
        assert observation.average.duration_s == pytest.approx(6.0, rel=2e-5)
        assert observation.average.samples in (1427, 1428, 1429)
        assert observation.average.temperature_c == pytest.approx(22.0)
        assert observation.lost == 0


@pytest.mark.slow
def test_vibration_is_no_noise_and_averages_out() -> None:
    """5 % of ripple is 0.05 rad/s, more than the sensor's noise; neither the variance nor the mean may show it."""
    setup = Setup(noise_rad_s=0.0, mounting_error_rad=(0.0, 0.0, 0.0), vibration=0.05, orders=ROUGH_ORDERS)
    setup = replace(setup, encoder_noise_rad=0.0)
    for observation in look(synthetic_run(setup)).revolutions:
        felt = observation.speed_rad_s * observation.axis_flange / setup.scale - setup.bias_rad_s
        np.testing.assert_allclose(observation.average.mean_rad_s, felt, atol=SENSITIVITY)
        assert observation.average.noise_rad_s.max() < 1e-3
    for observation in look(USUAL).revolutions:
        np.testing.assert_allclose(observation.average.noise_rad_s, 0.035, rtol=0.08)
        np.testing.assert_allclose(observation.average.variance_rad2_s2, 0.035**2 / 1428, rtol=0.16)


@pytest.mark.slow
@pytest.mark.parametrize(("noise_rad_s", "rate_hz"), [(4.5e-4, 200.0), (2e-3, 238.0)])
def test_the_ripple_of_a_harmonic_drive_is_no_noise_of_a_quiet_sensor(noise_rad_s: float, rate_hz: float) -> None:
    """Of 100, 200 and 400 cycles a turn: the last is faster than half the rate of the arm's states."""
    setup = Setup(noise_rad_s=noise_rad_s, sample_rate_hz=rate_hz, mounting_error_rad=(0.0, 0.0, 0.0))
    for observation in look(synthetic_run(setup)).revolutions:
        felt = observation.speed_rad_s * observation.axis_flange / setup.scale - setup.bias_rad_s
        assert np.all(np.abs(observation.average.mean_rad_s - felt) < 3 * np.sqrt(observation.average.variance_rad2_s2))
        np.testing.assert_allclose(observation.average.noise_rad_s, noise_rad_s, rtol=0.12)


@pytest.mark.slow
def test_a_clock_that_runs_far_off_is_refused() -> None:
    with pytest.raises(Fault, match="time_base_not_found"):
        look(synthetic_run(Setup(drift=0.06)))


@pytest.mark.thorough
@pytest.mark.slow
def test_coloured_noise_widens_the_uncertainty() -> None:
    rng = np.random.default_rng(8)
    white = rng.normal(size=(200, 1500))
    assert np.mean([correlation_inflation(draw) for draw in white]) < 1.01
    coloured = np.zeros_like(white)
    for i in range(1, white.shape[1]):
        coloured[:, i] = 0.6 * coloured[:, i - 1] + 0.8 * white[:, i]
    factors = [correlation_inflation(draw) for draw in coloured]
    true = np.var(coloured.mean(axis=1)) / (np.var(coloured) / white.shape[1])
    assert np.mean(factors) == pytest.approx(4.0, rel=0.1)  # (1 + 0.6) / (1 − 0.6)
    assert true == pytest.approx(4.0, rel=0.3)
    usual = look(USUAL).revolutions[0].average.variance_rad2_s2
    wide = look(synthetic_run(Setup(noise_correlation=0.6))).revolutions[0].average.variance_rad2_s2
    np.testing.assert_allclose(wide / usual, 4.0, rtol=0.4)


@pytest.mark.slow
def test_of_a_vibration_hardly_anything_is_left_in_a_mean() -> None:
    """Its correlations do not say so: added up to any lag they are large."""
    rng = np.random.default_rng(5)
    time_s = np.arange(1428) / 238
    for wave_hz, noise in ((14.0, 0.4), (9.0, 0.2), (25.0, 1.0)):
        waves = np.sqrt(2) * np.sin(2 * np.pi * wave_hz * time_s + rng.uniform(0, 2 * np.pi, (60, 1)))
        draws = waves + noise * rng.normal(size=(60, len(time_s)))
        stated = np.mean([fit_noise_factor(draw) * np.var(draw) / len(draw) for draw in draws])
        assert stated == pytest.approx(noise**2 / len(time_s), rel=0.8), wave_hz
        assert np.mean([correlation_inflation(draw) * np.var(draw) / len(draw) for draw in draws]) > 3 * stated


@pytest.mark.slow
def test_rests_show_the_reading_at_zero_rate() -> None:
    rests = look(USUAL).rests
    assert len(rests) == 6
    for rest in rests:
        assert rest.duration_s == pytest.approx(2.6)
        assert np.all(np.abs(rest.mean_rad_s + BIAS_RAD_S) < 4.5 * np.sqrt(rest.variance_rad2_s2))


def drifting(run: RunData, change_rad_s: float) -> RunData:
    """The bias changes evenly by so much from the first to the last sample."""

    def change(values: NDArray[np.int32]) -> None:
        values += np.round(np.linspace(-0.5, 0.5, len(values))[:, None] * change_rad_s / SENSITIVITY).astype(np.int32)

    return counts(run, change)


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize(("noise_rad_s", "change_rad_s"), [(0.035, 0.03), (0.003, 0.01)])
def test_a_bias_that_drifts_makes_the_result_uncertain(noise_rad_s: float, change_rad_s: float) -> None:
    """The rests show it. Without them the errors would be nine and thirty times what is reported.

    The vector model knows when each average was made, so that an even drift costs it little.
    """
    setups = [Setup(seed=seed, noise_rad_s=noise_rad_s) for seed in range(6)]
    errors: dict[str, list[Array]] = {"vector": [], "newton": []}
    for setup in setups:
        result = solve_runs([drifting(synthetic_run(setup), change_rad_s)])["gyro"]
        assert result.six_observation is not None
        for solution in (result.solution, result.six_observation):
            found = np.concatenate([solution.scale, solution.bias_rad_s])
            errors[solution.estimator].append((found - truth(setup)) / np.sqrt(np.diag(solution.covariance)))
        assert change_rad_s / 20 < np.sqrt(result.six_observation.covariance[3, 3]) < change_rad_s
    assert 0.5 < np.sqrt(np.mean(np.square(errors["newton"]))) < 1.3
    assert np.sqrt(np.mean(np.square(errors["vector"]))) < 1.3


def between(run: RunData, start_s: float, end_s: float) -> NDArray[np.intp]:
    """Indices of the samples in a stretch of the first sweep, in seconds after its start."""
    begun = next(swept(run)).window.start_s
    time_s = run.samples["gyro"]["board_time_us"] * 1e-6 * (1 + Setup().drift) + Setup().boot_s
    return np.flatnonzero((time_s >= begun + start_s) & (time_s < begun + end_s))


def with_samples(run: RunData, change: Callable[[NDArray[Any]], NDArray[Any]]) -> RunData:
    return replace(run, samples={"gyro": change(run.samples["gyro"].copy())})


def with_arm(run: RunData, change: Callable[[NDArray[Any]], NDArray[Any]]) -> RunData:
    return replace(run, states=change(run.states.copy()))


def lose(run: RunData, where: NDArray[np.intp]) -> RunData:
    return with_samples(run, lambda samples: np.delete(samples, where))


def counts(run: RunData, change: Callable[[NDArray[np.int32]], None]) -> RunData:
    def changed(samples: NDArray[Any]) -> NDArray[Any]:
        change(samples["counts"])
        return samples

    return with_samples(run, changed)


def turned(run: RunData, *axes: int) -> RunData:
    """The sensor reads its axes in another order; −n is the opposite of axis n."""

    def change(values: NDArray[np.int32]) -> None:
        values[:] = np.stack([np.sign(axis) * values[:, abs(axis) - 1] for axis in axes], axis=1)

    return counts(run, change)


def saturate(run: RunData) -> RunData:
    def change(values: NDArray[np.int32]) -> None:
        values[between(run, 3.0, 3.005), 2] = -32768

    return counts(run, change)


def freeze(run: RunData) -> RunData:
    def change(values: NDArray[np.int32]) -> None:
        held = between(run, 2.0, 4.0)
        values[held] = values[held[0]]

    return counts(run, change)


def constant(run: RunData, axes: slice) -> RunData:
    def change(values: NDArray[np.int32]) -> None:
        values[:, axes] = 0

    return counts(run, change)


def noise_only(run: RunData) -> RunData:
    def change(values: NDArray[np.int32]) -> None:
        values[:] = np.random.default_rng(1).normal(size=values.shape) * 200

    return counts(run, change)


def doubled(run: RunData) -> RunData:
    return with_samples(run, lambda samples: np.insert(samples, 5000, samples[4999]))


def restart(run: RunData) -> RunData:
    def change(samples: NDArray[Any]) -> NDArray[Any]:
        samples["board_time_us"][9000:] -= samples["board_time_us"][9000]
        return samples

    return with_samples(run, change)


def halt(run: RunData) -> RunData:
    """The arm pauses for a second in the middle of the first sweep, and so does the whole plan after it."""

    def change(arm: NDArray[Any]) -> NDArray[Any]:
        begun = next(swept(run)).window.start_s
        before = arm["time_s"] < begun + 3.5
        held = np.repeat(arm[before][-1:], 125)
        held["time_s"] += 0.008 * np.arange(1, 126)
        after = arm[~before].copy()
        after["time_s"] += 1.0
        return np.concatenate([arm[before], held, after])

    begun = next(swept(run)).window.start_s
    index = int(between(run, 3.5, 3.6)[0])
    events = tuple(
        replace(recorded, controller_time_s=recorded.controller_time_s + (recorded.controller_time_s > begun))
        for recorded in run.events
        if recorded.controller_time_s is not None
    )

    def later(samples: NDArray[Any]) -> NDArray[Any]:
        pause = np.repeat(samples[index : index + 1], 238)
        pause["board_time_us"] += (1e6 / 238 * np.arange(238)).astype("u8")
        pause["counts"] = np.random.default_rng(1).normal(size=(238, 3)) * 229
        samples["board_time_us"][index:] += 1_000_000
        whole = np.concatenate([samples[:index], pause, samples[index:]])
        whole["sequence"] = np.arange(len(whole))
        return whole

    return replace(with_samples(with_arm(run, change), later), events=events)


def slow_slider(run: RunData) -> RunData:
    def change(arm: NDArray[Any]) -> NDArray[Any]:
        arm["target_speed_fraction"][2000:2200] = 0.8
        return arm

    return with_arm(run, change)


def slowed_by_a_limit(run: RunData) -> RunData:
    def change(arm: NDArray[Any]) -> NDArray[Any]:
        arm["speed_scaling"][2000:2200] = 0.6
        return arm

    return with_arm(run, change)


def clock_set_back(run: RunData) -> RunData:
    def change(arm: NDArray[Any]) -> NDArray[Any]:
        arm["time_s"][2000:] -= 0.5
        return arm

    return with_arm(run, change)


def another_joint(run: RunData) -> RunData:
    def change(arm: NDArray[Any]) -> NDArray[Any]:
        arm["q_rad"][:, 1] += 0.02 * np.sin(arm["time_s"])
        return arm

    return with_arm(run, change)


def short(run: RunData) -> RunData:
    """The plan wanted more than the joint travelled."""

    def longer(event: Event) -> Event:
        if not isinstance(event, SweepStarted | SweepFinished):
            return event
        low, high = event.sweep.revolution_rad
        return replace(event, sweep=replace(event.sweep, revolution_rad=(low - 1, high + 1)))

    return replace(run, events=tuple(replace(recorded, event=longer(recorded.event)) for recorded in run.events))


def still(run: RunData) -> RunData:
    def change(arm: NDArray[Any]) -> NDArray[Any]:
        arm["q_rad"] = arm["q_rad"][0]
        return arm

    return with_arm(run, change)


def scaled(run: RunData, factor: float) -> RunData:
    sensor = run.sensors["gyro"]
    changed = change_channel(sensor, unit_per_count=sensor.channel(RATE).unit_per_count * factor)
    return replace(run, sensors={"gyro": changed})


def nowhere(run: RunData) -> RunData:
    def change(arm: NDArray[Any]) -> NDArray[Any]:
        arm["q_rad"][5000, 4] = np.nan
        return arm

    return with_arm(run, change)


def late(rows: NDArray[Any], time: str, value: float) -> NDArray[Any]:
    rows[time][-1] = value
    return rows


def gap_in_states(run: RunData) -> RunData:
    return with_arm(run, lambda arm: np.delete(arm, slice(1000, 1130)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoilt", "name"),
    [
        (lambda run: lose(run, between(run, 3.0, 3.1)), "lost_samples: in sweep 0 .*24 of 14"),
        (lambda run: lose(run, between(run, -2.0, 1.5)), "lost_samples"),
        (saturate, "saturation: in sweep 0"),
        (freeze, "stuck_sensor: in sweep 0"),
        (lambda run: constant(run, slice(3)), "stuck_sensor"),
        (lambda run: constant(run, slice(1, 2)), "stuck_axis: axis y"),
        (lambda run: turned(run, 2, -1, 3), "wrong_axis: in sweep 2"),
        (lambda run: turned(run, -1, -2, 3), "wrong_sign: in sweep 2"),
        (lambda run: turned(run, 1, 2, -3), "wrong_sign: in sweep 0"),
        (noise_only, "time_base_not_found"),
        (restart, "board_clock_restarted"),
        (doubled, "duplicated_samples"),
        (
            lambda run: with_samples(run, lambda samples: samples[:50]),
            "time_base_not_found: .* 50 samples, but .*Raise the rate",
        ),
        (halt, "speed_not_constant: in sweep 0"),
        (slow_slider, "speed_slider: .* 80 %"),
        (slowed_by_a_limit, "speed_limited: .* 60 % of the programmed speed with the slider at 100 %"),
        (clock_set_back, "arm_clock_stepped: .* goes back"),
        (another_joint, "other_joint_moved"),
        (short, "incomplete_revolution: in sweep 0"),
        (still, "no_motion"),
        (lambda run: replace(run, states=np.zeros(0, ARM_STATE_DTYPE)), "no_motion"),
        (gap_in_states, "arm_states_lost"),
        (lambda run: scaled(run, 180 / np.pi), "wrong_unit: .* 50.1 times"),
        (lambda run: scaled(run, np.nan), "not_finite: a reading"),
        (nowhere, "not_finite: an arm state"),
        (lambda run: with_arm(run, lambda arm: late(arm, "time_s", 1e12)), "impossible_times: the arm's states"),
        (
            lambda run: with_samples(run, lambda rows: late(rows, "board_time_us", 2**62)),
            "impossible_times: the samples",
        ),
    ],
)
def test_what_does_not_belong_into_a_calibration_is_refused_by_name(
    spoilt: Callable[[RunData], RunData], name: str
) -> None:
    with pytest.raises(Fault, match=name):
        look(spoilt(USUAL))


def thinned(run: RunData, seed: int) -> RunData:
    """What a busy computer leaves of the arm's states: one in fifty is followed by a hole of up to 0.12 s."""
    rng = np.random.default_rng(seed)
    kept = np.ones(len(run.states), dtype=np.bool_)
    for start in np.flatnonzero(rng.random(len(run.states)) < 0.02):
        kept[start + 1 : start + 1 + rng.integers(1, 15)] = False
    return with_arm(run, lambda arm: arm[kept])


@pytest.mark.slow
@pytest.mark.proof
def test_holes_between_arm_states_cost_certainty_not_truth(thorough: bool) -> None:
    errors = []
    clocks = []
    stds = []
    for seed in range(24 if thorough else 4):
        setup = Setup(seed=seed, rest_s=1.0, vibration=0.05, orders=ROUGH_ORDERS)
        result = solve_runs([thinned(synthetic_run(setup), seed)])["gyro"]
        found = np.concatenate([result.solution.scale, result.solution.bias_rad_s])
        errors.append((found - truth(Setup())) / np.sqrt(np.diag(result.solution.covariance)))
        for observation in result.observations:
            stds.append(observation.speed_std_rad_s)
            assert abs(observation.speed_rad_s - np.pi / 3) < 4 * observation.speed_std_rad_s + 1e-5
            np.testing.assert_allclose(observation.average.noise_rad_s, 0.035, rtol=0.1)
        clock = result.time_bases[0]
        offset, drift = clock_errors(Setup(), clock)
        clocks.append((offset / clock.offset_std_s, drift / clock.drift_std))
    least, most = (0.8, 1.2) if thorough else (0.65, 1.4)
    assert least < np.sqrt(np.mean(np.square(errors))) < most
    assert least - 0.1 < np.sqrt(np.mean(np.square(clocks))) < most + 0.1
    assert max(stds) > 1e-4
    assert np.median(stds) < 3e-5


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize("holes", [False, True])
def test_few_samples_a_turn_do_not_take_vibration_for_speed(holes: bool, thorough: bool) -> None:
    """At 14.9 Hz a turn has 33 samples, and the ripple's 31 cycles look like two: the plain mean would be 20 σ off."""
    errors = []
    for seed in range(6 if thorough else 2):
        setup = Setup(seed=seed, sample_rate_hz=14.9, noise_rad_s=0.001, speed_deg_s=163.0)
        run = synthetic_run(setup)
        solution = solve_runs([thinned(run, seed) if holes else run])["gyro"].solution
        found = np.concatenate([solution.scale, solution.bias_rad_s])
        errors.append((found - truth(setup)) / np.sqrt(np.diag(solution.covariance)))
    assert np.abs(errors).max() < 4
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.3


@pytest.mark.slow
def test_a_few_lost_samples_are_counted_and_allowed() -> None:
    gap = between(USUAL, 3.0, 3.05)
    seen = look(lose(USUAL, gap), SETTINGS.model_copy(update={"max_lost_fraction": 0.05}))
    assert [observation.lost for observation in seen.revolutions] == [len(gap), 0, 0, 0, 0, 0]
    assert seen.revolutions[0].average.samples + len(gap) == look(USUAL).revolutions[0].average.samples


def test_samples_the_board_itself_missed_are_noticed_by_the_clock() -> None:
    def renumbered(samples: NDArray[Any]) -> NDArray[Any]:
        samples["sequence"] = np.arange(len(samples))
        return samples

    with pytest.raises(Fault, match="lost_samples"):
        look(with_samples(lose(USUAL, between(USUAL, 3.0, 3.1)), renumbered))


@pytest.mark.slow
def test_the_sequence_number_may_wrap() -> None:
    def near_the_end(samples: NDArray[Any]) -> NDArray[Any]:
        samples["sequence"] += np.uint32(2**32 - 1500)
        return samples

    assert [o.lost for o in look(with_samples(USUAL, near_the_end)).revolutions] == [0] * 6


@pytest.mark.slow
def test_one_calibration_recovers_the_truth() -> None:
    result = solve_runs([USUAL])["gyro"]
    found = np.concatenate([result.solution.scale, result.solution.bias_rad_s])
    assert np.all(np.abs(found - truth(Setup())) < 4 * np.sqrt(np.diag(result.solution.covariance)))
    document = sensor_entry(result).model_dump(mode="json")
    assert document["model"] == "g = K (m + b)"
    assert document["covariance_order"] == ["kx", "ky", "kz", "bx", "by", "bz"]
    assert document["estimator"] == document["vector_model"]["estimator"] == "vector"
    assert document["vector_model"]["scale"] == document["scale"]
    np.testing.assert_allclose(document["algorithm_1"]["scale"], document["six_observation"]["scale"], atol=1e-6)
    apart = np.array(document["scale"]) - document["six_observation"]["scale"]
    assert np.all(np.abs(apart) < np.sqrt(np.diag(result.solution.covariance))[:3])
    turned = np.linalg.norm(Setup().mounting_error_rad)
    assert np.trace(document["vector_model"]["mounting"]) == pytest.approx(1 + 2 * np.cos(turned), abs=1e-3)
    skew, std = (document["vector_model"][f"non_orthogonality{name}_rad"] for name in ("", "_std"))
    assert np.all(np.abs(skew) < 4 * np.array(std))
    assert len(document["observations"]) == len(document["rests"]) == 6
    assert document["temperature_c"] == pytest.approx(22.0)


def part(run: RunData, sweeps: range) -> RunData:
    """What a run that was interrupted and resumed has in one of its files: the events of some sweeps."""
    return replace(
        run,
        events=tuple(
            recorded
            for recorded in run.events
            if isinstance(recorded.event, SweepStarted | SweepFinished) and recorded.event.sweep.index in sweeps
        ),
    )


@pytest.mark.slow
def test_a_sensor_without_noise_is_known_to_a_part_of_a_count() -> None:
    """Rounding does not average out when nothing carries the reading across counts, and the uncertainty says so."""
    for vibration in (0.0, 0.05):
        setup = Setup(noise_rad_s=0.0, vibration=vibration, orders=ROUGH_ORDERS, encoder_noise_rad=0.0)
        solution = solve_runs([synthetic_run(setup)])["gyro"].solution
        errors = np.concatenate([solution.scale, solution.bias_rad_s]) - truth(setup)
        assert np.all(np.abs(errors) < 4 * np.sqrt(np.diag(solution.covariance)))
        assert np.abs(errors).max() < SENSITIVITY


@pytest.mark.slow
def test_a_resumed_run_is_solved_from_all_its_recordings() -> None:
    whole = solve_runs([USUAL])["gyro"].solution
    other = synthetic_run(Setup(boot_s=50.0))
    parts = solve_runs([part(USUAL, range(2)), part(USUAL, range(0)), part(other, range(2, 6))])["gyro"]
    assert [observation.sweep for observation in parts.observations] == [0, 1, 2, 3, 4, 5]
    assert len(parts.time_bases) == 2
    np.testing.assert_allclose(parts.solution.scale, whole.scale, atol=2e-5)


@pytest.mark.slow
def test_an_interrupted_run_alone_says_what_is_missing() -> None:
    interrupted = part(USUAL, range(4))
    begun = [recorded for recorded in USUAL.events if isinstance(recorded.event, SweepStarted)][4]
    with pytest.raises(Fault, match=r"too_few_observations.*resume"):
        solve_runs([replace(interrupted, events=(*interrupted.events, begun))])


def test_solving_refuses_what_it_cannot_mean() -> None:
    with pytest.raises(Fault, match="duplicated_observation"):
        solve_runs([USUAL, USUAL])
    with pytest.raises(Refused, match=r"unknown_estimator.*newton"):
        solve_runs([USUAL], "newtun")
    other = replace(USUAL, sensors={"gyro": replace(USUAL.sensors["gyro"], serial_number="LSM9DS1-002")})
    with pytest.raises(Refused, match="different_sensors"):
        solve_runs([USUAL, other])


@pytest.mark.slow
def test_a_bias_too_large_for_algorithm_1_is_reported_beside_the_result() -> None:
    result = solve_runs([synthetic_run(Setup(bias_rad_s=(0.5, -0.5, 0.5), noise_rad_s=0.01))])["gyro"]
    np.testing.assert_allclose(result.solution.bias_rad_s, [0.5, -0.5, 0.5], atol=0.005)
    assert sensor_entry(result).model_dump()["algorithm_1"]["error"].startswith("algorithm_1_diverged")


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.proof
def test_reported_uncertainties_are_those_of_many_sessions(thorough: bool) -> None:
    """Sessions over four movements: errors in units of their reported standard deviation have RMS 1."""
    sessions = 50 if thorough else 5
    within = 3.3 / np.sqrt(2 * 4 * sessions)
    parameters = []
    clocks = []
    for movement in range(4):
        setup = Setup(seed=movement, rest_s=0.5, speed_deg_s=120.0, boot_s=-50.0 - 7.7 * movement)
        rng = np.random.default_rng(100 + movement)
        motion = Motion(setup, rng)
        board_s, controller_s = sample_times(setup, motion)
        rate = true_rate(motion, controller_s)
        for _ in range(sessions):
            run = run_data(setup, motion, board_s, readings(setup, rate, rng))
            result = solve_runs([run])["gyro"]
            found = np.concatenate([result.solution.scale, result.solution.bias_rad_s])
            parameters.append((found - truth(setup)) / np.sqrt(np.diag(result.solution.covariance)))
            clock = result.time_bases[0]
            offset, drift = clock_errors(setup, clock)
            clocks.append((offset / clock.offset_std_s, drift / clock.drift_std))
    rms = np.sqrt(np.mean(np.square(parameters), axis=0))
    assert np.all(np.abs(rms - 1) < within), rms
    rms = np.sqrt(np.mean(np.square(clocks), axis=0))
    assert np.all(np.abs(rms - 1) < within), rms
    assert np.abs(parameters).max() < 4.5

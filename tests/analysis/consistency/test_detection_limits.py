"""From what size on a recording contradicts itself is said beforehand, and again of what was recorded: and it is so."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import pytest

from rig.analysis.consistency.contradictions import ConsistencyChecks, contradictions
from rig.analysis.consistency.detection_limits import DetectionLimit
from rig.analysis.design.planned_limits import predict_limits
from rig.analysis.environment import find_environment
from rig.analysis.gyroscope.calibration import observe_recordings, solve_observed
from rig.config.load import parse
from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.motion.geometry import NOMINAL
from rig.observation.windows import swept
from support.recordings.drawn_recording import KINDS, Drawn, add_readings, drawn
from support.recordings.synthetic_run import Motion, Setup

pytestmark = pytest.mark.slow

SURE = 1.3  # times the size from which on it is told in 95 of 100
AXES = np.eye(3)


def held(run: RunData) -> ConsistencyChecks:
    recordings = observe_recordings([run])
    environment = find_environment(recordings, recordings[0].run.settings)
    results = solve_observed(run.sensors, recordings, environment=environment)
    return contradictions(recordings, results, ["gyro"], environment, recordings[0].run.settings)


def later(seen: Drawn) -> Array:
    """(n, 1) −½ in the first half, ½ in the second."""
    return np.where(seen.time_s > (seen.time_s[0] + seen.time_s[-1]) / 2, 0.5, -0.5)[:, None]


def sweeps(seen: Drawn) -> Array:
    """(n, M) one inside each sweep."""
    windows = [sweep.window for sweep in swept(seen.run)]
    return np.array(
        [(seen.time_s >= window.start_s) & (seen.time_s <= window.end_s) for window in windows], dtype=float
    ).T


# (n, 3) of one unit, in one of the ways in which each may happen: on an axis, or in one sweep and on one axis.
PLANTED: Mapping[str, Callable[[Drawn, int], Array]] = {
    "all scale factors change half-way": lambda seen, _: seen.sensed_rad_s * later(seen),
    "one scale factor changes half-way": lambda seen, way: seen.sensed_rad_s * later(seen) * AXES[way % 3],
    "the sensor turns on the flange half-way": lambda seen, way: (
        np.cross(AXES[way % 3], seen.sensed_rad_s) * later(seen)
    ),
    "another scale one way than the other": lambda seen, _: np.abs(seen.sensed_rad_s) / 2,
    "another bias in sweeps than in rests": lambda seen, way: sweeps(seen).sum(axis=1, keepdims=True) * AXES[way % 3],
    "the bias jumps half-way": lambda seen, way: later(seen) * AXES[way % 3],
    "another reading in one sweep": lambda seen, way: sweeps(seen)[:, [way // 3 % 6]] * AXES[way % 3],
}


def planted(seen: Drawn, kind: str, times: float, way: int) -> Iterator[tuple[DetectionLimit, bool]]:
    """Each damage of so many times the size from which on it is told, and whether it was."""
    for each in held(seen.run).detection_limits["gyro"]:
        by = times * each.size * PLANTED[each.what](seen, way)
        checks = held(add_readings(seen, KINDS[kind], by)).checks
        yield each, not all(check.passed for check in checks)


@pytest.mark.thorough
@pytest.mark.one_in(2)
@pytest.mark.proof
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("kind", ["ADIS16465", "quiet LSM9DS1"])
def test_a_fault_above_the_stated_detection_limit_is_detected(kind: str, thorough: bool) -> None:
    missed = [
        (seed, each.what)
        for seed in range(18 if thorough else 1)
        for each, told in planted(drawn(900 + seed, KINDS[kind]), kind, SURE, way=seed)
        if not told
    ]
    assert not missed


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(3000)
def test_what_is_as_large_is_told_nearly_always_and_a_quarter_of_it_hardly_ever() -> None:
    """Over 18 recordings, of the ways in which it may happen those that are told last among them."""
    told: dict[float, list[bool]] = {
        times: [
            found
            for seed in range(18)
            for _, found in planted(drawn(940 + seed, KINDS["ADIS16465"]), "ADIS16465", times, way=seed)
        ]
        for times in (1.0, 0.25)
    }
    print(f"told at the size {np.mean(told[1.0]):.3f}, at a quarter of it {np.mean(told[0.25]):.3f}")
    assert np.mean(told[1.0]) > 0.93
    assert np.mean(told[0.25]) < 0.35


@pytest.mark.one_in(2)
@pytest.mark.parametrize("seed", [902, 903])
def test_a_good_sensor_shows_damage_as_small_whether_or_not_its_encoders_have_noise(seed: int) -> None:
    """Of an ADIS16465 the noise of a second is no larger than what 24 µrad make of its rate."""
    exact, noisy = (
        {limit.what: limit.size for limit in held(drawn(seed, KINDS["ADIS16465"], setup).run).detection_limits["gyro"]}
        for setup in (Setup(encoder_noise_rad=0.0, state_rate_hz=500.0), Setup(state_rate_hz=500.0))
    )
    assert all(noisy[what] < 1.4 * exact[what] for what in exact), (exact, noisy)


def test_a_plan_predicts_the_detection_limits_of_its_recording() -> None:
    seen = drawn(3, KINDS["quiet LSM9DS1"])
    motion = Motion(Setup(), np.random.default_rng(0))
    will = predict_limits(parse(motion.config).config, motion.plan, NOMINAL).rates["gyro"]
    recorded = {each.what: each for each in held(seen.run).detection_limits["gyro"]}
    assert set(PLANTED) == set(recorded) == {each.what for each in will}
    for each in will:
        assert each.size == pytest.approx(recorded[each.what].size, rel=0.6), each.what
        assert each.unit == recorded[each.what].unit


def test_a_fault_just_below_its_detection_limit_puts_a_result_off_by_a_few_u() -> None:
    limits = held(drawn(3, KINDS["quiet LSM9DS1"]).run).detection_limits["gyro"]
    off = [limit.off_by_expanded for limit in limits]
    assert all(each is not None and 0.01 < each < 20 for each in off), off

"""Nothing passes that contradicts itself: planted damages of recordings, and recordings that have none."""

from collections.abc import Sequence

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.check import Check
from rig.analysis.consistency.contradictions import contradicting_sweeps, contradictions
from rig.analysis.consistency.converter_tests import judge_readings
from rig.analysis.consistency.false_alarms import FALSE_ALARM_PROBABILITY
from rig.analysis.environment import find_environment
from rig.analysis.gyroscope.calibration import observe_recordings, solve_observed
from rig.data.recording.run_data import RunData
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.consistency.raw_readings import RawReadings
from support.recordings.damaged_readings import (
    Damage,
    Mask,
    Readings,
    bend,
    clip,
    convert,
    drifting,
    frozen,
    late,
    noisier,
    offset,
    old,
    readings_of,
    repeat,
    replace_readings,
    roll,
    rotate,
    scale,
    spiky,
    swap,
    wrap,
)
from support.recordings.synthetic_run import Setup, synthetic_run, truth


def later(seen: Readings) -> Mask:
    return seen.late


def turning(seen: Readings) -> Mask:
    return seen.turning


def sweep_2(seen: Readings) -> Mask:
    return seen.sweep(2)


def sweep_5(seen: Readings) -> Mask:
    return seen.sweep(5)


def half_of_sweep_1(seen: Readings) -> Mask:
    return seen.half_of(1)


def rest_3(seen: Readings) -> Mask:
    return seen.rest(3)


# By seed, rad/s for one reading; at 0.02 half a per cent of the scale is too little for six sweeps to tell.
NOISE = {1: 0.0025, 2: 0.0005, 3: 0.01, 4: 0.005, 5: 0.008}
DISTURBED = ("disturbed_sweep",)
# What is damaged, and the names of which one at least must be told; a few are told by none, and the truth must be met.
DAMAGES: dict[str, tuple[tuple[str, ...], Damage]] = {
    "offset of 0.01 rad/s in one sweep": (DISTURBED, offset(0.01, sweep_2)),
    "offset of 0.02 rad/s in one sweep": (DISTURBED, offset(0.02, sweep_2)),
    "offset of 0.05 rad/s in one sweep": (DISTURBED, offset(0.05, sweep_5)),
    "offset of 0.01 rad/s in half a sweep": (DISTURBED, offset(0.01, half_of_sweep_1)),
    "offset of 0.02 rad/s in half a sweep": (DISTURBED, offset(0.02, half_of_sweep_1)),
    "offset of 0.01 rad/s in all sweeps": (("sweeps_against_rests",), offset(0.01, turning)),
    "offset of 0.01 rad/s in one rest": ((), offset(0.01, rest_3)),
    "scale changes by 0.5 % half-way": (("scale_changed",), scale(1.005, later)),
    "scale changes by 1 % half-way": (("scale_changed",), scale(1.01, later)),
    "scale changes by 2 % half-way": (("scale_changed",), scale(0.98, later)),
    "one axis' scale changes by 1 % half-way": (("scale_changed",), scale(1.01, later, (0,))),
    "scale off by 0.5 % in one sweep": (DISTURBED, scale(1.005, sweep_2)),
    "scale off by 1 % in one sweep": (DISTURBED, scale(0.99, sweep_5)),
    "scale off by 2 % in half a sweep": (DISTURBED, scale(1.02, half_of_sweep_1)),
    "turned by 1° half-way": (("loose_mounting",), rotate(1, later)),
    "turned by 2° half-way": (("loose_mounting",), rotate(2, later)),
    "turned by 5° half-way": (("loose_mounting",), rotate(5, later)),
    "turned by 10° half-way": (("loose_mounting",), rotate(10, later)),
    "turned by 1° in one sweep": (DISTURBED, rotate(1, sweep_2)),
    "turned by 2° in one sweep": (DISTURBED, rotate(2, sweep_5)),
    "turned by 5° in one sweep": (DISTURBED, rotate(5, sweep_2)),
    "turned by 10° in one sweep": (DISTURBED, rotate(10, sweep_5)),
    "turned by 2° in half a sweep": (DISTURBED, rotate(2, half_of_sweep_1)),
    "bit 12 high in 1 %": (("stuck_bit",), convert(lambda counts: counts | 1 << 12, 0.01)),
    "bit 12 high in 5 %": (("stuck_bit",), convert(lambda counts: counts | 1 << 12, 0.05)),
    "bit 12 low in 5 %": (("stuck_bit",), convert(lambda counts: counts & ~(1 << 12), 0.05)),
    "bit 10 high in 5 %": (("stuck_bit", "skewed_noise"), convert(lambda counts: counts | 1 << 10, 0.05)),
    "bit 7 high in 10 %": (("stuck_bit", "skewed_noise"), convert(lambda counts: counts | 1 << 7, 0.1)),
    "bit 3 high in 10 %": (("stuck_bit", "skewed_noise"), convert(lambda counts: counts | 1 << 3, 0.1)),
    "bit 0 always high": (("stuck_bit",), convert(lambda counts: counts | 1)),
    "low byte always 0": (("stuck_bit", "stuck_sensor"), convert(lambda counts: counts & ~0xFF)),
    "low half-byte always 0": (("stuck_bit",), convert(lambda counts: counts & ~0xF)),
    "clips at 0.95 rad/s": (("clipping", "stuck_axis"), clip(-0.95, 0.95)),
    "clips at 0.85 rad/s": (("clipping", "stuck_axis"), clip(-0.85, 0.85)),
    "clips at 0.9 rad/s on one side": (("clipping", "stuck_axis"), clip(-9, 0.9)),
    "wraps at 0.95 rad/s": (("spikes", "wrong_axis", "wrong_sign", "time_base_not_found"), wrap(0.95)),
    "1 % quadratic": (("cw_against_ccw", "sweeps_against_rests"), bend(lambda felt: 0.01 * felt**2)),
    "0.5 % quadratic": (("cw_against_ccw", "sweeps_against_rests"), bend(lambda felt: 0.005 * felt**2)),
    "1 % asymmetry": (("cw_against_ccw", "sweeps_against_rests"), bend(lambda felt: 0.01 * np.abs(felt))),
    "2 % asymmetry": (("cw_against_ccw", "sweeps_against_rests"), bend(lambda felt: 0.02 * np.maximum(felt, 0))),
    "halves of a sweep swapped": ((), roll(sweep_2, 0.5)),
    "half a second repeated": (("repeated_readings",), repeat(sweep_2, 0.5)),
    "two seconds repeated": (("repeated_readings",), repeat(sweep_5, 2.0)),
    "spikes in 0.1 %": (("spikes",), spiky(0.001, 1.0)),
    "spikes in 2 %": (("spikes",), spiky(0.02, 2.0)),
    "spikes to one side in 0.5 %": (("spikes",), spiky(0.005, 1.0, one_sided=True)),
    "an axis frozen in a sweep": (("stuck_axis", "stuck_sensor"), frozen(sweep_2, (1,))),
    "an axis frozen in a rest": (("stuck_axis",), frozen(rest_3, (0,))),
    "all axes frozen in a rest": (("stuck_axis", "repeated_readings"), frozen(rest_3, (0, 1, 2))),
    "all axes frozen in a sweep": (("stuck_sensor",), frozen(sweep_5, (0, 1, 2))),
    "times of a sweep 20 ms late": (DISTURBED, late(0.02, sweep_2)),
    "times of a sweep 200 ms late": ((*DISTURBED, "lost_samples"), late(0.2, sweep_2)),
    "zeros in 1 %": (("spikes", "stuck_bit"), replace_readings(lambda seen: seen.some(0.01), 0)),
    "zeros for a second": (("stuck_sensor",), replace_readings(lambda seen: seen.second(seen.sweep(2)), 0)),
    "sign wrong in 0.5 %": (("spikes",), convert(lambda counts: -counts, 0.005)),
    "every tenth reading an old one": ((), old(10)),
    "two axes swapped for a second": ((*DISTURBED, "spikes", "skewed_noise"), swap(sweep_2)),
    "bias steps by 0.002 rad/s half-way": (("bias_jumped",), offset(0.002, lambda seen: seen.late - 0.5)),
    "bias drifts by 0.005 rad/s": ((), drifting(0.005)),
    "noise of 0.1 rad/s in one sweep": ((), noisier(0.1, sweep_2)),
}


def judged(run: RunData) -> tuple[tuple[Check, ...], Array, Array]:
    """The checks, the six parameters and their standard deviations. Raises Fault."""
    recordings = observe_recordings([run])
    environment = find_environment(recordings, recordings[0].run.settings)
    results = solve_observed(run.sensors, recordings, environment=environment)
    solution = results["gyro"].solution
    found = np.concatenate([solution.scale, solution.bias_rad_s])
    settings = recordings[0].run.settings
    checks = contradictions(recordings, results, ["gyro"], environment, settings, has_limits=False).checks
    return checks, found, np.sqrt(np.diag(solution.covariance))


def failed(checks: Sequence[Check]) -> set[str]:
    """The names of those that failed, without the sensor and the sweep."""
    return {check.name.split(".")[1] for check in checks if not check.passed}


def first_of_its_kind(name: str) -> bool:
    """Whether no damage before this one in the table is to be told by the same names."""
    return name == next(each for each, (names, _) in DAMAGES.items() if names == DAMAGES[name][0])


@pytest.mark.one_in(8)  # spikes, stuck bits and a turn on the flange have tests of their own, here and beside
@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize(
    "name", [name if first_of_its_kind(name) else pytest.param(name, marks=pytest.mark.thorough) for name in DAMAGES]
)
def test_what_is_damaged_is_named_or_does_not_matter(name: str, thorough: bool) -> None:
    names, damage = DAMAGES[name]
    for seed in range(1, 6 if thorough else 2):
        setup = Setup(seed=seed, noise_rad_s=NOISE[seed])
        try:
            checks, found, std = judged(damage(readings_of(setup)).recording())
        except Fault as fault:
            assert fault.name in names, seed
            continue
        off = float(np.abs((found - truth(setup)) / std).max())
        assert failed(checks) & set(names) or off < 4, f"seed {seed}: {failed(checks)}, {off:.1f} standard deviations"


@pytest.mark.slow
def test_a_change_of_all_scale_factors_is_no_transfer_that_is_disturbed() -> None:
    """Between two sweeps about one axis: they contradict; repeated, they would agree, and the change would remain."""
    checks, _, _ = judged(scale(1.005, later)(readings_of(Setup(seed=1, noise_rad_s=NOISE[1]))).recording())
    assert {"scale_changed", "disturbed_sweep"} <= failed(checks)


@pytest.mark.slow
def test_a_step_within_a_sweep_is_no_slow_vibration() -> None:
    """Its harmonics are found as spectral lines of one, two and three cycles a turn."""
    damage = scale(1.02, half_of_sweep_1)
    checks, _, _ = judged(damage(readings_of(Setup(seed=5, noise_rad_s=NOISE[5]))).recording())
    assert "disturbed_sweep" in failed(checks)


def wandering(seen: Readings, rate: float) -> Readings:
    """With a bias that walks by `rate` rad/s per √s."""
    steps = seen.rng.normal(size=seen.counts.shape) * rate / np.sqrt(seen.setup.sample_rate_hz)
    return seen.feeling(seen.compute_rates() + np.cumsum(steps, axis=0))


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.proof
def test_an_undamaged_run_raises_no_alarm(thorough: bool) -> None:
    """A hundred runs at a rate set to 0.1 %: more than one with an alarm would come once in 200 such hundreds."""
    runs, alarms = 100 if thorough else 7, list[set[str]]()
    for place in range(runs):
        setup = Setup(
            seed=1000 + place,
            noise_rad_s=(0.0005, 0.001, 0.0025, 0.005, 0.01, 0.02, 0.035)[place % 7],
            noise_correlation=(0.0, 0.0, 0.5)[place % 3],
        )
        seen = readings_of(setup)
        walk = (0.0, 1e-5, 3e-5, 1e-4)[place % 4]
        alarms.append(failed(judged((wandering(seen, walk) if walk else seen).recording())[0]))
    assert sum(map(bool, alarms)) <= 1, alarms
    assert FALSE_ALARM_PROBABILITY == 0.001


@pytest.mark.slow
def test_a_disturbed_sweep_is_named_and_fails_the_verdict() -> None:
    """Which of the two about one axis it was cannot be told where there are only two."""
    run = offset(0.02, sweep_2)(readings_of(Setup(noise_rad_s=0.005))).recording()
    outcome = calibrate([run])
    assert not outcome.passed
    named = [check.name for check in outcome.checks if check.means.sweep is not None]
    assert named == ["gyro.disturbed_sweep.2", "gyro.disturbed_sweep.3"]
    assert contradicting_sweeps([run]) == {2, 3}


@pytest.mark.slow
def test_of_several_sweeps_alike_the_disturbed_one_is_named_alone() -> None:
    setup = Setup(noise_rad_s=0.005, repeats=2, rest_s=1.0, speed_deg_s=120.0)
    assert contradicting_sweeps([offset(0.02, sweep_2)(readings_of(setup)).recording()]) == {2}


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize(
    ("rest_s", "repeats", "without"),
    [(0.0, 1, {"sweeps_against_rests", "skewed_noise", "bias_jumped"}), (0.7, 1, set()), (1.0, 3, set())],
    ids=["no rests", "short rests", "eighteen sweeps"],
)
def test_other_procedures_are_held_against_themselves_too(rest_s: float, repeats: int, without: set[str]) -> None:
    setup = Setup(noise_rad_s=0.005, rest_s=rest_s, repeats=repeats, speed_deg_s=120.0)
    checks = judged(synthetic_run(setup))[0]
    everything = {check.name.split(".")[1] for check in judged(synthetic_run(Setup(noise_rad_s=0.005)))[0]}
    assert {check.name.split(".")[1] for check in checks} == everything - without
    assert not failed(checks)


@pytest.mark.slow
@pytest.mark.parametrize("rms_counts", [3.0, 6.0, 12.0])
def test_an_arm_that_vibrates_under_a_quiet_sensor_is_no_stuck_bit(rms_counts: float) -> None:
    """One count of noise and a steady 14 Hz: readings crowd at the ends of the swing, whatever bits are set there."""
    time_s = np.arange(520)[:, None] / 200
    for seed in range(10):
        rng = np.random.default_rng(seed)
        windows = []
        for sweep in range(6):
            swing = rms_counts * np.sqrt(2) * np.sin(2 * np.pi * 14 * time_s + rng.uniform(0, 2 * np.pi, 3))
            counts = np.round(rng.uniform(-50, 50, 3) + swing + 1.03 * rng.standard_normal((len(time_s), 3)))
            windows.append(RawReadings(sweep, counts.astype(np.int64), counts - counts.mean(axis=0), np.zeros(3)))
        stuck, _ = judge_readings([window.counts for window in windows], windows, FALSE_ALARM_PROBABILITY / 10)[
            "stuck_bit"
        ]
        assert stuck == 0, seed


def test_a_low_bit_that_is_stuck_is_found_under_vibration_too() -> None:
    rng = np.random.default_rng(1)
    swing = 12 * np.sin(2 * np.pi * 14 * np.arange(520)[:, None] / 200)
    counts = np.round(swing + 5 * rng.standard_normal((520, 3))).astype(np.int64) & ~1
    window = RawReadings(0, counts, counts - counts.mean(axis=0), np.zeros(3))
    stuck, _ = judge_readings([counts], [window], FALSE_ALARM_PROBABILITY / 10)["stuck_bit"]
    assert stuck >= 3


def test_a_rest_of_few_readings_is_held_against_the_noise_of_longer_ones() -> None:
    """The run was interrupted in it: of twenty readings, half may lie close together by chance."""
    rng = np.random.default_rng(1)
    windows = [RawReadings(sweep, *_noisy(rng, 280), np.zeros(3)) for sweep in range(6)]
    short = np.where(np.arange(20)[:, None] % 4, 0.1, 3.0) * _noisy(rng, 20)[1]
    windows.append(RawReadings(-1, np.round(short).astype(np.int64), short, np.zeros(3)))
    spikes, limit = judge_readings([window.counts for window in windows], windows, FALSE_ALARM_PROBABILITY / 10)[
        "spikes"
    ]
    assert spikes < limit
    short[7] = 9 * 15
    assert (
        judge_readings([window.counts for window in windows], windows, FALSE_ALARM_PROBABILITY / 10)["spikes"][0]
        > limit
    )


def test_a_rest_in_which_an_axis_stands_still_makes_no_sensor_without_noise() -> None:
    rng = np.random.default_rng(1)
    windows = [RawReadings(-1, *_noisy(rng, 280), np.zeros(3)) for _ in range(6)]
    windows[2].counts[:, 0] = windows[2].counts[0, 0]
    counts = [np.concatenate([window.counts for window in windows])]
    longest, limit = judge_readings(counts, windows, FALSE_ALARM_PROBABILITY / 10)["stuck_axis"]
    assert longest >= 280 > limit


def test_what_a_number_in_single_precision_rounds_is_no_stuck_bit() -> None:
    """A KVH 1775 says g in single precision, which is recorded in steps of 10 g / 2³⁰."""
    rng = np.random.default_rng(1)
    said = np.float32(0.7 + 0.005 * rng.standard_normal((4000, 3))).astype(np.float64)
    counts = np.asarray(np.round(said * 2**30 / 10), dtype=np.int64)
    assert np.mean(counts & 1) < 0.45  # which it would be taken for
    window = RawReadings(-1, counts, counts - counts.mean(axis=0), np.zeros(3))
    assert judge_readings([counts], [window], FALSE_ALARM_PROBABILITY / 10)["stuck_bit"][0] == 0


def _noisy(rng: np.random.Generator, readings: int) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) counts, and what of them is noise: 15 counts."""
    counts = np.round(15 * rng.standard_normal((readings, 3)))
    return counts.astype(np.int64), counts - counts.mean(axis=0)


def test_a_burst_of_vibration_in_a_turn_is_no_spike() -> None:
    """A single reading as large is one."""
    rng = np.random.default_rng(1)
    windows = [RawReadings(sweep, *_noisy(rng, 280), np.zeros(3)) for sweep in range(6)]
    residuals = windows[2].residual_counts
    scatter = residuals.std()
    residuals[100:106] += scatter * np.array([-4, 10, -7, 8, 11, -6])[:, None]
    spikes, limit = judge_readings([window.counts for window in windows], windows, FALSE_ALARM_PROBABILITY / 10)[
        "spikes"
    ]
    assert spikes < limit
    residuals[200] = 11 * scatter
    assert (
        judge_readings([window.counts for window in windows], windows, FALSE_ALARM_PROBABILITY / 10)["spikes"][0]
        > limit
    )

"""A sensor that no longer feels what the arm does is noticed, and its recording counts for nothing when resumed."""

from dataclasses import replace

import numpy as np
import pytest

from rig.data.recording.run_data import RunData
from rig.errors import Fault
from rig.observation.observed_run import observe_run
from rig.observation.reference.dwell_acceleration import DwellReading
from rig.observation.sound_steps import sound_sweeps
from rig.observation.statistics.mean import Mean
from rig.observation.stuck_check import check_dwells
from rig.observation.windows import Window, swept
from support.recordings.damaged_readings import readings_of
from support.recordings.synthetic_run import Setup, synthetic_run

USUAL = synthetic_run(Setup())
SETTINGS = USUAL.settings.observation


def stuck_in_sweep(index: int) -> RunData:
    """From the middle of a sweep on it reads what it read there, with its noise."""
    seen = readings_of(Setup())
    window = next(sweep.window for sweep in swept(USUAL) if sweep.sweep.index == index)
    turning, after = seen.between(window.start_s + 1, window.end_s - 1), seen.between(window.start_s + 3, 1e9)
    counts = USUAL.samples["gyro"]["counts"].astype(np.int64)
    noise = np.random.default_rng(5).normal(scale=counts[turning].std(axis=0), size=counts.shape)
    held = np.round(counts[turning].mean(axis=0) + noise).astype(np.int64)
    samples = USUAL.samples["gyro"].copy()
    samples["counts"][after] = held[after]
    return replace(USUAL, samples={"gyro": samples})


@pytest.mark.one_in(2)  # the other rest: `make proof`
@pytest.mark.slow
@pytest.mark.parametrize("index", [3, 4])
def test_a_gyroscope_that_turns_on_where_the_arm_rests_has_told_nothing(index: int) -> None:
    stuck = stuck_in_sweep(index)
    assert sound_sweeps(USUAL, SETTINGS) == frozenset(range(6))
    assert sound_sweeps(stuck, SETTINGS) == frozenset()  # the sweep in which it stuck looks like any other
    with pytest.raises(Fault, match=r"stuck_sensor|time_base_not_found"):
        observe_run(stuck, SETTINGS)


@pytest.mark.slow
def test_the_rest_after_a_sound_last_sweep_still_counts() -> None:
    with pytest.raises(Fault, match=r"stuck_sensor: at rest the gyroscope reads .* as if it turned"):
        observe_run(stuck_in_sweep(5), SETTINGS)


@pytest.mark.slow
def test_one_that_sticks_at_rest_is_told_from_a_wrong_unit_by_the_turn_the_other_way() -> None:
    window = next(sweep.window for sweep in swept(USUAL) if sweep.sweep.index == 5)
    samples, late = USUAL.samples["gyro"].copy(), readings_of(Setup()).between(window.start_s - 0.5, 1e9)
    noise = np.random.default_rng(5).normal(scale=20, size=(int(late.sum()), 3))
    samples["counts"][late] = np.round(noise + np.array([20, 150, 10]))
    with pytest.raises(Fault, match=r"stuck_sensor: in sweep 5 .*; in the other direction it read correctly"):
        observe_run(replace(USUAL, samples={"gyro": samples}), SETTINGS)


def dwell(name: str, pitch_deg: float, reading: tuple[float, float, float]) -> DwellReading:
    pitch = np.radians(pitch_deg)
    attitude = np.array([[np.cos(pitch), 0, -np.sin(pitch)], [0, 1, 0], [np.sin(pitch), 0, np.cos(pitch)]])
    mean = Mean(np.array(reading), np.full(3, 1e-6), np.full(3, 1e-2), 100)
    return DwellReading(0, name, mean, attitude, Window(0, 1), 22.0)


def test_an_accelerometer_that_reads_the_same_in_two_attitudes_is_named() -> None:
    site = USUAL.settings.site
    assert site is not None
    level = dwell("level", 0, (0.0, 0.0, 9.8))
    check_dwells([level, dwell("on its side", 90, (-9.8, 0.0, 0.0)), level], site)
    check_dwells([level, dwell("hardly turned", 5, (0.0, 0.0, 9.8))], site)
    with pytest.raises(Fault, match="stuck_sensor: the accelerometer reads the same in level and on its side"):
        check_dwells([level, dwell("on its side", 90, (0.1, 0.0, 9.8))], site)

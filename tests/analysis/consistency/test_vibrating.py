"""An arm that vibrates contradicts nothing: neither in the rests, nor between the sweeps, nor as the sensor turns."""

from dataclasses import replace

import numpy as np
import pytest

from rig.data.quantity import RATE
from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.observation.statistics.spectral_lines import LineSearch, find_angle_change_rad2, find_lines, waves
from support.recordings.checked_runs import check_run, list_failed
from support.recordings.drawn_recording import ADIS16465, KINDS, drawn


def shaken(run: RunData, hertz: tuple[float, ...], rms_rad_s: float) -> RunData:
    """With vibrations that no encoder sees, along an axis of the sensor's own each, at their frequencies."""
    samples = run.samples["gyro"].copy()
    time_s = 1e-6 * samples["board_time_us"]
    for place, each in enumerate(hertz):
        wave = np.sqrt(2) * rms_rad_s * np.sin(2 * np.pi * each * time_s + place)
        along = np.roll([1.0, 0.6, -0.4], place)
        counts = np.round(wave[:, None] * along / ADIS16465.channel(RATE).unit_per_count)
        samples["counts"] += counts.astype(samples["counts"].dtype)
    return replace(run, samples={"gyro": samples})


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize("hertz", [(11.87, 23.74), (17.5, 16.7)])
def test_a_vibration_and_another_of_twice_its_frequency_or_nearly_the_same_fail_nothing(
    hertz: tuple[float, ...],
) -> None:
    """Together two of them lean to one side, as noise with a wrong bit does; and what is left of one is none."""
    for seed in (3, 4):
        run = shaken(drawn(seed, KINDS["ADIS16465"]).run, hertz, 0.003)
        assert not list_failed(check_run(run)), seed


SEARCH = LineSearch(stands_out=30.0)


def sine(cycles: float, count: int) -> Array:
    return np.sin(2 * np.pi * cycles * np.arange(count) / count)[:, None] * [1.0, 0.5, -0.3]


def test_lines_that_come_to_be_one_are_none() -> None:
    """A jerk is no line: what lies about it would be taken for several."""
    rng = np.random.default_rng(1)
    noise = 0.01 * rng.standard_normal((600, 3))
    jerk = np.exp(-((np.arange(600) - 300.0) ** 2) / 8)[:, None] * sine(100.0, 600)
    for found in (find_lines(noise + sine(50.3, 600), SEARCH), find_lines(noise + 5 * jerk, SEARCH)):
        assert np.diff(np.sort(found)).min(initial=np.inf) >= 1.5
    assert find_lines(noise + sine(50.3, 600), SEARCH) == pytest.approx([50.3], abs=0.01)


def test_lines_that_are_known_are_held() -> None:
    noise = 0.01 * np.random.default_rng(2).standard_normal((600, 3))
    found = find_lines(noise + sine(50.3, 600) + sine(80.0, 600), SEARCH, np.array([49.3]))
    assert found[0] == 49.3 and found[1:] == pytest.approx([80.0], abs=0.05)


def test_a_swing_is_how_much_an_angle_differs_between_two_moments() -> None:
    count, seconds, cycles = 2000, 4.0, 40.0
    shaking = 0.3 * sine(cycles, count)
    columns = waves(np.array([cycles]), np.arange(count) / count)
    angle = np.cumsum(shaking, axis=0) * seconds / count
    differs = np.mean((angle[:, None] - angle[None, ::7]) ** 2, axis=(0, 1))
    assert find_angle_change_rad2(shaking, columns, np.array([cycles / seconds])) == pytest.approx(differs, rel=0.02)

"""A gyroscope that changes over a file of sweeps: named if it changes much, within U if less."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.analysis.external.external_recordings import budget_of, solve_swept
from rig.analysis.external.omissions import notes_on_changes, notes_on_speeds
from rig.errors import Fault
from rig.observation.external.csv_import import ExternalData
from support.external.loggers import Log, swept, turn_slowly, write_rates
from support.external.sweeps_as_files import average_files

BIAS_RAD_S = np.array([0.01, -0.02, 0.005])
HZ = 50


def stepped(folder: Path, size_rad_s: float, at: float, *, rests: bool = True) -> ExternalData:
    log = swept(HZ)
    readings = log.readings.copy()
    readings[int(at * len(readings)) :, 0] += size_rad_s
    rows = log.rows if rests else log.rows[log.rows[:, -1] > 0]
    return average_files(*write_rates(folder, Log(log.time_s, readings, rows)))


def turned(folder: Path, size_rad_s: float) -> ExternalData:
    log = turn_slowly(0.6, BIAS_RAD_S, rate_hz=HZ)
    readings = log.readings.copy()
    readings[len(readings) // 2 :, 0] += size_rad_s
    return average_files(*write_rates(folder, Log(log.time_s, readings, log.rows), motion="angle_rad"))


@pytest.mark.slow
@pytest.mark.parametrize(("at", "from_s", "rests"), [(0.3, "2", True), (0.5, "3", True), (0.5, "3", False)])
def test_a_jump_is_named_with_its_time_and_axis(tmp_path: Path, at: float, from_s: str, *, rests: bool) -> None:
    what = rf"bias_jumped: from {from_s}\d(\.\d)? s on the gyroscope reads 0\.02 rad/s more on x than"
    with pytest.raises(Fault, match=what):
        solve_swept(stepped(tmp_path, 0.02, at, rests=rests), None)


@pytest.mark.slow
def test_u_contains_a_step_that_wrong_rates_could_be(tmp_path: Path) -> None:
    """Without rests, four sweeps after the step and two before hardly tell one from the other."""
    data = stepped(tmp_path, 0.02, 0.3, rests=False)
    solution = solve_swept(data, None)
    expanded = budget_of(solution, data).expanded
    for of_x in (-BIAS_RAD_S[0], -BIAS_RAD_S[0] - 0.02):  # at first and at the end
        assert abs(solution.bias_rad_s[0] - of_x) < expanded[3]


@pytest.mark.slow
@pytest.mark.parametrize("at", [0.3, 0.5, 0.56, 0.8])
def test_u_contains_a_bias_that_moves_less(tmp_path: Path, at: float) -> None:
    data = stepped(tmp_path, -0.003, at)
    solution = solve_swept(data, None)
    expanded = budget_of(solution, data).expanded
    for of_x in (-BIAS_RAD_S[0], -BIAS_RAD_S[0] + 0.003):  # at first and at the end
        assert abs(solution.bias_rad_s[0] - of_x) < expanded[3]


@pytest.mark.slow
@pytest.mark.parametrize("size_rad_s", [0.006, 0.02, 0.06])
def test_a_jump_between_turns_by_angle_is_named(tmp_path: Path, size_rad_s: float) -> None:
    with pytest.raises(Fault, match=r"bias_jumped: from 5\d\.\d+ s on the gyroscope reads 0\.\d+ rad/s more on x"):
        solve_swept(turned(tmp_path, size_rad_s), None)


@pytest.mark.slow
def test_u_contains_a_bias_that_moves_less_between_turns(tmp_path: Path) -> None:
    data = turned(tmp_path, 0.001)
    solution = solve_swept(data, None)
    expanded = budget_of(solution, data).expanded
    for of_x in (BIAS_RAD_S[0], BIAS_RAD_S[0] + 0.001):  # at first and at the end
        assert abs(solution.bias_rad_s[0] + of_x) < expanded[3]


@pytest.mark.slow
def test_scale_factors_that_change_between_the_rounds_are_named(tmp_path: Path) -> None:
    log = swept(HZ)
    lasts_s = log.time_s[-1] + 1 / HZ
    time_s = np.concatenate([log.time_s, log.time_s + lasts_s])
    readings = np.concatenate([log.readings, BIAS_RAD_S + 1.02 * (log.readings - BIAS_RAD_S)])
    later = log.rows + np.array([lasts_s, lasts_s, 0, 0, 0, 0])
    data = average_files(*write_rates(tmp_path, Log(time_s, readings, np.concatenate([log.rows, later]))))
    with pytest.raises(
        Fault, match=r"scale_changed: from \d+.* s on the gyroscope reads 2 % more on [xyz] of the same"
    ):
        solve_swept(data, None)


@pytest.mark.slow
def test_whole_turns_in_degrees_are_told_though_no_speed_is_unusual(tmp_path: Path) -> None:
    log = swept(HZ)  # a turn in 4 s
    slow = Log(4 * log.time_s, log.readings / 4, log.rows * np.array([4, 4, 1, 1, 1, 0.25]))
    in_degrees = Log(slow.time_s, np.degrees(slow.readings), slow.rows * np.array([1, 1, 1, 1, 1, 180 / np.pi]))
    assert not list(notes_on_speeds(average_files(*write_rates(tmp_path, slow))))
    first, *_ = notes_on_speeds(average_files(*write_rates(tmp_path, in_degrees)))
    assert first.startswith("each sweep turns by a whole multiple of 90 rad") and "if both files are in °/s" in first


@pytest.mark.slow
def test_a_body_that_shakes_in_its_turns_is_no_unit_that_is_wrong(tmp_path: Path) -> None:
    log = swept(HZ)
    shake_rad_s = 0.2 * np.sin(2 * np.pi * 7 * log.time_s)[:, None]
    turning = np.linalg.norm(log.readings, axis=1, keepdims=True) > 0.5
    shaken = Log(log.time_s, log.readings + turning * shake_rad_s, log.rows)
    assert not list(notes_on_speeds(average_files(*write_rates(tmp_path, shaken))))
    noisy = swept(HZ, noise_rad_s=0.05)
    assert "scatter by 0.05 rad/s" in next(notes_on_speeds(average_files(*write_rates(tmp_path, noisy))))


def test_a_file_too_long_to_be_examined_for_changes_is_noted(tmp_path: Path) -> None:
    data = average_files(*write_rates(tmp_path, swept(HZ)))
    assert not list(notes_on_changes(data))
    (note,) = notes_on_changes(replace(data, sweeps=data.sweeps * 101))
    assert note.startswith("abrupt changes of the sensor were not searched for: there are 6")

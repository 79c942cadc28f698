"""A reference that stops and repeats its last attitude while the body goes on, and clocks that differ by seconds."""

from dataclasses import replace

import numpy as np
import pytest

from rig.errors import Fault
from rig.observation.external.reference_clock import check_offset, check_one_clock
from rig.observation.external.still_attitudes import find_frozen
from rig.observation.time_stamps.stamp_order import order_stamps
from support.external.followed_body import World, follow, turning

WORLD = World(stops_s=(10.0,), stop_lasts_s=3.0, attitude_rad=0.0)


@pytest.mark.parametrize("stopped_s", [3.5, 12.0])
def test_a_reference_that_stops_is_no_rest(stopped_s: float) -> None:
    rows = turning(follow(WORLD, 1))
    middles_s, attitudes = rows.rows_s.mean(axis=1), rows.attitudes.copy()
    assert not find_frozen(rows.rows_s, attitudes, rows.time_s, rows.readings_rad_s).any(), "of the body at rest"
    first, end = np.searchsorted(middles_s, [20.0, 20.0 + stopped_s])
    attitudes[first:end] = attitudes[first]
    frozen = find_frozen(rows.rows_s[::-1], attitudes[::-1], rows.time_s, rows.readings_rad_s)[::-1]
    assert np.flatnonzero(frozen).tolist() == list(range(first + 1, end))


def test_long_rows_of_one_attitude_between_which_the_body_was_lifted_are_rests() -> None:
    rows = turning(follow(WORLD, 1))
    windows_s = np.array([[2.0, 4.0], [4.2, 6.0], [6.2, 8.0]])
    assert not find_frozen(windows_s, rows.attitudes[[0, 0, 0]], rows.time_s, rows.readings_rad_s).any()


@pytest.mark.slow
def test_times_from_coarse_stamps_are_compared_without_a_warning() -> None:
    rows = turning(follow(World(), 1))
    ordered = order_stamps(np.rint(10 * rows.time_s) / 10, rows.readings_rad_s)
    check_one_clock(replace(rows, time_s=ordered.time_s), None)


@pytest.mark.parametrize("late_s", [-2.0, 1.5])
def test_another_offset_of_the_clocks_that_explains_the_readings_is_named(late_s: float) -> None:
    rows = turning(follow(World(), 1))
    check_offset(rows)
    with pytest.raises(Fault, match=f"clocks_apart: .* {abs(late_s):g} s too {'late' if late_s > 0 else 'early'}"):
        check_offset(replace(rows, rows_s=rows.rows_s + late_s))


@pytest.mark.parametrize(
    ("step_s", "name"), [(2.0, r"set by (2|1\.9) s in between"), (-3.0, "set back by 3 s after 2[45]")]
)
def test_a_clock_that_was_set_during_the_recording_is_named(step_s: float, name: str) -> None:
    rows = turning(follow(World(), 1))
    rows_s = rows.rows_s + (step_s + 1e-4) * (rows.rows_s[:, :1] > 25)
    with pytest.raises(Fault, match=f"clocks_apart: .* {name}"):
        check_offset(replace(rows, rows_s=rows_s))

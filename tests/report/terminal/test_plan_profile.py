"""What a plan's sweeps are for a rate table: a profile of each axis, to be typed into the table's own editor."""

import math
from itertools import pairwise
from typing import Literal

import numpy as np
import pytest

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixObservationSection
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.report.terminal.plan_profile import HEADINGS, profile
from support.laboratories.commands import rig
from support.paths import DEMO

ARM = ArmSection(host="127.0.0.1", payload_kg=0.35)


@pytest.mark.parametrize("axes", [3, 6])
def test_every_axis_turns_both_ways_through_more_than_a_whole_turn_at_an_even_rate(axes: Literal[3, 6]) -> None:
    plan = plan_six_observation(ARM, SixObservationSection(name="six_observation", axes=axes))
    points = profile(plan)
    by_axis = {
        axis: [point for point in points if point.axis == axis] for axis in dict.fromkeys(p.axis for p in points)
    }
    assert len(by_axis) == axes and {"x", "y", "z"} <= {*by_axis}
    for along in by_axis.values():
        times, rates = np.array([p.at_s for p in along]), np.array([p.rate_deg_s for p in along])
        angles = np.array([p.angle_deg for p in along])
        assert times[0] == 0 and (np.diff(times) >= 0).all() and rates[0] == rates[-1] == 0
        # Between two corners the rate changes evenly: its integral is the angle.
        np.testing.assert_allclose(np.diff(angles), (rates[1:] + rates[:-1]) / 2 * np.diff(times), atol=1e-9)
        even = [b.angle_deg - a.angle_deg for a, b in pairwise(along) if a.rate_deg_s == b.rate_deg_s != 0]
        assert len(even) == 2 and even[0] * even[1] < 0 and min(map(abs, even)) > 360
        assert abs(angles[-1]) < 1e-9 and math.isclose(max(abs(rates)), 60)


@pytest.mark.slow
def test_the_command_prints_it_as_csv() -> None:
    done = rig("plan", DEMO, "--table")
    assert done.returncode == 0, done.stderr
    first, *rows = done.stdout.splitlines()
    assert first == ",".join(HEADINGS)
    assert len(rows) == 24 and rows[0] == "z,0.0000,0.0000,0,at rest" and all("-0.0000" not in row for row in rows)
    both = rig("plan", DEMO, "--table", "--json")
    assert both.returncode == 2 and "not allowed with" in both.stderr

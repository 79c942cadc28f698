"""A servo's turn: its encoder is out by a degree and scatters, its gear ripples, and the means have nothing of that."""

from functools import cache

import numpy as np
import pytest

from rig.analysis.gyroscope.calibration import observe_recordings
from rig.observation.observe import Observation
from rig.world.servo.shaft import Shaft
from support.motions.drawn_servo import drawn_servo

pytestmark = pytest.mark.slow

FEW, SEEDS = 1, 10  # in `make test`, and in `make proof`
NOISE_RAD_S = 5e-4  # of a good gyroscope
QUIET = ("uncertainty.g_sensitivity_deg_s_g=0", "turner.state_rate_hz=100",
         "procedure.speed_deg_s=75", "procedure.rest_s=2")  # fmt: skip


@cache
def turns(seed: int) -> list[tuple[Observation, Shaft]]:
    """Every turn of a run, and the shaft that made it."""
    drawn = drawn_servo(seed, QUIET, noise_rad_s=NOISE_RAD_S)
    seen = observe_recordings(drawn.runs)
    return [
        (turn, shaft)
        for each, shaft in zip(seen, drawn.shafts, strict=True)
        for turn in each.sensors["gyro"].revolutions
    ]


@pytest.mark.thorough
def test_beside_a_servos_lines_the_noise_is_that_of_the_gyroscope_alone() -> None:
    """Three times a turn, 18 and 22 times: what is as large as the noise, and would be taken for coloured noise."""
    scatter = np.array([turn.average.variance_rad2_s2 * turn.average.samples for turn, _ in turns(0)]) / NOISE_RAD_S**2
    assert scatter.min() > 0.8, scatter
    assert scatter.max() < 1.4, scatter


@pytest.mark.proof
def test_a_servos_speed_is_as_accurate_as_stated(thorough: bool) -> None:
    """What its encoder sees of the lines is how single readings scatter: ten times as much as a turn's time is out."""
    off = []
    for turn, shaft in [turn for seed in range(SEEDS if thorough else FEW) for turn in turns(seed)]:
        start_s, end_s = turn.average.start_s, turn.average.end_s
        true = abs(shaft.angle_at(end_s) - shaft.angle_at(start_s)) / (end_s - start_s)
        off.append((turn.speed_rad_s - true) / turn.speed_std_rad_s)
    assert np.sqrt(np.mean(np.square(off))) < 1.6, off
    assert np.abs(off).max() < 4, off

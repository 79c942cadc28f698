"""A bias that increments tell is held against what the gyroscope reads at rest, however short the rests are."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.external.increment_calibration import solve_turning
from rig.analysis.external.rests_agree import check_rests_agree
from rig.errors import Fault
from rig.estimation.external.increment_solution import ROUNDING
from rig.estimation.reference.reference_model import BIAS
from rig.observation.external.means_at_rest import means_at_rest
from support.external.followed_body import World, follow, turning

pytestmark = pytest.mark.slow

# As of a reference with bad time stamps: it errs much while the body moves, and little at rest.
STOPPING = World(duration_s=30, attitude_rad=6e-3, colour_s=0.5, stops_s=(7.0, 14.0, 21.0))
OFF_RAD_S = 0.02


@pytest.mark.parametrize("stop_lasts_s", [0.8, 3.0])
def test_a_bias_that_short_rests_contradict_is_refused_and_a_sound_one_is_not(stop_lasts_s: float) -> None:
    body = turning(follow(replace(STOPPING, stop_lasts_s=stop_lasts_s), 1))
    sound = solve_turning(body, None, any_mounting=False).solution
    for axis in np.eye(3):
        with pytest.raises(Fault, match="bias_contradicts_rests"):
            off = replace(sound, bias=sound.bias + OFF_RAD_S * axis)
            check_rests_agree(off, means_at_rest(body, sound.clock_s))


@pytest.mark.parametrize("step_rad_s", [0.01, 1e-6])
def test_the_bias_contains_the_rounding_that_all_rests_share(step_rad_s: float) -> None:
    """With steps that are coarse for the noise, each rest repeats the same wrong number."""
    world = World(duration_s=60, attitude_rad=1e-3, random_walk_rad_sqrt_s=2e-4, stops_s=(7.0, 14.0, 21.0, 28.0))
    followed = follow(replace(world, stop_lasts_s=3.0), 1)
    readings = step_rad_s * np.rint(followed.readings / step_rad_s)
    solved = solve_turning(turning(replace(followed, readings=readings)), None, any_mounting=False)
    error = np.abs(solved.solution.bias - followed.bias)
    std = np.sqrt(np.diag(solved.solution.covariance)[BIAS])
    assert (error < 3 * std).all(), error / std
    assert (ROUNDING in solved.solution.causes) == (step_rad_s > 1e-3)


@pytest.mark.proof
@pytest.mark.thorough
def test_sound_recordings_are_hardly_ever_refused() -> None:
    """By 1 in 1000; of 300 no more than two, with cameras' errors as well."""
    refused = []
    for seed in range(300):
        world = replace(STOPPING, attitude_rad=(6e-3, 1e-3)[seed % 2], colour_s=(0.5, 0.0, 0.1)[seed % 3])
        try:
            solve_turning(turning(follow(world, seed)), None, any_mounting=False)
        except Fault as fault:
            refused.append((seed, fault.name))
    assert sum(name == "bias_contradicts_rests" for _, name in refused) <= 2, refused

"""A turn of a shaft whose readings scatter, and what its rates are, from the simulated servo in virtual time."""

from dataclasses import replace

import numpy as np
import pytest

from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.motion.steps import Sweep
from rig.observation.arm_rests import trim_rest
from rig.observation.motion.arm_motion import motion_of
from rig.observation.motion.even_turn import GUARD_RAD, find_even_turn, fit_lines
from rig.observation.windows import iterate_rests, swept
from support.motions.drawn_servo import Drawn, drawn_servo

SHARE = 5e-5  # of the scale's uncertainty, that the turning may have


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    return drawn_servo(7)


@pytest.mark.thorough
@pytest.mark.slow
def test_the_time_of_a_turn_is_known_to_a_few_hundred_thousandths(drawn: Drawn) -> None:
    for run in drawn.runs:
        motion = motion_of(run)
        for finished in swept(run):
            turn = motion.turn(finished.sweep, finished.window, run.settings.observation)
            assert turn.closed and turn.speed_std_rad_s / turn.speed_rad_s < SHARE
            assert np.abs(turn.axis_flange @ np.array(run.settings.mount)[:, 2]) == pytest.approx(1.0)


@pytest.mark.slow
def test_what_turned_the_encoder_wrong_is_not_in_the_speed(drawn: Drawn) -> None:
    """The drive turns by 2π where its encoder says so, a servo's time between: T by the truth is what is found."""
    run = drawn.runs[0]
    motion, sweep = motion_of(run), next(swept(run))
    turn = motion.turn(sweep.sweep, sweep.window, run.settings.observation)
    times = np.linspace(turn.start_s, turn.end_s, 4001)
    rate = np.array([drawn.shafts[0].rate_at(time) for time in times.tolist()])
    truth = float(np.mean((rate[1:] + rate[:-1]) / 2))
    assert truth == pytest.approx(turn.speed_rad_s, rel=4 * SHARE)


@pytest.mark.slow
def test_a_shaft_that_dithers_is_at_rest(drawn: Drawn) -> None:
    motion = motion_of(drawn.runs[0])
    assert all(trim_rest(motion, window) is not None for window in iterate_rests(drawn.runs[0]))


@pytest.mark.slow
def test_a_turn_that_was_not_ended_is_refused(drawn: Drawn) -> None:
    run = drawn.runs[0]
    motion, finished = motion_of(run), next(swept(run))
    middle_s = (finished.window.start_s + finished.window.end_s) / 2
    cut = motion_of(replace(run, states=run.states[run.states["time_s"] < middle_s]))
    with pytest.raises(Fault, match="incomplete_revolution"):
        cut.turn(finished.sweep, finished.window, run.settings.observation)
    assert motion.turn(finished.sweep, finished.window, run.settings.observation).closed


def test_smoothed_rates_are_those_of_a_line() -> None:
    time_s = np.sort(np.random.default_rng(1).uniform(0, 4, 500))
    middles, angles, rates = fit_lines(time_s, (2.0 + 0.7 * time_s)[:, None])
    assert np.allclose(angles[:, 0], 2.0 + 0.7 * middles) and np.allclose(rates, 0.7)


@pytest.mark.parametrize(("beyond", "is_whole"), [(0, False), (1, True)])
def test_a_turn_is_whole_as_soon_as_one_state_shows_that_its_even_part_has_ended(beyond: int, is_whole: bool) -> None:
    angle = np.arange(0.0, 9.0, 0.01)  # at 1 rad/s throughout
    sweep = Sweep(0, 0, "shaft", "ccw", (0.0, 0.0, 1.0), (0.0,), (9.0,), 1.0, 5.0, 9.2, (1.36, 7.64))
    last = np.flatnonzero(angle <= 9.0 - 0.1 - GUARD_RAD)[-1]
    states = np.zeros(last + 1 + beyond, [("time_s", float), ("q_rad", float, 1)])
    states["time_s"], states["q_rad"][:, 0] = angle[: len(states)], angle[: len(states)]
    thresholds = ObservationThresholds(max_lost_fraction=0.01, max_speed_deviation=0.01, max_axis_deviation_deg=10.0)
    if is_whole:
        ends = find_even_turn(states, sweep, thresholds)
        assert ends.end_s - ends.start_s == pytest.approx(2 * np.pi)
    else:
        with pytest.raises(Fault, match="incomplete_revolution"):
            find_even_turn(states, sweep, thresholds)

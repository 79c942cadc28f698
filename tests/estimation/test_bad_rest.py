"""A rest in which the body crept costs itself: the first of a session, and an earlier one while it goes on."""

from dataclasses import replace

import numpy as np
import pytest

from rig.estimation.by_hand import SessionConditions, solve_by_hand
from rig.estimation.by_hand.bad_rest import find_bad_rest
from rig.estimation.by_hand.session_parts import HandRecording
from rig.observation.by_hand.hand_segmentation import segment_session
from support.external.handled_body import TWELVE, Recorded, creeping, handle

CONDITIONS = SessionConditions(50.0, "the board's crystal")
TURNING_RAD_S = np.radians([0.2, -0.15, 0.1])


def session_of(recorded: Recorded) -> HandRecording:
    return segment_session(recorded.time_s, recorded.rates, recorded.acceleration)


def crept_in(recorded: Recorded, row: int) -> Recorded:
    rest = session_of(recorded).rests[row]
    start_s = rest.start_s - 0.2 if row else 0.0
    return creeping(recorded, start_s, rest.end_s + 0.1, TURNING_RAD_S)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 5])
def test_a_first_rest_in_which_it_crept_is_left_out(seed: int) -> None:
    recorded = handle(TWELVE, seed)
    solution = solve_by_hand(session_of(crept_in(recorded, 0)), CONDITIONS)
    assert len(solution.creeping_s) == 1 and solution.creeping_s[0][0] < 1.0
    expanded = 2 * np.sqrt(np.diag(solution.budget.covariance))
    off = np.concatenate([solution.scale, solution.bias_rad_s]) - recorded.truth
    assert (np.abs(off) < 1.5 * expanded).all()


@pytest.mark.slow
def test_a_bias_that_jumps_after_the_first_rest_costs_that_rest() -> None:
    recorded = handle(TWELVE, 3)
    step = np.array([0.0016, -0.002, 0.0])
    jumped = recorded.time_s > session_of(recorded).moves[0].end_s - 0.15
    solution = solve_by_hand(session_of(replace(recorded, rates=recorded.rates + np.outer(jumped, step))), CONDITIONS)
    assert len(solution.creeping_s) == 1
    expanded = 2 * np.sqrt(np.diag(solution.budget.covariance))
    off = np.concatenate([solution.scale, solution.bias_rad_s + step]) - recorded.truth
    assert (np.abs(off) < 1.5 * expanded).all()


@pytest.mark.slow
def test_a_sound_first_rest_stays() -> None:
    assert solve_by_hand(session_of(handle(TWELVE, 3)), CONDITIONS).creeping_s == ()


@pytest.mark.slow
@pytest.mark.parametrize("row", [1, 2, 3])
def test_an_early_rest_that_spoils_the_session_is_found(row: int) -> None:
    session = session_of(crept_in(handle(TWELVE, 3), row))
    so_far = replace(session, rests=session.rests[:8], moves=session.moves[:7])
    assert find_bad_rest(so_far, CONDITIONS) == row


@pytest.mark.slow
def test_too_few_rests_do_not_show_which_one_is_bad() -> None:
    session = session_of(handle(TWELVE, 3))
    assert find_bad_rest(replace(session, rests=session.rests[:5], moves=session.moves[:4]), CONDITIONS) is None

"""A calibration by hand that the board's core makes by itself, against double precision and against the truth."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest

from firmware_host.emulator.chip.gpio import Port
from firmware_host.hand_answers import BoardHandSolution, HandReport
from rig.analysis.by_hand.on_board import BIAS_LIMIT_RAD_S, SCALE_LIMIT, BoardReadings, compare_with_board
from rig.errors import Fault
from rig.world.hand.habits import Action, FlipAction, Mistake, MistakeKind, TurnAction
from support.board.emulated_session import Session
from support.board.hand_on_board import (
    Played,
    alone,
    begun,
    convert_to_counts,
    give,
    play,
    press,
    query,
    run_button_session,
)
from support.board.host_board import HostBoard, configure, core, error_of
from support.external.handled_body import LSM9DS1, TWELVE, Recorded, handle

pytestmark = pytest.mark.slow

REST_S = 1.6
BUTTON = 6  # of port B
SIXTEEN: tuple[Action, ...] = (*TWELVE, TurnAction(1), TurnAction(-1), FlipAction("+x"), TurnAction(1))


def twelve(mistake_at: int | None = None, kind: MistakeKind = "held", seed: int = 3) -> Recorded:
    """Twelve flips, one of them with a mistake."""
    actions = list(TWELVE)
    if mistake_at is not None:
        flip = actions[mistake_at]
        assert isinstance(flip, FlipAction)
        actions[mistake_at] = replace(flip, mistake=Mistake(kind))
    return handle(actions, seed, rest_s=REST_S)


def lamp(now_us: int) -> bool:
    """Whether the board's lamp is lit."""
    lit = core().hand_lamp
    lit.restype = ctypes.c_bool
    return bool(lit(ctypes.c_uint64(now_us)))


@pytest.fixture(scope="module")
def played() -> Played:
    return play(twelve())


def test_twelve_flips_are_found_and_taken(played: Played) -> None:
    assert played.outcomes == ["accepted"] * 12
    assert [report.after for report in played.reports] == [flip.to for flip in TWELVE if isinstance(flip, FlipAction)]
    assert played.solved.state == "done"
    assert played.solved.accepted == 12


@pytest.mark.one_in(4)
@pytest.mark.parametrize("seed", range(4))
def test_the_board_agrees_with_double_precision_and_with_the_truth(seed: int) -> None:
    recorded = twelve(seed=seed)
    played = play(recorded)
    agreement = played.agreement
    assert agreement.matrix_difference < SCALE_LIMIT / 2
    assert agreement.bias_difference_rad_s < BIAS_LIMIT_RAD_S / 2
    assert agreement.host.scale_std == pytest.approx(played.reports[-1].scale_std, rel=1e-3)
    assert np.max(np.abs(played.scale / recorded.truth[:3] - 1)) < 3.5 * played.reports[-1].scale_std
    assert np.max(np.abs(np.array(played.solved.bias_rad_s) - recorded.truth[3:])) < 3e-4


def test_a_scale_of_the_turntables_part_needs_more_moves_and_whole_turns_count() -> None:
    recorded = handle(SIXTEEN, 5, rest_s=REST_S)
    off = 1.1771
    recorded = replace(recorded, rates=recorded.rates / off, matrix=recorded.matrix / off, bias=recorded.bias / off)
    played = play(recorded, moves=16, scale_std=2e-3)
    assert played.outcomes == ["accepted"] * 16
    assert [report.whole for report in played.reports[12:]] == [True, True, False, True]
    assert played.agreement.matrix_difference < SCALE_LIMIT / 2
    assert np.max(np.abs(played.scale / recorded.truth[:3] - 1)) < 2e-3


def test_a_slow_part_that_is_left_alone_for_a_minute() -> None:
    actions = (*TWELVE[:4], FlipAction("-y", Mistake("left", 60.0)), *TWELVE[5:])
    slow = play(handle(actions, 1, replace(LSM9DS1, rate_hz=59.5), rest_s=2.0))
    assert slow.outcomes == ["accepted"] * 12
    assert slow.agreement.matrix_difference < SCALE_LIMIT


def test_a_touched_box_costs_nothing() -> None:
    actions = (
        *TWELVE[:4],
        FlipAction("-x", Mistake("lifted")),
        *TWELVE[4:],
    )  # lifted by a corner, and on that face already
    played = play(handle(actions, 1, rest_s=REST_S))
    assert [outcome for outcome in played.outcomes if outcome != "nothing"] == ["accepted"] * 12
    assert "nothing" in played.outcomes
    assert played.agreement.matrix_difference < SCALE_LIMIT


def test_a_move_beyond_the_range_is_asked_again() -> None:
    recorded = twelve(5, "too_fast")
    played = play(recorded)
    assert np.abs(recorded.rates).max() > np.radians(573)
    assert played.outcomes[5] == "clipped"
    assert played.outcomes.count("accepted") == 11
    assert played.solved.state == "resting"


def test_a_move_in_which_readings_are_missing_is_asked_again() -> None:
    recorded = twelve(5, "cable_pulled")
    numbers = np.round(recorded.time_s * 119.0).astype(int)  # the board counts what it did not get as well
    played = play(recorded, number=numbers)
    assert played.outcomes[5] == "lost"
    assert played.outcomes.count("accepted") == 11


def test_a_box_that_lies_on_no_face_is_asked_again_and_the_move_from_there_tells_nothing() -> None:
    recorded = twelve()
    played = play(recorded)
    third = played.reports[3]
    lies = (played.times_us >= third.after_us) & (played.times_us <= played.reports[4].move_us + 50_000)
    leaning = recorded.acceleration.copy()
    leaning[lies] = [5.0, 5.0, 7.0]
    again = play(replace(recorded, acceleration=leaning))
    assert again.outcomes[3:5] == ["no_face", "nothing"]
    assert again.reports[3].after is None
    assert again.outcomes.count("accepted") == 10


def test_a_turn_that_ends_short_contradicts_what_is_known() -> None:
    played = play(handle((*TWELVE, TurnAction(1, Mistake("short")), TurnAction(1)), 3, rest_s=REST_S), moves=14)
    assert played.outcomes == [*["accepted"] * 12, "contradicts", "accepted"]


def test_a_box_on_another_face_than_its_accelerometer_says_is_far_from_what_is_known() -> None:
    recorded = twelve()
    reports = play(recorded).reports
    swapped = recorded.acceleration.copy()
    swapped[recorded.time_s > reports[0].after_us * 1e-6 - 0.2] *= -1.0
    played = play(replace(recorded, acceleration=swapped))
    assert played.outcomes[0] == "contradicts"


def test_after_ten_refused_moves_in_a_row_it_gives_up() -> None:
    recorded = twelve()
    played = play(replace(recorded, rates=np.clip(recorded.rates, -0.9, 0.9) * 12.0))  # at its end in every move
    assert played.outcomes == ["clipped"] * 10
    assert played.solved.state == "failed"
    now_us = int(played.times_us[-1])
    assert {lamp(now_us + 10_000 * index) for index in range(20)} == {True, False}


def test_a_box_that_is_held_askew_in_the_hand_is_asked_again() -> None:
    played = play(twelve(2, "held"))
    assert played.outcomes == ["accepted", "accepted", "no_face", "nothing", *["accepted"] * 8]


def test_what_is_missing_in_the_readings_of_the_host_is_named(played: Played) -> None:
    kept = np.arange(len(played.times_us)) != np.searchsorted(played.times_us, played.reports[2].move_us + 500_000)
    gappy = BoardReadings(played.times_us[kept], np.flatnonzero(kept), played.rates[kept], 1e-6)
    with pytest.raises(Fault, match="did not arrive") as missing:
        compare_with_board(gappy, played.reports, played.solved)
    assert missing.value.name == "board_unverified"
    with pytest.raises(Fault, match="accepted 12 moves, of which this computer received 11"):
        compare_with_board(played.readings, played.reports[1:], played.solved)
    (mxx, mxy, mxz), second, third = played.solved.matrix
    wrong = replace(played.solved, matrix=((mxx * 1.00003, mxy, mxz), second, third))
    with pytest.raises(Fault) as differs:
        compare_with_board(played.readings, played.reports, wrong)
    assert differs.value.name == "board_disagrees"


def test_what_is_asked_of_a_board_that_cannot_is_refused() -> None:
    board = HostBoard()
    assert error_of(board.ask("by_hand", sensor=9, moves=12, scale_std=1e-3)) == "no_such_sensor"
    assert error_of(board.ask("by_hand", sensor=0, moves=12, scale_std=1e-3)) == "not_configured"
    configure(board, 0, 119.0, 500.0)
    assert error_of(board.ask("by_hand", sensor=0, moves=12, scale_std=1e-3)) == "bad_range"
    assert HandReport.decode(query(board, "hand_status")).state == "idle"


def test_a_sensor_set_up_anew_ends_its_session_and_no_other() -> None:
    board, _ = begun()
    configure(board, 1, 200.0, 250.0)
    assert HandReport.decode(query(board, "hand_status")).state == "starting"
    configure(board, 0, 119.0, 500.0, 4.0)
    assert HandReport.decode(query(board, "hand_status")).state == "idle"


def test_the_lamp_tells_rest_taken_again_and_done() -> None:
    recorded = handle((*TWELVE[:4], TurnAction(1), *TWELVE[4:]), 3, rest_s=4.0)
    board, setup = begun()
    times_us, counts, forces = convert_to_counts(recorded, setup)
    lit: dict[str, list[bool]] = {}
    since_us, judged = 0, 0
    end = np.searchsorted(times_us, times_us[-1] - 3_000_000)
    for number, (time_us, rate, force) in enumerate(zip(times_us[:end].tolist(), counts, forces, strict=False)):
        give(board, time_us, number, rate, force)
        report = HandReport.decode(query(board, "hand_status"))
        if report.judged != judged:
            judged, since_us = report.judged, time_us
        told = "settled" if report.state == "resting" and time_us > since_us + 2_000_000 else report.state
        lit.setdefault(told, []).append(lamp(time_us))
    assert not any(lit["starting"]) and not any(lit["moving"])
    assert all(lit["settled"])
    assert 0.2 < np.mean(lit["resting"]) < 0.8
    assert 0.05 < np.mean(lit["done"]) < 0.2


# Without a computer: the button


def state_of(board: HostBoard) -> str:
    return HandReport.decode(query(board, "hand_status")).state


def test_the_button_sets_a_gyroscope_up_starts_it_and_begins_a_session() -> None:
    board = alone()
    press(board, 0, 20_000)
    assert state_of(board) == "idle", "it only rattled"
    press(board, 100_000)
    assert state_of(board) == "starting"
    assert query(board, "status").values["streaming"] == 1


def test_what_was_found_alone_stays_until_the_next_session() -> None:
    board = run_button_session(twelve())
    kept = BoardHandSolution.decode(query(board, "hand_solve"))
    assert (kept.state, kept.accepted, kept.sensor, kept.range_deg_s) == ("done", 12, 0, 500.0)
    assert kept.temperature_c == 25.0, "the middle of the part's scale, as was given"
    assert 1e-5 < kept.scale_std < 1e-3
    board.ask("stop", 2)
    configure(board, 0, 119.0, 245.0)
    configure(board, 1, 200.0, 250.0)
    assert BoardHandSolution.decode(query(board, "hand_solve")) == kept
    press(board, 100_000_000)
    assert state_of(board) == "starting"


def test_the_button_begins_anew_with_the_sensor_that_streams_accelerations_already() -> None:
    board, _ = begun()
    board.core.host_lock_clock(True)
    assert [frame.name for frame in board.ask("start", 2, sensors=0)] == ["ack"]
    recorded = twelve()
    times_us, counts, forces = convert_to_counts(
        recorded, {"sensitivity_rad_s": np.radians(0.0175), "sensitivity_m_s2": 0.0012}
    )
    for number, (time_us, rate, force) in enumerate(zip(times_us[:400].tolist(), counts, forces, strict=False)):
        give(board, time_us, number, rate, force)
    assert state_of(board) in ("resting", "moving")
    assert board.core.host_lamp() == (state_of(board) == "resting")
    for number in range(400, 430):  # it moves, so the lamp is dark
        give(board, 4_000_000 + 8_403 * number, number, np.array([9000, 0, 0]), forces[0])
    assert state_of(board) == "moving"
    press(board, 8_000_000, 60_000)
    assert state_of(board) == "starting"


def test_no_button_changes_a_stream_without_accelerations_or_begins_by_a_clock_without_its_crystal() -> None:
    board = alone()
    configure(board, 0, 119.0, 500.0)
    board.ask("start", 2, sensors=0)
    press(board, 0, 60_000)
    assert state_of(board) == "idle"
    board = alone(locked=False)
    press(board, 0, 60_000)
    assert state_of(board) == "idle"


def test_the_button_of_the_shipped_image_lights_the_lamp_at_the_first_rest() -> None:
    session = Session(rate_at=lambda _time_s: (0.0, 0.0, 0.0), noise_rad_s=0.002)
    (port,) = (
        peripheral
        for peripheral in session.board.peripherals
        if isinstance(peripheral, Port) and peripheral.name == "GPIOB"
    )
    session.run(2.5)  # until the crystal swings
    port.drive(BUTTON, high=True)
    session.run(0.1)
    port.drive(BUTTON, high=False)
    assert session.ask("status").values["streaming"] == 1
    assert HandReport.decode(session.ask("hand_status")).state == "starting"
    assert port.is_input(BUTTON)
    session.run(1.8)
    assert HandReport.decode(session.ask("hand_status")).state == "resting"
    assert not port.is_input(BUTTON), "the lamp is lit"

"""What of a session by hand does not count, and what is left of it then."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.analyses import calibrate_by_hand
from rig.data.recording.hand_events import HandBegunAnew, HandMoveRefused, HandRestRefused
from rig.data.recording.run_file import read_run
from rig.errors import Fault
from rig.estimation.by_hand.session_parts import HandRecording, HandRest, Move, SessionConditions
from rig.estimation.by_hand.solution import solve_by_hand
from rig.motion.by_hand import FACES
from rig.observation.by_hand.hand_segmentation import Segmenter
from rig.observation.by_hand.rests_and_moves import NotCounted, rotate_face
from support.paths import RECORDINGS

SECOND_US = 1_000_000


def session(rests: int) -> HandRecording:
    """Rests of a second each, every three seconds; the moves between have peaks 1, 2, 3, …"""
    zero = np.zeros(3)
    lain = tuple(HandRest(3.0 * place, 3.0 * place + 1.0, 100, zero, zero) for place in range(rests))
    moves = tuple(Move(3.0 * place + 1.0, 3.0 * place + 3.0, place + 1.0) for place in range(rests - 1))
    return HandRecording(np.zeros(0), np.zeros((0, 3)), None, lain, moves)


def starts(found: HandRecording) -> list[float]:
    return [rest.start_s for rest in found.rests]


def test_a_refused_move_is_left_out_and_both_its_rests_stay() -> None:
    refused = NotCounted()
    refused.take(HandMoveRefused(4 * SECOND_US, 6 * SECOND_US, "turn_not_closed"), 0.0)
    found = refused.filter_session(session(4))
    assert starts(found) == [0.0, 3.0, 6.0, 9.0]
    assert [move.left_out for move in found.moves] == [False, True, False]


def test_a_refused_rest_is_a_pause_of_the_move_through_it() -> None:
    refused = NotCounted()
    refused.take(HandRestRefused(3 * SECOND_US, 3 * SECOND_US + 1000, "not_flat"), 0.0)
    found = refused.filter_session(session(4))
    assert starts(found) == [0.0, 6.0, 9.0]
    assert [(move.start_s, move.end_s, move.peak_rad_s) for move in found.moves] == [(1.0, 6.0, 2.0), (7.0, 9.0, 3.0)]


def test_a_refused_rest_at_the_end_leaves_the_rest_before_as_the_last() -> None:
    refused = NotCounted()
    refused.take(HandRestRefused(9 * SECOND_US, 10 * SECOND_US, "not_flat"), 0.0)
    found = refused.filter_session(session(4))
    assert (starts(found), len(found.moves)) == ([0.0, 3.0, 6.0], 2)


def test_of_a_session_that_was_begun_anew_the_rest_is_left() -> None:
    refused = NotCounted()
    refused.take(HandBegunAnew(6 * SECOND_US, "table_moved"), 0.0)
    found = refused.filter_session(session(5))
    assert starts(found) == [6.0, 9.0, 12.0]
    assert [move.peak_rad_s for move in found.moves] == [3.0, 4.0]


def test_the_way_across_two_recordings_ties_nothing() -> None:
    found = NotCounted(seams=[5.0]).filter_session(session(4))
    assert [move.left_out for move in found.moves] == [False, True, False]


def test_a_recording_that_goes_on_has_a_clock_of_its_own() -> None:
    refused = NotCounted()
    refused.take(HandMoveRefused(0, 2 * SECOND_US, "clipping"), 4.0)
    assert [move.left_out for move in refused.filter_session(session(4)).moves] == [False, True, False]


def test_a_face_has_the_name_of_the_axis_that_it_turns_to() -> None:
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert [rotate_face(face, quarter) for face in ("+x", "+y", "-z")] == ["-y", "+x", "-z"]
    assert all(rotate_face(rotate_face(face, quarter), quarter.T) == face for face in FACES)


@pytest.mark.slow
def test_an_accelerometer_that_reads_nothing_is_refused_by_name() -> None:
    run = read_run(RECORDINGS / "by_hand" / "run.h5")
    channels = run.sensors["gyro"].channels
    told = tuple(
        replace(channel, type="<f8") if channel.quantity == "acceleration" else channel for channel in channels
    )
    sensor = replace(run.sensors["gyro"], channels=told)
    for reading, name in ((0.0, "zero_reading"), (np.nan, "not_finite"), (np.inf, "not_finite")):
        samples = run.samples["gyro"].astype(sensor.sample_dtype)
        samples["acceleration_counts"][len(samples) // 2 :] = reading
        with pytest.raises(Fault, match=f"{name}: "):
            calibrate_by_hand([replace(run, samples={"gyro": samples}, sensors={"gyro": sensor})])


def test_more_rests_than_memory_has_room_for_are_refused() -> None:
    with pytest.raises(Fault, match="too_many_moves: there are 301 rests"):
        solve_by_hand(session(301), SessionConditions(clock_ppm=50.0, box_rad=0.003))


@pytest.mark.parametrize(
    ("step", "name"), [(0, "duplicated_samples"), (-1, "board_clock_restarted"), (10**9, "impossible_times")]
)
def test_stamps_that_no_clock_gives_are_refused(step: int, name: str) -> None:
    run = read_run(RECORDINGS / "by_hand" / "run.h5")
    samples = run.samples["gyro"].copy()
    samples["board_time_us"] = 2_000_000_000 + step * np.arange(len(samples))
    with pytest.raises(Fault, match=f"{name}: "):
        calibrate_by_hand([replace(run, samples={"gyro": samples})])


def test_before_the_first_reading_a_session_is_starting_and_has_no_rest() -> None:
    segmenter = Segmenter()
    assert segmenter.live.state == "starting" and segmenter.handled.rests == ()

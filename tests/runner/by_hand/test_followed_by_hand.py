"""The host follows a session that the board makes by hand; its button begins anew, and the host with it."""

import dataclasses

import pytest

from rig.analysis.by_hand.on_board import SCALE_LIMIT, compare_with_board
from rig.data.recording.hand_events import HandAsked, HandEvent, HandMoveAccepted
from rig.runner.by_hand.on_board import FollowedSession
from support.board.hand_on_board import play
from support.external.handled_body import TWELVE, handle
from support.laboratories.hand_session_laboratory import SENSOR

pytestmark = pytest.mark.slow


def test_a_press_of_the_button_begins_anew_and_only_what_follows_is_held_against_double_precision() -> None:
    told: list[HandEvent] = []
    session = FollowedSession(SENSOR, 12, told.append)
    played = play(handle(TWELVE, 3, rest_s=1.6))
    for report in played.reports[:5]:
        session.take(report)
    begun = dataclasses.replace(
        played.reports[0], state="starting", outcome="nothing", before=None, after=None, judged=0, accepted=0
    )
    session.take(begun)
    assert isinstance(told[-1], HandAsked)
    for report in played.reports:
        session.take(report)
    assert session.reports == played.reports
    assert sum(isinstance(event, HandMoveAccepted) for event in told) == 5 + 12
    assert compare_with_board(played.readings, session.reports, played.solved).matrix_difference < SCALE_LIMIT

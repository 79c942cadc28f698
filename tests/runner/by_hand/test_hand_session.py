"""A session by hand: what is right is taken, what is wrong is asked again by its name, and the rest gives the truth."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from rig.data.recording.hand_events import HandAsked, HandBegunAnew
from rig.errors import Fault
from rig.world.hand.habits import Mistake
from support.laboratories.hand_session_laboratory import LIST, TRUE_SCALE, Table

pytestmark = pytest.mark.slow

SHORT = replace(LIST, flips=8, turns=2)
MIXED = {"short": 0.06, "crumb": 0.1, "held": 0.04, "wrong_face": 0.1, "two_turns": 0.03, "other_way": 0.03,
         "dropped": 0.03, "table_pushed": 0.02}  # fmt: skip


def held(table: Table) -> None:
    """The scale factors are right, by what the session itself tells of its uncertainty (k = 3)."""
    solution = table.solution
    off = np.abs(solution.scale - TRUE_SCALE) / solution.expanded_scale
    assert np.all(off < 1.5), (off, table.again)


@pytest.mark.thorough
def test_without_a_mistake_the_list_is_made_and_gives_the_truth() -> None:
    table = Table(seed=3)
    table.sit()
    assert not table.reminded
    assert [each.kind for each in table.accepted].count("flip") == 12
    assert [each.kind for each in table.accepted].count("turn") == 3
    held(table)


def test_a_device_that_is_picked_up_as_the_session_begins_is_measured_from_its_next_rest() -> None:
    """The pause before is no rest, so the move after it begins nowhere."""
    table = Table(seed=3, settings=SHORT, hand={"reaction_time_s": [1.4, 1.4]})
    table.operator.instruct("lay", "+y")
    while table.operator.time_s < 1.5:
        table.operator.step()
    table.time_s = 0.9  # 0.5 s before it is picked up
    table.sit()
    assert table.again[0] == "held_not_laid_down"
    held(table)


@pytest.mark.thorough
def test_it_ends_when_u_is_as_small_as_is_wanted() -> None:
    short = Table(seed=4, settings=replace(LIST, wanted_scale_u=2e-3))
    short.sit()
    assert len(short.accepted) < 15
    assert float(max(short.solution.expanded_scale)) <= 2e-3


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("mistakes", "names"),
    [
        ({"short": 0.7}, {"turn_not_closed"}),
        ({"too_fast": 0.2}, {"clipping"}),
    ],
    ids=lambda each: next(iter(each)),
)
def test_a_mistake_is_asked_again_by_its_name_and_mended(mistakes: Mapping[str, float], names: set[str]) -> None:
    table = Table(seed=5, mistakes=dict(mistakes), settings=SHORT)
    table.sit()
    assert table.operator.state["mistakes"]
    assert names <= set(table.again)
    why = " ".join(event.why for event in table.events if isinstance(event, HandAsked))
    assert "touches the rule." in why or "the rig asks for the move again." in why
    assert "--no-closure" not in why
    held(table)


def test_a_turn_after_which_it_was_laid_down_again_is_asked_again() -> None:
    """Who wipes a crumb away lays it down anywhere, and no longer against the rule."""
    table = Table(seed=1, in_turn=Mistake("crumb", 15.0), settings=SHORT)
    table.sit()
    assert table.again == ["not_flat", "turn_not_closed"]
    why = " ".join(event.why for event in table.events if isinstance(event, HandAsked))
    assert "after that turn it was laid down again, and need not touch the rule as before" in why
    assert [each.turns for each in table.accepted if each.kind == "turn"] == [1, 1]
    held(table)


def test_an_accelerometer_of_the_wrong_sign_is_named_before_the_operator_gives_up() -> None:
    table = Table(seed=3, settings=SHORT, force_sign=-1.0)
    with pytest.raises(Fault) as fault:
        table.sit()
    assert fault.value.name == "accelerometer_inverted" and table.time_s < 60


@pytest.mark.thorough
def test_who_holds_it_in_the_hand_is_told_to_lay_it_down() -> None:
    table = Table(seed=6, mistakes={"held": 0.2}, settings=SHORT)
    table.sit()
    assert {"held_not_laid_down", "not_flat"} & set(table.reminded)
    held(table)


@pytest.mark.thorough
def test_a_crumb_under_it_does_no_harm_where_an_accelerometer_is_the_level() -> None:
    table = Table(seed=5, mistakes={"crumb": 0.2}, settings=SHORT)
    table.sit()
    assert "crumb" in table.operator.state["mistakes"]
    held(table)


@pytest.mark.thorough
def test_a_wrong_side_is_read_and_the_list_goes_on_from_there() -> None:
    table = Table(seed=7, mistakes={"wrong_face": 0.2}, settings=SHORT)
    table.sit()
    assert "wrong_face" in table.operator.state["mistakes"]
    held(table)


@pytest.mark.thorough
def test_after_ten_refusals_in_a_row_it_ends_by_the_name_of_the_last() -> None:
    with pytest.raises(Fault) as ended:
        Table(seed=8, mistakes={"too_fast": 1.0}).sit()
    assert ended.value.name == "clipping"


@pytest.mark.thorough
@pytest.mark.parametrize("creeps", [6, 11])
def test_a_rest_in_which_it_creeps_costs_this_rest_and_not_the_session(creeps: int) -> None:
    table = Table(seed=3, settings=SHORT, creeps=creeps)
    table.sit()
    assert table.again == ["bias_jumped"]
    assert not [event for event in table.events if isinstance(event, HandBegunAnew)]
    assert [move.kind for move in table.accepted].count("turn") == 2
    held(table)


def test_after_a_wrong_move_that_nothing_contradicts_yet_the_session_begins_anew() -> None:
    """Right moves contradict an early wrong one, and were all refused until the run ended."""
    table = Table(seed=418, mistakes=MIXED, settings=SHORT)
    table.sit()
    assert table.again == ["no_fit", "no_fit", "earlier_move_wrong"]
    held(table)


ALL = ("short", "two_turns", "other_way", "wrong_face", "skipped", "crumb", "table_pushed", "held", "dropped", "left",
       "lifted", "too_fast")  # fmt: skip


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("mistake", ALL)
@pytest.mark.parametrize("seed", range(20))
def test_every_mistake_is_mended_or_refused_by_name(mistake: str, seed: int) -> None:
    table = Table(seed=100 + seed, mistakes={mistake: 0.12})
    try:
        table.sit()
    except Fault as fault:
        assert fault.name in {"bias_jumped", "table_moved", "not_flat", "turn_not_closed", "lost_in_move", "clipping"}
        return
    held(table)

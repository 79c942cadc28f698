"""Which moves of a hand are asked for, in whatever order they come."""

import pytest

from rig.motion.by_hand import FACES, Face, HandMove, Instruction
from rig.plans.by_hand import WantedMoves, next_instruction, still_open


def followed(
    wanted: WantedMoves, start: Face = "+z", astray: dict[int, Face] | None = None
) -> tuple[list[HandMove], list[Face]]:
    """What is made by somebody who does as asked, but for the moves of these numbers, which end on another side."""
    taken: list[HandMove] = []
    lay: list[Face] = [start]
    while (asked := next_instruction(still_open(wanted, taken, lay), lay[-1])) is not None:
        assert len(taken) < 100
        if asked.say == "turn":
            assert asked.face == lay[-1]
            taken.append(HandMove("turn", asked.face, asked.face, asked.turns))
            continue
        to = (astray or {}).get(len(taken), asked.face)
        to = asked.face if to == lay[-1] else to
        taken.append(HandMove("flip", lay[-1], to))
        lay.append(to)
    return taken, lay


def test_the_list_is_made_in_as_many_moves_as_it_names() -> None:
    taken, lay = followed(WantedMoves(12, 3))
    assert [move.kind for move in taken].count("flip") == 12
    assert [move.from_face for move in taken if move.kind == "turn"] == ["-x", "-z", "-y"]
    assert set(lay) == set(FACES)


def test_a_second_turn_about_an_axis_goes_back() -> None:
    taken, _ = followed(WantedMoves(12, 6))
    by_axis: dict[str, list[int]] = {}
    for move in taken:
        if move.kind == "turn":
            by_axis.setdefault(move.from_face[1], []).append(move.turns)
    assert all(sorted(turns) == [-1, 1] for turns in by_axis.values())


@pytest.mark.parametrize("start", FACES)
def test_it_may_begin_on_any_side(start: Face) -> None:
    taken, lay = followed(WantedMoves(12, 3), start)
    assert len([move for move in taken if move.kind == "flip"]) <= 14
    assert set(lay) == set(FACES)


def test_who_goes_astray_is_led_on_from_there() -> None:
    taken, lay = followed(WantedMoves(12, 3), astray={2: "-x", 6: "+z"})
    assert len([move for move in taken if move.kind == "flip"]) <= 15
    assert set(lay) == set(FACES)


def test_a_move_that_was_no_whole_turn_leaves_the_turn_open() -> None:
    taken, _ = followed(WantedMoves(12, 0))
    left = still_open(WantedMoves(12, 3), [*taken, HandMove("turn", "+z", "+z", 0)], FACES)
    assert next_instruction(left, "+z") == Instruction("turn", "+z", 1)


def test_turns_come_once_flips_have_told_the_scale() -> None:
    taken, _ = followed(WantedMoves(12, 3))
    assert [move.kind for move in taken[:8]] == ["flip"] * 8


def test_where_nobody_knows_how_it_lies_a_side_is_asked_for() -> None:
    asked = next_instruction(still_open(WantedMoves(12, 3), [], []), None)
    assert asked is not None
    assert asked.words == "Lay it down with the side +z up, and let go"

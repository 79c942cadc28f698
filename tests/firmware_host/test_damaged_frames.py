"""Damaged frames to both ends of the serial line; ten million to each: benchmarks/wire/damaged_frames.py."""

from pathlib import Path

import pytest

from support.board.damaged_frames import build, damage_answers, damage_requests, write_sound

pytestmark = [pytest.mark.slow, pytest.mark.thorough, pytest.mark.proof]
FRAMES = 500_000


def test_damaged_frames_are_refused_by_both_receivers_and_the_board_goes_on_answering(tmp_path: Path) -> None:
    """What is accepted is what a receiver written from the protocol's description accepts, block by block."""
    program = build(tmp_path)
    sent = damage_requests(program, FRAMES, 7, write_sound(tmp_path / "host", "host", 7))
    assert sent.refused > 0.8 * FRAMES and sent.made > 0.01 * FRAMES and sent.chance == 0
    assert sent.answers > 0.9 * sent.valid
    sent, heard, of_whole = damage_answers(program, FRAMES, 7, write_sound(tmp_path / "board", "board", 7))
    assert sent.refused > 0.8 * FRAMES and sent.chance == 0
    assert heard.accepted + heard.damaged == sent.blocks
    assert heard.accepted == of_whole.accepted > 0.01 * FRAMES and heard.digest == of_whole.digest

"""Parts that are laid into a simulated laboratory one after the other."""

import gc
from pathlib import Path
from weakref import ref

import pytest

from rig.config.load import load
from rig.world.world_process import World
from support.laboratories.commands import configuration

pytestmark = pytest.mark.slow


@pytest.mark.thorough
def test_of_a_tray_of_boards_only_the_one_that_is_laid_in_takes_memory(tmp_path: Path) -> None:
    world = World(load(configuration(tmp_path)))
    boards = []
    gc.disable()
    try:
        for part in ("G-001", "G-002", "G-003"):
            world.fit_part(part)
            assert world.laboratory.board is not None
            boards.append(ref(world.laboratory.board))
    finally:
        gc.enable()
        world.close()
    assert [board() is None for board in boards] == [True, True, False]

"""What the shipped image takes of the chip, after a session on the emulator that asks for everything it can do."""

import pytest

from firmware_host import footprint

pytestmark = pytest.mark.slow


@pytest.mark.thorough
def test_flash_ram_and_stack_are_within_their_limits(capsys: pytest.CaptureFixture[str]) -> None:
    assert footprint.main() == 0
    flash, ram, stack = capsys.readouterr().out.splitlines()
    assert flash.startswith("flash") and ram.startswith("RAM") and stack.startswith("stack")
    assert int(stack.split()[1]) < 2048, "half of the room is for what no session tries"

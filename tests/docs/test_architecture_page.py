"""The page shows the layers that lint-imports holds, and the times the code has."""

import pytest

from rig.data.recording import run_file
from rig.turners.ur import arm_driver
from rig.turners.ur.child import child_link
from rig.turners.ur.child import client_process as child
from rig.turners.ur.stopping import stop as stopping
from support.house_picture import PAGE, drawn

SAID = [
    f"`stopJ` with {stopping.BRAKE_RAD_S2:g} rad/s²",
    f"{child.PARENT_TICKS} of its ticks of {child.TICK_S:g} s",
    f"{child_link.SILENT_TICKS} of its ticks of {1000 * child_link.TICK_S:g} ms",
    f"within {stopping.MAX_STOP_S:g} s",
    f"after {child_link.MAX_STARVED_FACTOR * child_link.SILENT_TICKS * child_link.TICK_S:g} s at the latest",
    f"a program that hangs after {child.MAX_PARENT_FACTOR * child.PARENT_TICKS * child.TICK_S:g} s",
    f"{child_link.FROZEN_TICKS} ticks of heartbeats without a new state",
    f"For a controller elsewhere {child_link.MAX_LINK_SILENCE_S:g} s are enough",
    f"patient for {child_link.PATIENT_TICKS * child_link.TICK_S:g} s",
    f"at least every {1000 * arm_driver.WATCH_PERIOD_S:g} ms",
    f"more than {arm_driver.MAX_DURATION_RATIO:g} times as long",
    f"flushes every {run_file.FLUSH_PERIOD_S:g} s",
]


def test_the_page_s_picture_is_drawn_from_the_layers_contract() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert drawn(page) == page, "again: PYTHONPATH=tests python -m support.house_picture"


@pytest.mark.parametrize("said", SAID)
def test_the_page_s_times_are_the_code_s(said: str) -> None:
    assert said in " ".join(PAGE.read_text(encoding="utf-8").split())

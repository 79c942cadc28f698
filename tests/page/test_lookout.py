"""A run does not depend on the process that looks at its recording for the page."""

import os
import signal
import threading
from pathlib import Path

import pytest

from rig.motion.steps import Sweep
from rig.page.about import About
from rig.page.analysis_process import looking_out
from rig.page.page_state import PageState
from rig.page.server.feed import Feed
from rig.station.events import StepFinished
from support.page.scripted_runs import moving, plan_demo
from support.processes.waiting import wait_for

pytestmark = pytest.mark.slow


def helper() -> int:
    """The process that looks, a child of this one; zero before there is one."""
    for path in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == os.getpid() and b"rig.page.live_analysis" in (path / "cmdline").read_bytes():
                return int(path.name)
        except OSError:
            continue
    return 0


def swept() -> StepFinished:
    finished = (event for event in moving(plan_demo(), 100.0) if isinstance(event, StepFinished))
    return next(event for event in finished if isinstance(event.step, Sweep))


@pytest.mark.one_in(3)  # each moment and each signal once
@pytest.mark.parametrize("kind", ["SIGKILL", "SIGTERM"])
@pytest.mark.parametrize("asked", ["before", "after"])
def test_a_helper_that_is_killed_is_told_of_and_harms_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], kind: str, asked: str
) -> None:
    with looking_out(tmp_path, Feed(PageState(About("", "")))) as lookout:
        wait_for(lambda: helper() > 0, "the helper")
        if asked == "after":
            lookout.event(swept())
            wait_for(lambda: not lookout.wanted.is_set(), "that it is asked")
        looking = helper()
        assert looking > 0
        os.kill(looking, getattr(signal, kind))
        lookout.event(swept())
        # Not for its words: what is written while captured output is taken is lost.
        wait_for(lambda: "lookout" not in {thread.name for thread in threading.enumerate()}, "that it is noticed")
        lookout.event(swept())
    said = capfd.readouterr().err
    assert "The page shows no new observations" in said
    assert "Traceback" not in said and said.count("\n") == 1

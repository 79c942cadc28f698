"""`rig watch`: a recorded run, replayed on the operator's page."""

import math
import sys
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_run
from rig.commands.page_arguments import PageWish, add_page_address, read_page_token, wait_for_interrupt
from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.errors import Refused, raise_as
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.data.recording.run_data import RunData
    from rig.data.result_file import ResultDocument
    from rig.page.about import About
    from rig.page.replay import Moment
    from rig.page.server.feed import Feed
    from rig.station.events import RunEvent

LOG_TAIL_LINES = 3  # they show how a run without a result ended
MAX_LOG_BYTES = 50_000_000


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig watch`. No `--page` is among them, because the replay always has a page."""
    add_run(parser, "run_folder", "a run folder", metavar="RUN_DIR")
    parser.add_argument("--speed", type=_speed, default=1.0, metavar="N", help="replay N times as fast (default: 1)")
    add_page_address(parser)


def _speed(text: str) -> float:
    speed = float(text)
    if not 0 < speed < math.inf:
        raise ValueError(text)
    return speed


def run(options: Namespace) -> int:
    """Replay every recording in a run folder, `--speed` times as fast; the page remains until Ctrl-C.

    Return 0. Raise Refused `no_run`, `page_address`, and what `read_run`, `turner_of`, `check_arms_times` and
    `read_result` raise.
    """
    from rig.data.recording.run_file import read_run
    from rig.data.result_file import read_result
    from rig.data.run_folder import RESULT, recordings
    from rig.observation.motion.arm_motion import check_arms_times, turner_of
    from rig.page.page_state import PageState
    from rig.page.replay import moments
    from rig.page.server.control import Control
    from rig.page.server.feed import Feed
    from rig.page.server.serving import serving

    folder: Path = options.run_folder
    wanted = PageWish(options.page_address, read_page_token(options))
    runs = [read_run(path) for readings in ("raw", "calibrated") for path in recordings(folder, readings)]
    if not runs:
        raise Refused("no_run", f"{folder} holds no recording", "Give the folder of a run")
    with raise_as(Refused):  # no arm moves: wrong data is a refusal
        for run in runs:
            turner_of(run)
            check_arms_times(run.states)
    result = read_result(folder / RESULT) if (folder / RESULT).exists() else None
    feed = Feed(PageState(_describe_replay(folder, runs)))
    with serving(feed, Control(may_answer=False), folder, wanted.address()) as url:
        say(f"page: {url}", sys.stderr)
        try:
            for run in runs:
                _replay(moments(run), feed, options.speed)
            for event in _read_ending(folder, result):
                feed.event(event)
            say("The replay is finished. The page stays until Ctrl-C.", sys.stderr)
            wait_for_interrupt()
        except KeyboardInterrupt:
            pass
    return 0


def _describe_replay(folder: Path, runs: "list[RunData]") -> "About":
    from rig.data.recording.provenance import calls_itself_simulated
    from rig.observation.motion.arm_motion import turner_of
    from rig.page.about import About
    from rig.page.arm import geometry

    parts: dict[str, str] = {}
    for run in runs:
        parts |= {name: f"{sensor.part} {sensor.serial_number}" for name, sensor in run.sensors.items()}
    made_with = runs[0].provenance
    simulated = calls_itself_simulated(made_with.arm_software)
    turner = turner_of(runs[0])
    arm = geometry(turner.geometry, turner.joints)
    arm |= {"model": made_with.arm_model, "serial_number": made_with.arm_serial_number}
    return About(str(folder), runs[0].settings.procedure, replayed=True, parts=parts, simulated=simulated, arm=arm)


def _replay(recorded: "Iterator[Moment]", feed: "Feed", speed: float) -> None:
    """Pass the events on at their recorded times, `speed` times as fast."""
    from rig.page.rows import Look

    began_s = time.monotonic()
    for moment in recorded:
        wait_s = began_s + moment.at_s / speed - time.monotonic()
        if wait_s > 0:
            time.sleep(wait_s)
        if isinstance(moment.event, Look):
            feed.look(moment.event)
        else:
            feed.event(moment.event)


def _read_ending(folder: Path, result: "ResultDocument | None") -> "Iterator[RunEvent]":
    from rig.data.run_folder import CERTIFICATE, RESULT, TRUTH_FILE
    from rig.page.replay import end_events
    from rig.station.events import DocumentWritten, Interrupted

    if (folder / CERTIFICATE).is_file():
        yield DocumentWritten(folder / CERTIFICATE)
    if result is None:
        yield Interrupted(read_last_words(folder))
        return
    yield DocumentWritten(folder / RESULT)
    if (folder / TRUTH_FILE).is_file():
        yield DocumentWritten(folder / TRUTH_FILE)
    yield from end_events(result)


def read_last_words(folder: Path) -> str:
    """Return a sentence that a run has no result, with the last message of its log."""
    from rig.data.run_folder import LOG

    try:
        log = read_regular_file(folder / LOG, MAX_LOG_BYTES, follow_links=False)
    except (OSError, UnfitFile):
        log = b""
    lines = log.decode("utf-8", errors="replace").splitlines()
    messages = [line.partition(" INFO ")[2] for line in lines if " INFO " in line]
    return "; ".join(["this run has no result", *messages[-LOG_TAIL_LINES:][-1:]])

"""`rig station`: part after part on one rig."""

import json
import shlex
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_json, add_script
from rig.commands.page_arguments import add_page_address, read_page_wish
from rig.commands.standard_streams import say_where_the_result_is
from rig.errors import Fault
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.batch.operators import Operator
    from rig.batch.status import Present
    from rig.commands.configured import Configured
    from rig.commands.page_arguments import PageWish
    from rig.config.models import RigConfig
    from rig.station.questions import Voice

MALLOPT_ARENA_MAX = -8  # malloc.h


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig station`."""
    add_config(parser)
    add_script(parser)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="batch folder (default: a new one under output.folder); an unfinished batch there is continued",
    )
    parser.add_argument(
        "--series", type=Path, metavar="PARTS.csv", help="take the serial numbers from a file, in its order"
    )
    parser.add_argument("--operator", default="", metavar="NAME", help="name of the operator, for the history")
    parser.add_argument("--work-order", default="", metavar="NUMBER", help="number of the work order, for the history")
    parser.add_argument("--yes", action="store_true", help="with --series: ask nothing, not even before the arm moves")
    parser.add_argument("--page", action="store_true", help="ask the operator in a browser, and show the tray there")
    parser.set_defaults(confirm_on_page=False)
    add_page_address(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Run parts until none follows.

    Return 0 if all parts passed in the end, else 1. Raise Refused `missing_extra`, `not_confirmed`, and what
    `load_configured`, `claim_devices`, `numbers_in` and `open_journal` raise.
    """
    from rig.batch.label import refuse_without_library
    from rig.batch.operators import Operator, refuse_without_terminal
    from rig.batch.part_list import numbers_in
    from rig.batch.status import Now, Present
    from rig.commands.configured import open_configured
    from rig.station.questions import Terminal

    keep_to_one_arena()
    refuse_without_library()
    numbers = None if options.series is None else numbers_in(options.series)
    page = read_page_wish(options)
    with open_configured(options.config, options.overrides, options.script) as configured, ExitStack() as stack:
        present = Present(Now(simulated=configured.loaded.simulated, rig=configured.loaded.config.history.rig or ""))
        # In a laboratory that this process simulates no person can be hurt, so no operator is asked.
        voice: Voice | None = None
        if page is not None:
            voice = stack.enter_context(_serve_page(page, present))
        elif numbers is None or not (options.yes or configured.loaded.simulated):
            refuse_without_terminal()
            voice = Terminal()
        return _carry_out_batch(options, configured, Operator(voice, numbers, present.asking), present)


def _carry_out_batch(options: Namespace, configured: "Configured", operator: "Operator", present: "Present") -> int:
    """Run all parts of a new or continued batch; return 0 if every part passed in the end, else 1."""
    from rig.batch.batch_journal import open_journal
    from rig.batch.batch_state import Begun
    from rig.batch.batch_table import CSV, summary
    from rig.batch.part_sequence import Work, now_utc
    from rig.commands.station.bench import BatchSettings, open_bench
    from rig.station.events import Interrupted

    config = configured.loaded.config
    begun = Begun(options.operator, options.work_order, now_utc(), simulated=configured.loaded.simulated)
    journal = open_journal(options.out, Path(config.output.folder), begun)
    folder, begun_before = journal.folder, journal.batch.begun
    say(f"batch folder: {folder}", sys.stderr)
    command = resume_command(options, folder)
    station = BatchSettings(operator.attended, begun_before.operator, begun_before.work_order, (present,), command)
    try:
        with _send_heartbeats(config, present), open_bench(configured, folder, station) as part_bench:
            try:
                Work(journal, config.station, operator, part_bench, present.batch).all_parts()
            except KeyboardInterrupt as interrupt:
                if present.now.state == "stopped":
                    raise
                why = str(interrupt) or "interrupted"  # between two parts no run reports the interrupt
                text = f"{why} between two parts; the batch is kept in {folder}. Go on with: {command}"
                present.event(Interrupted(text))
                raise KeyboardInterrupt(text) from None
    except (Fault, OSError):
        say(f"the batch is kept in {folder}; go on with: {command}", sys.stderr)
        raise
    batch = journal.batch
    if options.json:
        print(json.dumps(asdict(batch), indent=2))
    else:
        say(f"{summary(batch)}; {folder / CSV}")
    say_where_the_result_is(folder / CSV)
    return 0 if batch.passed else 1


@contextmanager
def _send_heartbeats(config: "RigConfig", present: "Present") -> Iterator[None]:
    """Send the station's heartbeat to the history of its runs during the block; without a history do nothing."""
    from rig.floor.heartbeat import heartbeat
    from rig.history.storage.address import choose_history_address

    address = choose_history_address(config.history)
    if address is None:
        yield
        return
    with heartbeat(config.history.rig or config.turner.address or "by hand", address, present.now) as heart:
        present.listeners = (*present.listeners, heart.hear)
        yield


@contextmanager
def _serve_page(wanted: "PageWish", present: "Present") -> "Iterator[Voice]":
    """Serve the station's page during the block; yield the voice by which the page asks the operator."""
    from rig.batch.page_operator import open_page

    with open_page(present, wanted.address()) as (voice, url):
        say(f"page: {url}", sys.stderr)
        yield voice


def resume_command(options: Namespace, folder: Path) -> str:
    """Return the command that continues the batch in `folder`; a token typed into the first command is omitted."""
    series = [] if options.series is None else ["--series", str(options.series)]
    script = [] if options.script is None else ["--script", str(options.script)]
    changes = [word for override in options.overrides for word in ("--set", override)]
    flags = [f"--{name}" for name in ("yes", "page", "json") if getattr(options, name)]
    flags += [] if options.page_address is None else ["--page-address", options.page_address]
    flags += [] if options.page_token_file is None else ["--page-token-file", str(options.page_token_file)]
    words = ["rig", "station", str(options.config), *changes, *script, "--out", str(folder), *series, *flags]
    return shlex.join(words)


def keep_to_one_arena() -> None:
    """Make all threads allocate from one arena of glibc, so that they reuse freed memory."""
    if sys.platform == "linux":
        import ctypes

        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
        if mallopt is not None:
            mallopt(MALLOPT_ARENA_MAX, 1)

"""`rig station`: one part after the other on one rig."""

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
from rig.commands.page_arguments import add_place, wish
from rig.commands.standard_streams import tell_where_the_result_is
from rig.errors import Fault
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.batch.operators import Operator, Voice
    from rig.batch.status import Present
    from rig.commands.configured import Configured
    from rig.commands.page_arguments import PageWish
    from rig.config.models import RigConfig


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig station`."""
    add_config(parser)
    add_script(parser)
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="batch folder (default: a new one under output.folder); a batch that was begun there is gone on with",
    )
    parser.add_argument(
        "--series", type=Path, metavar="PARTS.csv", help="take the serial numbers from a file, one after the other"
    )
    parser.add_argument("--operator", default="", metavar="NAME", help="who runs the rig, for the history")
    parser.add_argument("--work-order", default="", metavar="NUMBER", help="what the parts belong to, for the history")
    parser.add_argument("--yes", action="store_true", help="with --series: ask nothing, not even before the arm moves")
    parser.add_argument("--page", action="store_true", help="ask the operator in a browser, and show the tray there")
    parser.set_defaults(confirm_on_page=False)
    add_place(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Run parts until none follows. Returns 0 where all passed in the end, 1 where one did not.

    Raises Refused as `configured`, `claimed`, `numbers_in` and `opened`; `missing_extra`, `not_confirmed`.
    """
    from rig.batch.label import refuse_without_library
    from rig.batch.operators import Operator, Terminal, refuse_without_terminal
    from rig.batch.series import numbers_in
    from rig.batch.status import Now, Present
    from rig.commands.configured import configured_here
    from rig.commands.station.one_arena import keep_to_one_arena

    keep_to_one_arena()
    refuse_without_library()
    numbers = None if options.series is None else numbers_in(options.series)
    page = wish(options)
    with configured_here(options.config, options.overrides, options.script) as found, ExitStack() as stack:
        present = Present(Now(simulated=found.loaded.simulated, rig=found.loaded.config.history.rig or ""))
        # Nobody stands beside a laboratory that this process starts itself, so there nobody need be asked.
        voice: Voice | None = None
        if page is not None:
            voice = stack.enter_context(_page(page, present))
        elif numbers is None or not (options.yes or found.loaded.simulated):
            refuse_without_terminal()
            voice = Terminal()
        return _carried_out(options, found, Operator(voice, numbers, present.asking), present)


def _carried_out(options: Namespace, configured: "Configured", operator: "Operator", present: "Present") -> int:
    from rig.batch.batch import Begun
    from rig.batch.journal import open_journal
    from rig.batch.parts_in_turn import Work, now_utc
    from rig.batch.table import CSV, summary
    from rig.commands.station.bench import Station, bench
    from rig.station.events import Interrupted

    config = configured.loaded.config
    begun = Begun(options.operator, options.work_order, now_utc(), simulated=configured.loaded.simulated)
    journal = open_journal(options.out, Path(config.output.folder), begun)
    folder, said = journal.folder, journal.batch.begun
    say(f"batch folder: {folder}", sys.stderr)
    same = going_on(options, folder)
    station = Station(operator.attended, said.operator, said.work_order, (present,), same)
    try:
        with _beating(config, present), bench(configured, folder, station) as at:
            try:
                Work(journal, config.station, operator, at, present.batch).all_parts()
            except KeyboardInterrupt as interrupt:
                if present.now.state == "stopped":
                    raise
                why = str(interrupt) or "interrupted"  # no run was there to say so
                text = f"{why} between two parts; the batch is kept in {folder}. Go on with: {same}"
                present.event(Interrupted(text))
                raise KeyboardInterrupt(text) from None
    except (Fault, OSError):
        say(f"the batch is kept in {folder}; go on with: {same}", sys.stderr)
        raise
    batch = journal.batch
    if options.json:
        print(json.dumps(asdict(batch), indent=2))
    else:
        say(f"{summary(batch)}; {folder / CSV}")
    tell_where_the_result_is(folder / CSV)
    return 0 if batch.passed else 1


@contextmanager
def _beating(config: "RigConfig", present: "Present") -> Iterator[None]:
    """The station's heartbeat in the history that its runs are entered in; none where they are entered in none."""
    from rig.floor.heartbeat import heartbeat
    from rig.history.storage.address import choose_history_address

    place = choose_history_address(config.history)
    if place is None:
        yield
        return
    with heartbeat(config.history.rig or config.turner.address or "by hand", place, present.now) as heart:
        present.hears = (*present.hears, heart.hear)
        yield


@contextmanager
def _page(wanted: "PageWish", present: "Present") -> "Iterator[Voice]":
    """The station's page, on which the operator is asked."""
    from rig.batch.on_page import on_page

    with on_page(present, wanted.address()) as (voice, url):
        say(f"page: {url}", sys.stderr)
        yield voice


def going_on(options: Namespace, folder: Path) -> str:
    """The command that goes on with the batch in `folder`; a token that was typed into the first one is not shown."""
    series = [] if options.series is None else ["--series", str(options.series)]
    script = [] if options.script is None else ["--script", str(options.script)]
    changes = [word for each in options.overrides for word in ("--set", each)]
    said = [f"--{name}" for name in ("yes", "page", "json") if getattr(options, name)]
    said += [] if options.page_address is None else ["--page-address", options.page_address]
    said += [] if options.page_token_file is None else ["--page-token-file", str(options.page_token_file)]
    words = ["rig", "station", str(options.config), *changes, *script, "--out", str(folder), *series, *said]
    return shlex.join(words)

"""`rig study`: lists the studies, or runs one with a progress bar and writes what it found."""

import sys
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.errors import Refused
from rig.station.plain_text import duration_words, say

if TYPE_CHECKING:
    from rig.study.catalogue import StudyEntry
    from rig.study.report import StudyFinding

WORTH_TELLING_S = 5.0


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig study`."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="one of those that `rig study` lists")
    parser.add_argument("--out", type=Path, default=Path("studies"), metavar="DIR", help="default: studies")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="default: 1")
    parser.add_argument("--runs", type=int, metavar="N", help="per parameter set (default: as many as the paper)")
    parser.add_argument("--jobs", type=int, metavar="N", help="processes; the results do not depend on it")
    parser.add_argument("--dask", metavar="ADDRESS", help="compute on the cluster of this Dask scheduler")
    parser.add_argument("--format", choices=("csv", "parquet"), default="csv", help="of the table (default: csv)")


def run(options: Namespace) -> int:
    """List the studies, or run the one that is named. Returns 0."""
    return _listed() if options.name is None else _run(options)


def _listed() -> int:
    """Print the names of the studies, what each shows, and how long it takes."""
    from rich.console import Console
    from rich.table import Table

    from rig.study.catalogue import STUDIES

    listed = Table(box=None, show_header=False)
    for name, entry in STUDIES.items():
        listed.add_row(name, entry.summary, _about(entry))
    console = Console()
    console.print(listed)
    console.print("on one core; --jobs N has N of them work, --runs N takes fewer runs than the paper")
    return 0


def _run(options: Namespace) -> int:
    """Run one study, print its findings and write its files into `--out`.

    Raises Refused `unknown_study`, `bad_option`, `missing_extra`, `study_folder`, and as `refuse_links`.
    """
    from rig.data.run_folder import refuse_links
    from rig.errors.extras import missing_extra
    from rig.study.catalogue import find
    from rig.study.files import write
    from rig.study.report import Settings

    entry = find(options.name)
    for option, least in (("seed", 0), ("runs", 10), ("jobs", 1)):
        value = getattr(options, option)
        if value is not None and value < least:
            raise Refused("bad_option", f"--{option} {value} is too small", f"Give {least} or more")
    try:
        import joblib  # noqa: F401
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise missing_extra(error, "study") from error
    if options.format == "parquet":
        try:
            import pyarrow  # noqa: F401  # now, not when all is computed
        except ImportError as error:
            raise missing_extra(error, "parquet") from error
    refuse_links(*options.out.glob("*"))
    if options.runs is None and options.dask is None and (about := _about(entry, options.jobs or 1)):
        say(f"study {options.name}: {about}", file=sys.stderr)
    with _cluster(options.dask) if options.dask else nullcontext():
        report = entry.run(Settings(options.seed, options.runs, options.jobs, partial(_bar, options.jobs or 1)))
    paths = write(report, options.out, options.name, options.format)
    _print_findings(options.name, report.findings)
    for path in paths:
        say(f"written: {path}", file=sys.stderr)
    return 0


def _about(entry: "StudyEntry", jobs: int = 1) -> str:
    """How long a study takes, in words; nothing where that is not known."""
    duration_s = entry.duration_s(jobs)
    return "" if duration_s is None else f"about {duration_words(max(duration_s, 1.0))}"


@contextmanager
def _cluster(address: str) -> Iterator[None]:
    """Everything joblib does inside goes to the Dask scheduler at `address`."""
    from joblib import parallel_config

    from rig.commands.history.cluster import client_of

    with client_of(address) as client, parallel_config(backend="dask", client=client):
        yield


def _bar(jobs: int, results: Iterable[Any], total: int) -> Iterable[Any]:
    """How long it takes is told by the first piece; a terminal has a bar besides."""
    from rich.console import Console
    from rich.progress import track

    console, began_s = Console(stderr=True), time.monotonic()
    shown = track(results, total=total, description="study", console=console, disable=not console.is_terminal)
    for number, result in enumerate(shown):
        left_s = (time.monotonic() - began_s) * (total - 1) / jobs
        if number == 0 and left_s > WORTH_TELLING_S:
            console.print(f"{total} pieces, about {duration_words(left_s)} to go")
        yield result


def _print_findings(name: str, findings: "tuple[StudyFinding, ...]") -> None:
    from rich.console import Console
    from rich.table import Table

    shown = Table(title=f"study {name}", title_justify="left")
    for heading in ("quantity", "ours", "published", "unit", "ours/published"):
        shown.add_column(heading, justify="left" if heading in ("quantity", "unit") else "right")
    for finding in findings:
        ratio = finding.ratio
        shown.add_row(
            finding.quantity,
            f"{finding.value:.4g}",
            "" if finding.published is None else f"{finding.published:.4g}",
            finding.unit,
            "" if ratio is None else f"{ratio:.3f}",
        )
    Console().print(shown)

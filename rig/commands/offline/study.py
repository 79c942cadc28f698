"""`rig study`: list the studies, or run one with a progress bar and write its findings."""

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
    from rig.study.study_catalogue import StudyEntry
    from rig.study.study_report import StudyFinding

MIN_SHOWN_S = 5.0


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig study`."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="a study, as listed by `rig study`")
    parser.add_argument(
        "--out", type=Path, default=Path("studies"), metavar="DIR", help="folder of the results (default: studies)"
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the random numbers (default: 1)")
    parser.add_argument("--runs", type=int, metavar="N", help="runs per parameter set (default: as in the paper)")
    parser.add_argument("--jobs", type=int, metavar="N", help="processes; the results do not depend on it")
    parser.add_argument("--dask", metavar="ADDRESS", help="compute on the cluster of this Dask scheduler")
    parser.add_argument(
        "--format", choices=("csv", "parquet"), default="csv", help="format of the table (default: csv)"
    )


def run(options: Namespace) -> int:
    """List the studies, or run the named one. Return 0."""
    return _list_studies() if options.name is None else _run_study(options)


def _list_studies() -> int:
    """Print each study's name, subject and duration; return 0."""
    from rich.console import Console
    from rich.table import Table

    from rig.study.study_catalogue import STUDIES

    table = Table(box=None, show_header=False)
    for name, entry in STUDIES.items():
        table.add_row(name, entry.summary, _describe_duration(entry))
    console = Console()
    console.print(table)
    console.print("durations on one core; --jobs N uses N cores, --runs N takes fewer runs than the paper")
    return 0


def _run_study(options: Namespace) -> int:
    """Run one study, print its findings and write its files into `--out`; return 0.

    Raise Refused `unknown_study`, `bad_option`, `missing_extra`, `study_folder`, and what `refuse_links` raises.
    """
    from rig.data.run_folder import refuse_links
    from rig.errors.extras import requiring
    from rig.study.files import write
    from rig.study.study_catalogue import find
    from rig.study.study_report import Settings

    entry = find(options.name)
    for option, least in (("seed", 0), ("runs", 10), ("jobs", 1)):
        value = getattr(options, option)
        if value is not None and value < least:
            raise Refused("bad_option", f"--{option} {value} is too small", f"Give {least} or more")
    with requiring("study"):
        import joblib  # noqa: F401
        import matplotlib  # noqa: F401
    if options.format == "parquet":
        with requiring("parquet"):
            import pyarrow  # noqa: F401  # now, not after all is computed
    refuse_links(*options.out.glob("*"))
    if options.runs is None and options.dask is None and (about := _describe_duration(entry, options.jobs or 1)):
        say(f"study {options.name}: {about}", file=sys.stderr)
    with _compute_on_cluster(options.dask) if options.dask else nullcontext():
        report = entry.run(
            Settings(options.seed, options.runs, options.jobs, partial(_report_progress, options.jobs or 1))
        )
    paths = write(report, options.out, options.name, options.format)
    _print_findings(options.name, report.findings)
    for path in paths:
        say(f"written: {path}", file=sys.stderr)
    return 0


def _describe_duration(entry: "StudyEntry", jobs: int = 1) -> str:
    """Return the duration of a study in words; empty if unknown."""
    duration_s = entry.duration_s(jobs)
    return "" if duration_s is None else f"about {duration_words(max(duration_s, 1.0))}"


@contextmanager
def _compute_on_cluster(address: str) -> Iterator[None]:
    """Make joblib compute on the Dask scheduler at `address` during the block."""
    from joblib import parallel_config

    from rig.commands.history.worker_pools import connect_client

    with connect_client(address) as client, parallel_config(backend="dask", client=client):
        yield


def _report_progress(jobs: int, results: Iterable[Any], total: int) -> Iterable[Any]:
    """Yield the results; print the expected duration after the first, and show a bar on a terminal."""
    from rich.console import Console
    from rich.progress import track

    console, began_s = Console(stderr=True), time.monotonic()
    progress = track(results, total=total, description="study", console=console, disable=not console.is_terminal)
    for number, result in enumerate(progress):
        remaining_s = (time.monotonic() - began_s) * (total - 1) / jobs
        if number == 0 and remaining_s > MIN_SHOWN_S:
            console.print(f"{total} parts, about {duration_words(remaining_s)} to go")
        yield result


def _print_findings(name: str, findings: "tuple[StudyFinding, ...]") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"study {name}", title_justify="left")
    for heading in ("quantity", "ours", "published", "unit", "ours/published"):
        table.add_column(heading, justify="left" if heading in ("quantity", "unit") else "right")
    for finding in findings:
        ratio = finding.ratio
        table.add_row(
            finding.quantity,
            f"{finding.value:.4g}",
            "" if finding.published is None else f"{finding.published:.4g}",
            finding.unit,
            "" if ratio is None else f"{ratio:.3f}",
        )
    Console().print(table)

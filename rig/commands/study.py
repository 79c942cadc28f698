"""`rig study`: lists the studies, or runs one with a progress bar and writes what it found."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track
from rich.table import Table

from rig.data.run_folder import refuse_links
from rig.errors import Refused
from rig.station.plain_text import say
from rig.study.catalogue import STUDIES, find
from rig.study.files import Format, missing_extra, write
from rig.study.report import Finding, Settings


def list_studies() -> int:
    """Print the names of the studies and what each shows."""
    listed = Table(box=None, show_header=False)
    for name, entry in STUDIES.items():
        listed.add_row(name, entry.summary)
    Console().print(listed)
    return 0


def run_study(
    name: str,
    out: Path,
    *,
    seed: int,
    runs: int | None,
    jobs: int | None,
    dask: str | None,
    table_format: Format,
) -> int:
    """Run one study, print its findings and write its files into `out`.

    Raises Refused `unknown_study`, `bad_option`, `missing_extra`, `study_folder`, and as `refuse_links`.
    """
    entry = find(name)
    for option, value, least in (("--seed", seed, 0), ("--runs", runs, 10), ("--jobs", jobs, 1)):
        if value is not None and value < least:
            raise Refused("bad_option", f"{option} {value} is too small", f"Give {least} or more")
    try:
        import joblib  # noqa: F401
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise missing_extra(error, "study") from error
    refuse_links(*out.glob("*"))
    with _cluster(dask) if dask else nullcontext():
        report = entry.run(Settings(seed, runs, jobs, _bar))
    paths = write(report, out, name, table_format)
    _print_findings(name, report.findings)
    for path in paths:
        say(f"written: {path}", file=sys.stderr)
    return 0


@contextmanager
def _cluster(address: str) -> Iterator[None]:
    """Everything joblib does inside goes to the Dask scheduler at `address`."""
    try:
        from distributed import Client
    except ImportError as error:
        raise missing_extra(error, "dask") from error
    from joblib import parallel_config

    try:
        client = Client(address, timeout="5s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise Refused(
            "no_cluster", f"no Dask scheduler answers at {address} ({error})", "Start one with `dask scheduler`"
        ) from error
    with client, parallel_config(backend="dask", client=client):
        yield


def _bar(results: Iterable[Any], total: int) -> Iterable[Any]:
    console = Console(stderr=True)
    return track(results, total=total, description="study", console=console, disable=not console.is_terminal)


def _print_findings(name: str, findings: tuple[Finding, ...]) -> None:
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

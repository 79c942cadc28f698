"""Files of a study's report: its table, its findings and its plot."""

import csv
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np

from rig.errors import Refused
from rig.errors.extras import requiring
from rig.study.study_report import Columns, StudyFinding, StudyReport, table
from rig.study.style import use_style

Format = Literal["csv", "parquet"]


def write(report: StudyReport, folder: Path, name: str, table_format: Format) -> tuple[Path, ...]:
    """Write `name`.csv (or .parquet), `name`-findings.csv, `name`.svg and `name`.png, replacing earlier files.

    Raise Refused `study_folder`, `missing_extra`.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Refused("study_folder", f"{folder} cannot be made: {error}", "Choose another with --out") from error
    paths = (
        folder / f"{name}.{table_format}",
        folder / f"{name}-findings.csv",
        folder / f"{name}.svg",
        folder / f"{name}.png",
    )
    with _remove_incomplete(paths[0]):
        if table_format == "parquet":
            _write_parquet(report.columns, paths[0])
        else:
            _write_csv(report.columns, paths[0])
    with _remove_incomplete(paths[1]):
        _write_csv(_findings(report.findings), paths[1])
    _write_plots(report, paths[2:])
    return paths


@contextmanager
def _remove_incomplete(path: Path) -> Iterator[None]:
    """Remove the file at `path` if the block fails to write it. Raise Refused `study_folder`."""
    try:
        yield
    except OSError as error:
        with suppress(OSError):
            path.unlink()
        problem = f"{path} cannot be written: {error.strerror or error}"
        raise Refused("study_folder", problem, "Choose another with --out") from error


def _findings(findings: Sequence[StudyFinding]) -> Columns:
    return table(
        {
            "quantity": finding.quantity,
            "value": finding.value,
            "published": finding.published,
            "unit": finding.unit,
            "ratio": finding.ratio,
        }
        for finding in findings
    )


def _write_csv(columns: Columns, path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows([_format_value(value) for value in row] for row in zip(*columns.values(), strict=True))


def _format_value(value: Any) -> str:
    """Return a value as text. Numbers have ten digits: more than a study needs, but equal on all machines."""
    if value is None:
        return ""
    return f"{value:.10g}" if isinstance(value, float | np.floating) else str(value)


def _write_parquet(columns: Columns, path: Path) -> None:
    with requiring("parquet"):
        import pyarrow
        import pyarrow.parquet
    pyarrow.parquet.write_table(pyarrow.table(dict(columns)), path)


def _write_plots(report: StudyReport, paths: Sequence[Path]) -> None:
    from matplotlib.figure import Figure

    with use_style():
        figure = Figure(figsize=report.size_inches, layout="constrained")
        report.draw(figure)
        for path in paths:
            # Without the date the same study gives the same file.
            metadata: dict[str, None] = {"Date": None} if path.suffix == ".svg" else {}
            with _remove_incomplete(path):
                figure.savefig(path, dpi=80, metadata=metadata)

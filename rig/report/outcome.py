"""The outcome of a run: solved, judged, written into the run folder, and printed."""

import json
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.console import Console

from rig.config.load import parse
from rig.recording import RunData
from rig.report.header import calibration_header
from rig.report.sensor import sensor_document
from rig.report.table import print_result
from rig.solution import DEFAULT_ESTIMATOR, solve_runs
from rig.verdict import judge, verdict

SCHEMA = "rig.result/1"


def solved_document(runs: Sequence[RunData], estimator: str = DEFAULT_ESTIMATOR) -> dict[str, Any]:
    """The `result.json` document of a run's recordings: the same from a run that just ended and from its files.

    Raises `Fault` or `Refused` by name when the recordings do not hold a calibration.
    """
    results = solve_runs(runs, estimator)
    limits = parse(runs[0].config, "the recorded configuration").config.limits
    checks = judge({name: result.solution for name, result in results.items()}, limits)
    return {
        "schema": SCHEMA,
        "verdict": verdict(checks),
        "checks": [check.document() for check in checks],
        "provenance": {
            **runs[0].provenance,
            "resumed_utc": [run.provenance["started_utc"] for run in runs[1:]],
            "solved_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        },
        "sensors": {name: sensor_document(result) for name, result in results.items()},
    }


def write_outcome(folder: Path, document: dict[str, Any]) -> None:
    """`calibration.h` and `result.json` into the run folder; the latter comes last and whole: it ends the run.

    A calibration that failed its limits gets no header: nobody should compile it in.
    """
    if document["verdict"] == "pass":
        (folder / "calibration.h").write_text(calibration_header(document), encoding="utf-8")
    part = folder / "result.json.part"
    part.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    part.replace(folder / "result.json")


def print_outcome(document: dict[str, Any], *, as_json: bool) -> None:
    """The document on stdout: tables for people, JSON for machines."""
    if as_json:
        print(json.dumps(document, indent=2, allow_nan=False))
    else:
        print_result(document, Console(highlight=False))

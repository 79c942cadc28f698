"""The outcome of a run: solved, judged, written into the run folder, and printed."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from rig.analysis.calibration import DEFAULT_ESTIMATOR, SensorResult, solve_runs
from rig.analysis.comparison import Reference
from rig.analysis.onboard_check import agreement
from rig.analysis.verdict import judge, verdict, verification_checks
from rig.analysis.verification import Verification, verify
from rig.data.result_file import SCHEMA
from rig.data.run_file import RunData
from rig.data.settings import KnownReference
from rig.report.figures import write_figures
from rig.report.header import calibration_header
from rig.report.sensor import sensor_document
from rig.report.table import print_result
from rig.report.verification_table import verification_document


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a run's recordings amount to: `document` is that of `result.json`, `verifications` hold the curves."""

    document: dict[str, Any]
    verifications: Mapping[str, Verification]

    @property
    def passed(self) -> bool:
        """Whether the verdict is a pass."""
        return bool(self.document["verdict"] == "pass")


def outcome_of(
    runs: Sequence[RunData], repeated: Sequence[RunData] | None = None, estimator: str = DEFAULT_ESTIMATOR
) -> Outcome:
    """Solve and judge recordings: the same for a run that just ended and from its files.

    `runs` are those of the calibration, none where only stored calibrations are verified; `repeated` those of the
    movement with calibrated readings, None where no verification is asked for. Raises `Fault` or `Refused` by name when
    the recordings do not hold what they should.
    """
    first = [*runs, *(repeated or ())][0]
    settings = first.settings
    results = solve_runs(runs, estimator) if runs else {}
    agreements = {name: agreement(runs, name) for name in settings.to_calibrate} if runs else {}
    checks = list(judge({name: results[name].solution for name in agreements}, settings.limits))
    checks += [check for name, agreed in agreements.items() for check in agreed.checks(name)]
    verifications: dict[str, Verification | None] = {}
    if repeated is not None:
        verifications = {
            name: _verified(name, settings.reference, runs, repeated, results) for name in settings.to_calibrate
        }
        checks += [
            c for name, found in verifications.items() for c in verification_checks(name, found, settings.limits)
        ]
    document = {
        "schema": SCHEMA,
        "verdict": verdict(checks),
        "checks": [check.document() for check in checks],
        "provenance": {
            **first.provenance,
            "stored_calibrations": (repeated or runs)[-1].provenance.get("stored_calibrations", {}),
            "resumed_utc": [run.provenance["started_utc"] for run in runs[1:]],
            "verified_utc": [run.provenance["started_utc"] for run in repeated or ()],
            "solved_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        },
        "sensors": {
            name: sensor_document(
                result, "calibrate" if name in settings.to_calibrate else "reference", agreements.get(name)
            )
            for name, result in results.items()
        },
        "verification": {n: verification_document(v) for n, v in verifications.items() if v is not None},
    }
    return Outcome(document, {name: found for name, found in verifications.items() if found is not None})


def _verified(
    name: str,
    reference: KnownReference | None,
    runs: Sequence[RunData],
    repeated: Sequence[RunData],
    results: Mapping[str, SensorResult],
) -> Verification | None:
    """What the repeated movement says of one sensor; None when there was none, or nothing to compare with."""
    if not repeated or reference is None:
        return None
    known = Reference(reference.name, np.array(reference.scale), np.array(reference.bias_rad_s))
    return verify(name, known, repeated, runs, results[name].solution if name in results else None)


def write_outcome(folder: Path, outcome: Outcome) -> Iterator[str]:
    """Figures, `calibration.h` and `result.json` into the run folder; yields what to tell the operator of the figures.

    A calibration that failed its limits gets no header: nobody should compile it in. `result.json` comes last and
    whole: it ends the run.
    """
    if outcome.verifications:
        yield write_figures(outcome.verifications.values(), folder)
    if outcome.passed and outcome.document["sensors"]:
        (folder / "calibration.h").write_text(calibration_header(outcome.document), encoding="utf-8")
    part = folder / "result.json.part"
    part.write_text(json.dumps(outcome.document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    part.replace(folder / "result.json")


def print_outcome(document: dict[str, Any], *, as_json: bool) -> None:
    """The document on stdout: tables for people, JSON for machines."""
    if as_json:
        print(json.dumps(document, indent=2, allow_nan=False))
    else:
        print_result(document, Console(highlight=False))

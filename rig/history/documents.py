"""A history for machines: JSON of schema "rig.history/1", and CSV with a line for each parameter. SI units."""

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rig.history.series import YEAR_DAYS, Change, RigState, Subject, Trend
from rig.history.statistics.charts import Chart
from rig.history.statistics.rig_effects import RigEffect
from rig.history.store import Past
from rig.report.findings.followed import Parameter

SCHEMA = "rig.history/1"
FORMULA = ("=", "+", "-", "@")  # what one begins with, in one spreadsheet or another, after white space too
COLUMNS = (
    "calibration",
    "run",
    "started_utc",
    "rig",
    "arm_serial_number",
    "part",
    "serial_number",
    "quantity",
    "full_scale",
    "estimator",
    "temperature_c",
    "verdict",
    "fit",
    "simulated",
    "check_standard",
    "operator",
    "note",
    "voided",
    "parameter",
    "value",
    "std_statistical",
    "std_combined",
    "unit",
    "max_deviation",
    "coverage_factor",
)


def history_document(
    pasts: Sequence[Past], trends: Mapping[Subject, Mapping[str, Trend]] | None = None
) -> dict[str, Any]:
    """Calibrations, and with `trends` what they say over time."""
    document: dict[str, Any] = {"schema": SCHEMA, "calibrations": [calibration_entry(each) for each in pasts]}
    if trends is not None:
        document["trends"] = [
            {**subject_entry(subject), "parameters": {name: trend_entry(trend) for name, trend in each.items()}}
            for subject, each in trends.items()
        ]
    return document


def history_csv(pasts: Sequence[Past]) -> str:
    """Comma-separated, with a heading; empty where nothing is known.

    A text that a spreadsheet would take for a formula has an apostrophe before it, as somebody would type it there.
    """
    out = io.StringIO(newline="")
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for past in pasts:
        entry = calibration_entry(past)
        shared = {name: entry[name] for name in COLUMNS if name in entry}
        for name, values in entry["parameters"].items():
            writer.writerow({column: cell(value) for column, value in {**shared, "parameter": name, **values}.items()})
    return out.getvalue()


def calibration_entry(past: Past) -> dict[str, Any]:
    """A calibration of the history as a document."""
    return {
        "calibration": past.id,
        "run": past.run_id,
        "started_utc": past.started_utc,
        "rig": past.rig,
        "arm_serial_number": past.arm_serial_number,
        "board_unique_id": past.board_unique_id,
        "sensor": past.sensor,
        **subject_entry(past.subject),
        "estimator": past.estimator,
        "temperature_c": past.temperature_c,
        "verdict": past.verdict,
        "fit": past.fit,
        "check_standard": past.check_standard,
        "operator": past.operator,
        "note": past.note,
        "voided": past.voided,
        "parameters": {name: _parameter(each) for name, each in past.parameters.items()},
    }


def subject_entry(subject: Subject) -> dict[str, Any]:
    """What was calibrated."""
    return dict(zip(("part", "serial_number", "quantity", "full_scale", "simulated"), subject, strict=True))


def trend_entry(trend: Trend) -> dict[str, Any]:
    """What a parameter did over time; null where there are too few calibrations."""
    line, mean = trend.line, trend.mean
    return {
        "unit": trend.unit,
        "calibrations": trend.count,
        "last": trend.last.value,
        "last_expanded": trend.last.expanded,
        "mean": None if mean is None else float(mean.coefficients[0]),
        "mean_std": None if mean is None else float(mean.std[0]),
        "between_std": None if mean is None else mean.between_std,
        "drift_per_year": None if line is None else float(line.coefficients[1]) * YEAR_DAYS,
        "drift_std_per_year": None if line is None else float(line.std[1]) * YEAR_DAYS,
        "drift_coverage_factor": None if line is None else line.coverage_factor,
        "drift_p_value": None if line is None else line.p_value(1),
        "chart": None if trend.chart is None else chart_entry(trend.chart),
        "recall": None if trend.recall is None else trend.recall.isoformat(),
    }


def change_entry(change: Change) -> dict[str, Any]:
    """A parameter of two calibrations."""
    return {
        "unit": change.unit,
        "before": _parameter(change.before),
        "now": _parameter(change.now),
        "normalised_error": change.normalised_error,
        "normalised_error_limit": change.limit,
        "changed": change.has_changed,
    }


def rigs_document(states: Sequence[RigState], effects: Mapping[str, Sequence[RigEffect]]) -> dict[str, Any]:
    """What check standards and shared sensors say of rigs; effects on scale factors are fractions."""
    return {
        "schema": SCHEMA,
        "rigs": [
            {
                "rig": state.rig,
                "check_standards": state.standards,
                "charts": {name: chart_entry(chart) for name, chart in state.charts.items()},
            }
            for state in states
        ],
        "effects": {
            name: [
                {
                    "rig": each.rig,
                    "reference": each.reference,
                    "value": each.value,
                    "std": each.std,
                    "expanded": each.expanded,
                    "between_std": each.between_std,
                    "shared_sensors": each.sensors,
                }
                for each in found
            ]
            for name, found in effects.items()
        },
    }


def chart_entry(chart: Chart) -> dict[str, Any]:
    """Null of the first results, which nothing could be held against."""
    return {
        "out_of_control": bool(chart.out_of_control) if chart.alarm.size else False,
        "deviation": _numbers(chart.deviation),
        "ewma": _numbers(chart.ewma),
        "limit": _numbers(chart.limit),
        "alarm": chart.alarm.tolist(),
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {
        "value": parameter.value,
        "std_statistical": parameter.std_statistical,
        "std_combined": parameter.std_combined,
        "unit": parameter.unit,
        "max_deviation": parameter.max_deviation,
        "coverage_factor": parameter.coverage_factor,
    }


def cell(value: object) -> object:
    """A value as a spreadsheet may read it: of one line, and no formula."""
    if not isinstance(value, str):
        return value
    line = " ".join(value.splitlines())
    return f"'{line}" if line[:1].isspace() or line.startswith(FORMULA) else line


def _numbers(values: np.ndarray) -> list[float | None]:
    return [value if np.isfinite(value) else None for value in values.tolist()]

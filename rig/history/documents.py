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
from rig.report.findings.history_records import Parameter

SCHEMA = "rig.history/1"
FORMULA_STARTS = ("=", "+", "-", "@")  # of a formula in common spreadsheets, even after white space
FIELDS = (  # of a calibration, in the order of its document
    "started_utc", "rig", "arm_serial_number", "board_unique_id", "sensor", "part", "serial_number", "quantity",
    "full_scale", "simulated", "estimator", "temperature_c", "verdict", "fit", "check_standard", "operator", "note",
    "voided",
)  # fmt: skip
PARAMETER_FIELDS = ("value", "std_statistical", "std_combined", "unit", "max_deviation", "coverage_factor")
COLUMNS = (
    "calibration", "run", "started_utc", "rig", "arm_serial_number", "part", "serial_number", "quantity",
    "full_scale", "estimator", "temperature_c", "verdict", "fit", "simulated", "check_standard", "operator", "note",
    "voided", "parameter", *PARAMETER_FIELDS,
)  # fmt: skip


def history_document(
    pasts: Sequence[Past], trends: Mapping[Subject, Mapping[str, Trend]] | None = None
) -> dict[str, Any]:
    """Return calibrations for JSON, and with `trends` also the trends of their parameters."""
    document: dict[str, Any] = {"schema": SCHEMA, "calibrations": [calibration_entry(past) for past in pasts]}
    if trends is not None:
        document["trends"] = [
            {**subject_entry(subject), "parameters": {name: trend_entry(trend) for name, trend in by_name.items()}}
            for subject, by_name in trends.items()
        ]
    return document


def history_csv(pasts: Sequence[Past]) -> str:
    """Return comma-separated values with a heading; an unknown value is empty.

    A text that a spreadsheet would read as a formula gets an apostrophe before it.
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
    """Return a calibration of the history as a document."""
    return {
        "calibration": past.id,
        "run": past.run_id,
        **{name: getattr(past, name) for name in FIELDS},
        "parameters": {name: _parameter(parameter) for name, parameter in past.parameters.items()},
    }


def subject_entry(subject: Subject) -> dict[str, Any]:
    """Return a subject (sensor, quantity and range) for JSON."""
    return dict(zip(("part", "serial_number", "quantity", "full_scale", "simulated"), subject, strict=True))


def trend_entry(trend: Trend) -> dict[str, Any]:
    """Return the trend of a parameter for JSON; a statistic that too few calibrations do not determine is null."""
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
    """Return a parameter's change for JSON."""
    return {
        "unit": change.unit,
        "before": _parameter(change.before),
        "now": _parameter(change.now),
        "normalised_error": change.normalised_error,
        "normalised_error_limit": change.limit,
        "changed": change.has_changed,
    }


def rigs_document(states: Sequence[RigState], effects: Mapping[str, Sequence[RigEffect]]) -> dict[str, Any]:
    """Return, for JSON, the control charts of each rig and, by parameter, the differences between rigs (`effects`)."""
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
                    "rig": effect.rig,
                    "reference": effect.reference,
                    "value": effect.value,
                    "std": effect.std,
                    "expanded": effect.expanded,
                    "between_std": effect.between_std,
                    "shared_sensors": effect.sensors,
                }
                for effect in rig_effects
            ]
            for name, rig_effects in effects.items()
        },
    }


def chart_entry(chart: Chart) -> dict[str, Any]:
    """Return a control chart for JSON; undefined numbers, such as the first deviations, are null."""
    return {
        "out_of_control": bool(chart.out_of_control) if chart.alarm.size else False,
        "deviation": _numbers(chart.deviation),
        "ewma": _numbers(chart.ewma),
        "limit": _numbers(chart.limit),
        "alarm": chart.alarm.tolist(),
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {name: getattr(parameter, name) for name in PARAMETER_FIELDS}


def cell(value: object) -> object:
    """Return the value in a form that a spreadsheet reads as a number or as one line of text, never as a formula."""
    if not isinstance(value, str):
        return value
    line = " ".join(value.splitlines())
    return f"'{line}" if line[:1].isspace() or line.startswith(FORMULA_STARTS) else line


def _numbers(values: np.ndarray) -> list[float | None]:
    return [value if np.isfinite(value) else None for value in values.tolist()]

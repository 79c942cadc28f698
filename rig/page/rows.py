"""Rows of the page's tables: observations and parameters, of a live run and of a finished run."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.analysis.partial_results import PartialGyroscope, PartialResults
from rig.data.quantity import RATE, DisplayUnit
from rig.data.result_file import ResultDocument
from rig.errors.attempts import Attempts
from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import COVERAGE_FACTOR
from rig.observation.observe import Observation, nearest_axis
from rig.observation.statistics.mean import QuantityInDwell, ReadAtRest
from rig.page.recent_readings import round_digits
from rig.report.findings.result_kind import AxisValues, DisplayRow
from rig.report.kinds.kind_registry import shown

NOISE_ONLY, COMBINED = "noise only", "combined"
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Look:
    """The analysis of recordings at some time: rows of observations and of parameters."""

    observations: list[Row]
    parameters: list[Row]


def observation_row(sensor: str, observation: Observation) -> Row:
    """Return the row of a revolution averaged by the host: the mean readings, and the mean speed of the turn.

    Its entry `along` is the fraction of the speed about the sensor axis that is nearest to the axis of the turn.
    """
    average = observation.average
    return {
        "sensor": sensor,
        "sweep": observation.sweep,
        "by": "host",
        "joint": observation.joint_name,
        "direction": observation.direction,
        "axis": observation.axis,
        "sign": observation.sign,
        "speed_rad_s": float(observation.speed_rad_s),
        "along": projection(observation.axis_flange),
        "mean_rad_s": round_digits(tuple(average.mean_rad_s.tolist())),
        "std_rad_s": float(average.mean_std_rad_s["xyz".index(observation.axis)]),
        "samples": average.samples,
        "lost": observation.lost,
        "refused": None,
    }


def projection(axis_flange: Sequence[float] | Array) -> float:
    """Return the component of a unit vector (3,), flange's frame, along the sensor axis that is nearest to it."""
    return float(np.max(np.abs(axis_flange)))


def dwell_row(read: ReadAtRest) -> Row:
    """Return the row of a dwell: the norm of the reading, and the expected norm, in the unit of display."""
    quantity, reading = read.subject.quantity, read.reading
    mean, size, unit = reading.mean, float(np.linalg.norm(reading.mean)), quantity.reading
    axis, sign = nearest_axis(mean)
    return {
        **_dwell(read.subject),
        "towards": f"{'+' if sign > 0 else '−'}{axis} {quantity.towards}",
        "size": size / unit.size,
        "std": float(np.sqrt(mean**2 @ reading.variance)) / size / unit.size if size else None,
        "expected": None if read.expected is None else read.expected / unit.size,
        "unit": unit.name,
        "samples": reading.samples,
        "refused": None,
    }


def _dwell(dwell: QuantityInDwell) -> Row:
    return {"sensor": dwell.quantity.label(dwell.sensor), "sweep": dwell.index, "by": "host", "dwell": dwell.dwell}


def look_of(partial: PartialResults) -> Look:
    """Return the page's rows of a run in progress."""
    sensors = partial.gyroscopes
    observations = [row for name, sensor in sensors.items() for row in _sweep_rows(name, sensor.sweeps)]
    observations += _dwell_rows(partial.at_rest)
    return Look(observations, [_parameters_so_far(name, one) for name, one in sensors.items()])


def parameter_rows(result: ResultDocument) -> list[Row]:
    """Return the rows of a run's result, kind by kind, with U or, if there is no budget, with twice the noise."""
    return [_row(row) for row in shown(result)]


def _sweep_rows(sensor: str, sweeps: Attempts[int, Observation]) -> list[Row]:
    """Return the rows of a gyroscope's sweeps in the order of the plan."""
    rows = {index: observation_row(sensor, observation) for index, observation in sweeps.results.items()}
    for index, fault in sweeps.faults.items():
        rows[index] = {"sensor": sensor, "sweep": index, "by": "host", "refused": str(fault)}
    return [row for _, row in sorted(rows.items())]


def _dwell_rows(dwells: Attempts[QuantityInDwell, ReadAtRest]) -> list[Row]:
    """Return the rows of all dwells, by sensor in the order of the plan."""
    rows = {dwell: dwell_row(read) for dwell, read in dwells.results.items()}
    rows |= {dwell: {**_dwell(dwell), "refused": str(fault)} for dwell, fault in dwells.faults.items()}
    return [rows[dwell] for dwell in sorted(rows, key=lambda dwell: (dwell.sensor, dwell.index))]


def _parameters_so_far(name: str, partial: PartialGyroscope) -> Row:
    """Return the row of a partial result: the solution with U or, without one, the bias at rest and what is missing."""
    if (solution := partial.solution) is not None:
        u = (COVERAGE_FACTOR * np.sqrt(np.diag(solution.covariance))).tolist()
        bias, scale = AxisValues(solution.bias_rad_s.tolist(), u[3:]), AxisValues(solution.scale.tolist(), u[:3])
        return _row(DisplayRow(name, RATE, name, RATE.bias, bias, combined=False, scale=scale))
    missing = None if partial.missing is None else partial.missing.what
    if partial.bias_rad_s is None:
        return {**_row_of(name, RATE.bias, None, None, contents=NOISE_ONLY), "missing": missing}
    mean, std = partial.bias_rad_s
    bias = AxisValues(mean.tolist(), (COVERAGE_FACTOR * std).tolist())
    return {**_row_of(name, RATE.bias, bias, None, contents=NOISE_ONLY), "missing": missing}


def _row(shown: DisplayRow) -> Row:
    contents = COMBINED if shown.combined else NOISE_ONLY
    row = _row_of(shown.name, shown.unit, shown.numbers, shown.scale, contents=contents)
    return {**row, "labels": list(shown.labels), "missing": None}


def _row_of(name: str, unit: DisplayUnit, bias: AxisValues | None, scale: AxisValues | None, *, contents: str) -> Row:
    row: Row = {"sensor": name, "labels": list(RATE.axes), "unit": unit.name, "of": contents}
    for key, three in (("scale", scale), ("bias", bias)):
        row[key] = None if three is None else [float(value) for value in three.values]  # rounded on the screen
        row[f"{key}_u"] = None if three is None else round_digits(tuple(three.expanded))
    return row

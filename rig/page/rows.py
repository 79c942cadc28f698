"""Rows of the page's tables: observations and parameters, of a run that goes on and of one with its result."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.analysis.partial_results import SoFar, Turned
from rig.data.quantity import RATE, Unit
from rig.data.result_file import ResultDocument
from rig.errors.attempts import Attempts
from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import COVERAGE_FACTOR
from rig.observation.observe import Observation, nearest_axis
from rig.observation.statistics.mean import QuantityInDwell, ReadAtRest
from rig.page.history import rounded
from rig.report.findings.kind import Shown, Three
from rig.report.kinds.registry import shown

NOISE_ONLY, COMBINED = "noise only", "combined"
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Look:
    """What recordings amount to at some time: rows of observations and of parameters."""

    observations: list[Row]
    parameters: list[Row]


def observation_row(sensor: str, observation: Observation) -> Row:
    """A revolution the host has averaged: what one axis read stands beside the part of 2π/T that is along it."""
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
        "along": along(observation.axis_flange),
        "mean_rad_s": rounded(tuple(average.mean_rad_s.tolist())),
        "std_rad_s": float(average.mean_std_rad_s["xyz".index(observation.axis)]),
        "samples": average.samples,
        "lost": observation.lost,
        "refused": None,
    }


def along(axis_flange: Sequence[float] | Array) -> float:
    """The part of a turn about a unit vector (3,) that the nearest axis feels, of a sensor mounted along the flange."""
    return float(np.max(np.abs(axis_flange)))


def dwell_row(read: ReadAtRest) -> Row:
    """What was read in an attitude: the size of it stands beside the one that is expected, in the unit on a screen."""
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


def _dwell(of: QuantityInDwell) -> Row:
    return {"sensor": of.quantity.label(of.sensor), "sweep": of.index, "by": "host", "dwell": of.dwell}


def look_of(partial: SoFar) -> Look:
    """What is known of a run that goes on."""
    sensors = partial.gyroscopes
    observations = [row for name, sensor in sensors.items() for row in _sweep_rows(name, sensor.sweeps)]
    observations += _dwell_rows(partial.at_rest)
    return Look(observations, [_parameters_so_far(name, one) for name, one in sensors.items()])


def parameter_rows(result: ResultDocument) -> list[Row]:
    """The rows of a run's result, kind by kind; U is what the result states, or twice its noise."""
    return [_row(each) for each in shown(result)]


def _sweep_rows(sensor: str, sweeps: Attempts[int, Observation]) -> list[Row]:
    """Return the rows of a gyroscope's sweeps in the order of the plan."""
    rows = {index: observation_row(sensor, observation) for index, observation in sweeps.results.items()}
    for index, fault in sweeps.faults.items():
        rows[index] = {"sensor": sensor, "sweep": index, "by": "host", "refused": str(fault)}
    return [row for _, row in sorted(rows.items())]


def _dwell_rows(dwells: Attempts[QuantityInDwell, ReadAtRest]) -> list[Row]:
    """Return the rows of all dwells, by sensor in the order of the plan."""
    rows = {of: dwell_row(read) for of, read in dwells.results.items()}
    rows |= {of: {**_dwell(of), "refused": str(fault)} for of, fault in dwells.faults.items()}
    return [rows[of] for of in sorted(rows, key=lambda of: (of.sensor, of.index))]


def _parameters_so_far(name: str, partial: Turned) -> Row:
    if (solution := partial.solution) is not None:
        u = (COVERAGE_FACTOR * np.sqrt(np.diag(solution.covariance))).tolist()
        bias, scale = Three(solution.bias_rad_s.tolist(), u[3:]), Three(solution.scale.tolist(), u[:3])
        return _row(Shown(name, RATE, name, RATE.bias, bias, combined=False, scale=scale))
    missing = None if partial.missing is None else partial.missing.what
    if partial.bias_rad_s is None:
        return {**_row_of(name, RATE.bias, None, None, of=NOISE_ONLY), "missing": missing}
    mean, std = partial.bias_rad_s
    bias = Three(mean.tolist(), (COVERAGE_FACTOR * std).tolist())
    return {**_row_of(name, RATE.bias, bias, None, of=NOISE_ONLY), "missing": missing}


def _row(shown: Shown) -> Row:
    of = COMBINED if shown.combined else NOISE_ONLY
    row = _row_of(shown.name, shown.unit, shown.numbers, shown.scale, of=of)
    return {**row, "labels": list(shown.labels), "missing": None}


def _row_of(name: str, unit: Unit, bias: Three | None, scale: Three | None, *, of: str) -> Row:
    row: Row = {"sensor": name, "labels": list(RATE.axes), "unit": unit.name, "of": of}
    for what, each in (("scale", scale), ("bias", bias)):
        row[what] = None if each is None else [float(value) for value in each.values]  # rounded on the screen alone
        row[f"{what}_u"] = None if each is None else rounded(tuple(each.expanded))
    return row

"""Rows of the page's tables: observations and parameters, of a run that goes on and of one with its result."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.analysis.so_far import SoFar
from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.budget_entries import expanded_uncertainties
from rig.data.result_file import ResultDocument, SensorEntry
from rig.errors import Fault
from rig.estimation.coverage import COVERAGE_FACTOR
from rig.estimation.vector_model import VectorSolution
from rig.observation.acceleration import DwellReading
from rig.observation.observe import Observation, nearest_axis
from rig.page.history import rounded

NOISE_ONLY, COMBINED = "noise only", "combined"
Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Look:
    """What recordings amount to at some time: rows of observations and of parameters."""

    observations: list[Row]
    parameters: list[Row]


def observation_row(sensor: str, observation: Observation) -> Row:
    """A revolution the host has averaged: what the sensor read along the turn stands beside 2π/T."""
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
        "mean_rad_s": rounded(tuple(average.mean_rad_s.tolist())),
        "std_rad_s": float(average.mean_std_rad_s["xyz".index(observation.axis)]),
        "samples": average.samples,
        "lost": observation.lost,
        "refused": None,
    }


def dwell_row(sensor: str, dwell: DwellReading, gravity_m_s2: float | None) -> Row:
    """What an accelerometer read in an attitude: the size of it stands beside gravity."""
    mean, size = dwell.reading.mean, float(np.linalg.norm(dwell.reading.mean))
    axis, sign = nearest_axis(mean)
    return {
        "sensor": accelerometer(sensor),
        "sweep": dwell.index,
        "by": "host",
        "dwell": dwell.name,
        "axis": axis,
        "sign": sign,
        "size_m_s2": size,
        "std_m_s2": float(np.sqrt(mean**2 @ dwell.reading.variance)) / size if size else None,
        "gravity_m_s2": gravity_m_s2,
        "samples": dwell.reading.samples,
        "refused": None,
    }


def accelerometer(sensor: str) -> str:
    """How the tables call the accelerometer in a sensor."""
    return f"{sensor}, accelerometer"


def look_of(found: Mapping[str, SoFar]) -> Look:
    """Of a run that goes on."""
    observations = [_sweep(name, sweep, each) for name, one in found.items() for sweep, each in one.sweeps.items()]
    for name, one in found.items():
        observations += [_dwell(name, index, each, one.gravity_m_s2) for index, each in one.dwells.items()]
    return Look(observations, [_parameters_so_far(name, one) for name, one in found.items()])


def parameter_rows(result: ResultDocument) -> list[Row]:
    """Of a run's result: gyroscopes, then accelerometers; U is what the result states, or twice its noise."""
    rows = []
    for name, sensor in result.sensors.items():
        rows.append(_stated(name, "rad/s", sensor.scale, sensor.bias_rad_s, sensor))
    for name, found in result.accelerometers.items():
        rows.append(_stated(accelerometer(name), "m/s²", found.scale, found.bias_m_s2, found))
    return rows


def _stated(name: str, unit: str, scale: Any, bias: Any, found: SensorEntry | AccelerometerEntry) -> Row:
    expanded = expanded_uncertainties(found.budget, found.covariance)
    return _row(name, unit, scale, bias, expanded, of=NOISE_ONLY if found.budget is None else COMBINED)


def _sweep(sensor: str, sweep: int, found: Observation | Fault) -> Row:
    if isinstance(found, Observation):
        return observation_row(sensor, found)
    return {"sensor": sensor, "sweep": sweep, "by": "host", "refused": str(found)}


def _dwell(sensor: str, index: int, found: DwellReading | Fault, gravity_m_s2: float | None) -> Row:
    if isinstance(found, DwellReading):
        return dwell_row(sensor, found, gravity_m_s2)
    return {"sensor": accelerometer(sensor), "sweep": index, "by": "host", "dwell": "", "refused": str(found)}


def _parameters_so_far(name: str, found: SoFar) -> Row:
    solution = found.solution
    if isinstance(solution, VectorSolution):
        expanded = (COVERAGE_FACTOR * np.sqrt(np.diag(solution.covariance))).tolist()
        return _row(name, "rad/s", solution.scale, solution.bias_rad_s, expanded, of=NOISE_ONLY)
    row = {"sensor": name, "unit": "rad/s", "scale": None, "scale_u": None, "of": NOISE_ONLY, "missing": solution.what}
    if found.bias_rad_s is None:
        return {**row, "bias": None, "bias_u": None}
    bias, std = found.bias_rad_s
    return {**row, "bias": rounded(tuple(bias.tolist())), "bias_u": rounded(tuple((COVERAGE_FACTOR * std).tolist()))}


def _row(name: str, unit: str, scale: Any, bias: Any, expanded: Sequence[float], *, of: str) -> Row:
    return {
        "sensor": name,
        "unit": unit,
        "scale": [float(each) for each in scale],  # rounded on the screen alone
        "scale_u": rounded(tuple(expanded[:3])),
        "bias": [float(each) for each in bias],
        "bias_u": rounded(tuple(expanded[3:])),
        "of": of,
        "missing": None,
    }

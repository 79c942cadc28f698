"""Fault modes of a recording with their minimal detectable size, and the error of a result that goes undetected."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.consistency.alternatives import FAULT_MODES, Means
from rig.analysis.environment import MeasurementEnvironment
from rig.analysis.gyroscope.vector_inputs import list_uncertainties
from rig.data.quantity import RATE, Quantity
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import UnknownErrors, budget
from rig.estimation.gyroscope.vector_fit import VectorFit, explain
from rig.observation.consistency.raw_readings import REST

if TYPE_CHECKING:
    from rig.analysis.gyroscope.calibration import SensorResult


@dataclass(frozen=True, slots=True)
class DetectionLimit:
    """The smallest `size` of the fault `what`, in `unit`, that the check `check` detects in 95 of 100 recordings.

    `size` is infinite if the check detects no size. `off_by_expanded` is the largest error of a scale factor or bias
    due to a fault of this size, divided by U; None if not computed, or if there is no solution with the fault.
    """

    what: str
    check: str
    size: float
    unit: str
    off_by_expanded: float | None = None


def find_gyroscope_limits(
    sizes: Mapping[str, float], name: str, result: "SensorResult", environment: MeasurementEnvironment
) -> Iterator[DetectionLimit]:
    """Yield the detection limits of the gyroscope `name`, from the minimal detectable `sizes` by fault mode."""
    explained = result.explained
    if explained is None:
        return
    means, mounting = _means_of_solve(explained), np.array(result.sensor.mounting)
    inputs = list_uncertainties(environment, name, result.earth)
    for mode in FAULT_MODES:
        if (size := sizes.get(mode.what)) is None:
            continue
        ratio = None
        if np.isfinite(size) and result.uncertainty is not None:
            ratio = _error_over_expanded(size * mode.patterns(means), explained, mounting, inputs)
        yield DetectionLimit(mode.what, mode.check, size, mode.unit or RATE.unit, ratio)


def find_reference_limits(sizes: Mapping[str, float], quantity: Quantity) -> tuple[DetectionLimit, ...]:
    """Return detection limits of an accelerometer or magnetometer, from minimal detectable `sizes` by fault mode."""
    from rig.analysis.consistency.reference_alternatives import FAULT_MODES as REFERENCE_FAULT_MODES

    return tuple(
        DetectionLimit(mode.what, f"{quantity}_{mode.check}", sizes[mode.what], mode.unit or quantity.unit)
        for mode in REFERENCE_FAULT_MODES
        if mode.what in sizes
    )


def _means_of_solve(explained: VectorFit) -> Means:
    """Return the means from which the solution was estimated: modelled rates along the sensor's axes, times, sweeps."""
    inputs_of_solve = explained.inputs
    turns = np.flatnonzero(inputs_of_solve.turns_rad_s.any(axis=1))
    sweep = np.full(len(inputs_of_solve.turns_rad_s), REST)
    sweep[turns] = np.arange(len(turns))
    return Means(inputs_of_solve.rates_rad_s @ explained.solution.matrix.T, inputs_of_solve.windows_s, sweep)


def _error_over_expanded(patterns: Array, explained: VectorFit, mounting: Array, inputs: UnknownErrors) -> float | None:
    """Return the largest error of a scale factor or bias, divided by its U, due to the worst of `patterns` (k, N, 3).

    Each pattern is an effect of the fault on the means. The means are solved again with the worst one added, and U is
    that of this solution, because the fault may look like bias drift and increase U. Return None if there is no
    solution.
    """
    solution, inputs_of_solve = explained.solution, explained.inputs
    response = np.einsum("qni,kni->kq", solution.response, patterns) / np.sqrt(np.diag(solution.covariance))
    worst = patterns[int(np.argmax(np.abs(response).max(axis=1)))]
    try:
        damaged = explain(replace(inputs_of_solve, means_rad_s=inputs_of_solve.means_rad_s + worst), mounting)
    except Fault:
        return None
    with_fault, undamaged = damaged.solution, solution
    errors = np.concatenate([with_fault.scale - undamaged.scale, with_fault.bias_rad_s - undamaged.bias_rad_s])
    return float(np.max(np.abs(errors) / budget(damaged, inputs).expanded))

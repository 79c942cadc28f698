"""The change of a gyroscope's bias over a file's rows of sweeps: a jump is refused, other changes are part of U."""

from dataclasses import replace

import numpy as np

from rig.data.quantity import RATE
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.external.bias_step import SteppedBias, find_bias_step
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.gyroscope.rotations_by_angle import BIAS, TurnedSolution
from rig.observation.arm_rests import estimate_bias_drift
from rig.observation.average import Average
from rig.observation.external.csv_import import ExternalData

OF_RATE = 0.01  # of the sweeps' rate: without rests, a smaller step may be that of the rate


def check_bias_steady(data: ExternalData) -> None:
    """Raise Fault `bias_jumped` if the bias steps by more than drift between two rows."""
    step, averages = _find_step(data)
    if step is None or data.at_reference:  # then polynomials contain the bias's change
        return
    axis = int(np.argmax(np.abs(step.size_rad_s)))
    size, average = float(step.size_rad_s[axis]), averages[step.row]
    if abs(size) <= RATE.steady or not _is_certain(data, average.start_s, axis, size):
        return
    raise Fault(
        "bias_jumped",
        f"from {average.start_s:.6g} s on the gyroscope reads {abs(size):.2g} rad/s {'more' if size > 0 else 'less'} "
        f"on {RATE.axes[axis]} than in the rows before: its bias is another",
        "Solve the parts before and after separately; look for a knock, or a range that was switched; let it warm up, "
        "or calibrate over temperature (--reference-c)",
    )


def estimate_bias_variance(data: ExternalData) -> Array:
    """Return the variance (3,) of the bias over the rows, (rad/s)²: that of a step, and that from rest to rest.

    A step of h is ± h/2 about the mean bias. The variance is zero if the rows show no change.
    """
    step, _ = _find_step(data)
    of_step = np.zeros(3) if step is None else (step.size_rad_s / 2) ** 2
    return np.maximum(of_step, estimate_bias_drift(_rests(data)))


def widen_bias(solution: TurnedSolution, data: ExternalData) -> TurnedSolution:
    """Return a solution by turns with the bias's variance over the rows in its covariances and its budget."""
    variance = estimate_bias_variance(data)
    more = np.diag([0, 0, 0, *variance])
    lines = solution.budget.contributors
    return replace(
        solution,
        covariance=solution.covariance + more,
        matrix_covariance=solution.matrix_covariance + np.diag([*np.zeros(9), *variance]),
        budget=Budget(
            tuple(replace(line, covariance=line.covariance + more) if line.name == BIAS else line for line in lines)
        ),
    )


def _find_step(data: ExternalData) -> tuple[SteppedBias | None, list[Average]]:
    """Return the bias' step, or None, and the averages in the order of time, which the step's row counts."""
    rows = [(sweep.average, sweep.speed_rad_s * sweep.axis_flange) for sweep in data.sweeps]
    rows += [(rest, np.zeros(3)) for rest in _rests(data)]
    rows.sort(key=lambda row: row[0].start_s)
    averages = [average for average, _ in rows]
    means = np.array([average.mean_rad_s for average in averages])
    variances = np.array([average.variance_rad2_s2 for average in averages])
    return find_bias_step(means, variances, np.array([rate for _, rate in rows])), averages


def _rests(data: ExternalData) -> tuple[Average, ...]:
    """Return the stated rests, and with turns also the rests found between them."""
    return data.rests if data.turned is None else data.turned.rests


def _is_certain(data: ExternalData, from_s: float, axis: int, size_rad_s: float) -> bool:
    """Return whether rests on either side also show an axis' step; without such rests, whether no rate explains it."""
    before = [rest.mean_rad_s[axis] for rest in _rests(data) if rest.start_s < from_s]
    after = [rest.mean_rad_s[axis] for rest in _rests(data) if rest.start_s >= from_s]
    if before and after:
        return bool((np.median(after) - np.median(before)) / size_rad_s > 1 / 2)
    return abs(size_rad_s) > OF_RATE * float(np.median([sweep.speed_rad_s for sweep in data.sweeps]))
